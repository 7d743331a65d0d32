"""Wear tests: assembly from a scenario, run, records and restart."""
