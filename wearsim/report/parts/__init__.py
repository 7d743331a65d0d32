"""Common parts of the figures: style, files, profiles, contact patches."""
