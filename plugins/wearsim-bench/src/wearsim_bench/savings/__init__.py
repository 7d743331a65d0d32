"""Cost saved where a problem needs less."""
