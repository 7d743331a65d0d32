"""The incremental solver: scene, state, steppers, step-size control and the loop."""
