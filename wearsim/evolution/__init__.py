"""The incremental solver: problem, state, steppers, step-size control and the loop."""
