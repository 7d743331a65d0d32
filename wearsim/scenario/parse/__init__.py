"""From TOML text to a validated scenario, or to a list of all its mistakes."""
