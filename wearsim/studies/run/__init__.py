"""A wear test: assembled from a scenario, stepped, recorded and resumed."""
