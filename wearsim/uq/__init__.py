"""Uncertainty quantification: distributions, sampling, estimation and sensitivity."""
