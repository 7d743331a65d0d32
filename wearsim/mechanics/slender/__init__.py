"""Normal contact of slender patches: line loads on strips."""
