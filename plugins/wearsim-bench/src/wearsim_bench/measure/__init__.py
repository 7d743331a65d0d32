"""Timings, memory, the machine, and measured points."""
