"""Steppers against converged runs."""
