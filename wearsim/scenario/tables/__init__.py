"""The tables of a scenario."""
