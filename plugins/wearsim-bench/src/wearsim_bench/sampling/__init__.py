"""Benchmark of sampling plans."""
