"""Sobol indices."""
