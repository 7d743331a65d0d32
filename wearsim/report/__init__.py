"""Figures of results, and numbers as text."""
