"""Wear factors of several tests: noise of traces, hierarchical model, verdict and power."""
