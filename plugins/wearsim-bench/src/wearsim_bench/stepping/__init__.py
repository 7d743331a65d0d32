"""Benchmark of steppers against converged runs."""
