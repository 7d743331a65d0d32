"""Estimates of moments and quantiles, with their intervals."""
