"""The numbers of Chevalier, Cloupet and Soize, Wear 258 (2005), computed from their inputs."""
