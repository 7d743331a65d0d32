"""Sensitivity analysis: Sobol indices."""
