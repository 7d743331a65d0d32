"""Distributions with closed or tabulated quantile functions."""
