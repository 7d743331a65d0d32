"""Errors of steps in which rollers that differ pass at the same time."""

from __future__ import annotations

import numpy as np
import pytest

import wearsim
from tests.evolution import SCENARIOS
from wearsim.studies.run.result import Result

#: a high wear factor: rollers of different tilt wear a groove of 6 um in 31 passes
FEW = {
    "operation.passes": 31,
    "wear.cylinder.k_over_h": "1e-7 1/Pa",
    "wear.roller.k_over_h": "2e-8 1/Pa",
    "evolution.tolerance": 1e-4,
    "evolution.strip_error": False,
}
TILTED = {"creepage.tilt": ["-0.7 mrad", "1.2 mrad", "0 mrad"]}
SEPARATE = {"creepage.tilt": ["1.5 mrad", "1.5 mrad", "-1 mrad"]}
ERRORS = ("depth", "volume", "profile")


def run(**overrides: object) -> Result:
    scenario = wearsim.load_scenario(SCENARIOS / "rig-450min.toml", FEW)
    return wearsim.run(scenario.changed(overrides))


def stated(result: Result) -> list[float]:
    """Return the relative errors by steps at the end."""
    volume = result.worn_volume[-1] + 3.0 * np.mean(result.roller_worn_volume[-1])
    sizes = result.depth[-1], volume, 1.0
    names = (f"{name}_error_by_steps" for name in ERRORS)
    return [
        float(np.ravel(getattr(result, name)[-1])[0] / size)
        for name, size in zip(names, sizes, strict=True)
    ]


@pytest.mark.parametrize("passes", [30, 31, 32, 301])
@pytest.mark.parametrize("rollers", [TILTED, SEPARATE])
def test_error_covers_the_order_of_rollers(rollers: dict[str, object], passes: int) -> None:
    changes = {**rollers, "operation.passes": passes}
    steps = run(**changes)
    y = steps.y
    strips = {"contact.strips": len(y), "contact.width": f"{(y[1] - y[0]) * len(y)} m"}
    single = run(**changes, **strips, **{"evolution.stepper": "per-pass"})
    np.testing.assert_allclose(single.y, y, atol=1e-12)
    bodies = [
        np.concatenate([np.ravel(one.profiles[-1]), np.ravel(one.roller_profiles[-1])])
        for one in (steps, single)
    ]
    true = (
        abs(steps.depth[-1] / single.depth[-1] - 1.0),
        abs(steps.worn_volume[-1] / single.worn_volume[-1] - 1.0),
        np.linalg.norm(bodies[0] - bodies[1]) / np.linalg.norm(bodies[1]),
    )
    assert all(error <= bound for error, bound in zip(true, stated(steps), strict=True))
    assert true[2] > 10.0 * steps.scenario.evolution.tolerance  # steps alone would not cover it
    assert stated(single) == [0.0, 0.0, 0.0]


def test_warning_names_the_stepper_that_takes_rollers_in_turn() -> None:
    (warning,) = (text for text in run(**TILTED).warnings if "above the tolerance" in text)
    assert 'evolution.stepper = "per-pass" takes their passes one by one' in warning
    assert "pass one after another" in warning


def test_equal_rollers_and_unworn_bodies_have_no_such_error() -> None:
    differing, equal = run(**TILTED), run()
    assert stated(differing)[0] > 20.0 * stated(equal)[0]
    assert differing.depth_error[0] == differing.volume_error[0] == 0.0
