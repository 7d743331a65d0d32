"""Invariants of random scenarios over the whole scenario language."""
