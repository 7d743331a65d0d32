"""Ensembles: a whole wear test for each realisation of the random inputs."""
