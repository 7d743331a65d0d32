"""Wear tests that are stepped together."""
