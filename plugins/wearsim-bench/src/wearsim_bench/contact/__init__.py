"""Benchmark of contact models against exact solutions."""
