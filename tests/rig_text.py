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


def short_rig() -> str:
    """Return the TOML of a test of half a minute."""
    return f"""{BODIES}
[operation]
speed = "1000 rpm"
duration = "30 s"
rollers = 3

[load]
kind = "constant"
normal_force = "300 N"

{RUBBING}
[wear]
law = "archard-dissipation"
cylinder.k_over_h = "1.1e-11 1/Pa"
roller.k_over_h = "0 1/Pa"
"""
