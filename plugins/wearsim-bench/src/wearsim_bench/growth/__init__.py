"""Benchmark of time and memory against the size of a study."""
