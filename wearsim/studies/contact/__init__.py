"""One contact, and Monte Carlo studies of one contact."""
