"""Kernels and closed forms: plain arrays in, plain arrays out."""
