"""Evolution of wear: problem, state, steppers, error control and integration."""
