"""Comparison of runs and ensembles at the ends of their tests."""
