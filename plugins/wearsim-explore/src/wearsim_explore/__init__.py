"""Page on which the values of a scenario are changed, and its results follow."""
