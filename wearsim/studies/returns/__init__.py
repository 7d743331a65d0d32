"""Returns from the field: lives of units in service, and what they say of the design."""
