"""Figures and tables of benchmarks."""
