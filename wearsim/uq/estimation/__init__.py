"""Estimates of moments and quantiles with confidence intervals."""
