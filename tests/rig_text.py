"""TOML of the test rig, in pieces that the scenarios of the tests are put together from."""

BODIES = """\
[roller]
radius = "20 mm"
crown_radius = "500 mm"
material = "steel"

[cylinder]
radius = "25 mm"
material = "steel"
"""

RUBBING = """\
[friction]
coefficient = 0.1

[creepage]
longitudinal = 1e-3
"""
