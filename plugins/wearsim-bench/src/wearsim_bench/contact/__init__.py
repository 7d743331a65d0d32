"""Contact models against exact solutions."""
