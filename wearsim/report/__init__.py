"""Figures from a results file or a contact, one module per figure."""
