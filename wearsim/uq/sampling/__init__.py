"""Sampling designs and random number streams."""
