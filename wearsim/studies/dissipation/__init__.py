"""Realisations of one contact: the study, its file, its result and its view."""
