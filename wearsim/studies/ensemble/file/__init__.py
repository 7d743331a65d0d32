"""Results of an ensemble of wear tests."""
