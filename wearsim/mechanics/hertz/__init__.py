"""Hertzian contact: ellipses, patches and fitted parabolas."""
