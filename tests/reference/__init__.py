"""How near contact models come to the exact theory, and the exact theory's own closed forms."""
