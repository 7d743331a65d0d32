"""Built-in theories of the tangential contact."""
