"""Probability distributions with closed or tabulated quantile functions."""
