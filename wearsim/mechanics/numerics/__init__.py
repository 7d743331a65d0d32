"""Compilation of kernels, and the numerical methods that they share."""
