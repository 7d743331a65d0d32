"""Rolling-contact fatigue beside wear: observables, displays, and lives that end by pitting."""
