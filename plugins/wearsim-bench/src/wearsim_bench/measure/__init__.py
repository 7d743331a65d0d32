"""Timings, memory, machine and measurements."""
