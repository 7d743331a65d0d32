"""Statistics of lives: censored samples, fits, mixtures over the wear factor, rare events."""
