"""Error estimates of steps, and the step size."""
