"""Single contacts, and Monte Carlo studies of a contact."""
