"""Parsing of TOML into a validated scenario or a list of all its mistakes."""
