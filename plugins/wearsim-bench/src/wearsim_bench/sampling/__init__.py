"""Benchmark of sampling designs."""
