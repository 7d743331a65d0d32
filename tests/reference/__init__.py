"""Accuracy of the contact models against exact theory, and a reference half-space solver."""
