"""Materials of the tests."""

from wearsim.types import Material

#: steel of the exact contact solutions
STEEL = Material(youngs_modulus=200e9, poisson_ratio=0.3)
