"""Measurements of speed against error, and the hard cases."""
