"""Rolling contact with friction: strip theory, FASTSIM and FaStrip."""
