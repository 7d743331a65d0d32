"""Choice of design variables for wearsim: search, fronts, confirmation and robustness."""
