"""Identification of the wear factor from measured profiles: K/H of each test, and its scatter."""
