"""Comparison of wearsim with published tests and simulations."""
