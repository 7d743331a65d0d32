"""Studies of single contacts, wear tests and ensembles of wear tests."""
