"""Figures and tables of the benchmarks."""
