"""Rare, early ends of life: draws of further tests, their stages, and the estimates."""
