"""Benchmark of savings: omitted computations that a problem does not require."""
