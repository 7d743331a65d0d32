"""Cams: motion, loads and skid over a turn, and the stations of a run."""
