"""Results of one wear test."""
