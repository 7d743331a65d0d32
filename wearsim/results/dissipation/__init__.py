"""Results of a Monte Carlo study of one contact."""
