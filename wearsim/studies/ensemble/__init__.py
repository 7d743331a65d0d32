"""Ensembles: a wear test for each realisation of the random inputs."""
