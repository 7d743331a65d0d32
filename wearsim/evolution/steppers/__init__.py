"""Schemes that advance a wear test by one step."""
