"""Hard cases and their verdicts."""
