"""Tables of a scenario."""
