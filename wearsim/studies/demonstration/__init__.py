"""Demonstration tests: how many specimens for how long show the life of a design."""
