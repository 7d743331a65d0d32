"""Benchmarks of time against error, and the hard cases."""
