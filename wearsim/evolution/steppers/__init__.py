"""Time integration schemes for a wear test."""
