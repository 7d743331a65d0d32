"""Error estimates and step-size control."""
