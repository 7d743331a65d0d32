"""Life of a design: tests that end at a limit, with the wear factor integrated exactly."""
