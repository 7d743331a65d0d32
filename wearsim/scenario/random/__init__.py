"""Random inputs in the place of values."""
