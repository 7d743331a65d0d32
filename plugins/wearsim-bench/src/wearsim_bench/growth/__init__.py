"""Time and memory against problem size."""
