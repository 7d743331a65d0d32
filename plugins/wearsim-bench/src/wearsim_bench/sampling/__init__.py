"""Sampling designs against their limit."""
