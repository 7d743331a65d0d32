"""Wear tests that are stepped together as realisations of one problem."""
