"""Random inputs of a scenario."""
