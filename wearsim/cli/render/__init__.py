"""Tables and text for the terminal, and the data of the JSON output."""
