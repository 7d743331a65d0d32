"""Built-in wear laws."""
