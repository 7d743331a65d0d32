"""Progress of runs and ensembles on stderr."""
