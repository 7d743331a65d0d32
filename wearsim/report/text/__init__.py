"""Numbers, units and labels as text."""
