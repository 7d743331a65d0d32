"""Built-in contact models."""
