"""Stated errors due to the strips, against tests on fine strips."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import wearsim
from wearsim.evolution.strip_errors import Course, strip_errors
from wearsim.types import Grid

RIG = Path(__file__).parents[2] / "scenarios" / "rig-450min.toml"
SHORT: dict[str, object] = {"operation.duration": "5 min"}
FREE: dict[str, object] = {
    **SHORT,
    "operation.rollers": 1,
    "creepage": {"drive": "free", "bearing_torque": "10 N mm"},
}
ADHESION: dict[str, object] = {
    "roller.radius": "20 mm",
    "roller.crown_radius": "50 mm",
    "cylinder.radius": "10 mm",
    "load.normal_force": "10 N",
    "creepage.longitudinal": 1e-5,
    "wear.cylinder.k_over_h": "1e-9 1/Pa",
    "operation.rollers": 1,
    "operation.duration": "3000 min",
}


def run(changes: dict[str, object]) -> wearsim.Result:
    return wearsim.run(wearsim.load_scenario(RIG, overrides=changes))


def fine(changes: dict[str, object], like: wearsim.Result) -> wearsim.Result:
    """Return the same test with small steps on strips of a quarter of the width."""
    spacing = like.y[1] - like.y[0]
    strips: dict[str, object] = {
        "contact.strips": 4 * len(like.y),
        "contact.width": f"{float(len(like.y) * spacing)!r} m",
        "evolution.tolerance": 1e-5,
        "evolution.strip_error": False,
    }
    return run({**changes, **strips})


@pytest.mark.parametrize("changes", [SHORT, FREE, ADHESION], ids=["full slip", "free", "adhesion"])
def test_stated_error_covers_that_of_the_strips(changes: dict[str, object]) -> None:
    result = run(changes)
    true = fine(changes, result)
    error = abs(result.depth[-1] - true.depth[-1])
    assert error <= result.depth_error[-1] <= 100.0 * error + 1e-3 * result.depth[-1]
    assert abs(result.worn_volume[-1] - true.worn_volume[-1]) <= result.volume_error[-1]


def test_parts_of_the_stated_error_add_up() -> None:
    result = run(SHORT)
    for name in ("depth", "volume", "profile"):
        parts = [getattr(result, f"{name}_error_by_{part}") for part in ("steps", "strips")]
        np.testing.assert_array_equal(getattr(result, f"{name}_error"), parts[0] + parts[1])
        assert parts[1][-1] > 0.0
    assert (result.depth_error_by_strips[0] == 0.0).all()


def test_error_due_to_the_strips_can_be_left_out() -> None:
    result = run({**SHORT, "evolution.strip_error": False})
    assert np.isnan(result.depth_error_by_strips).all()
    np.testing.assert_array_equal(result.depth_error, result.depth_error_by_steps)


def test_equal_courses_have_no_error() -> None:
    passes = np.array([10.0, 100.0, 1000.0])
    sizes = np.array([passes**0.7, 0.5 * passes**0.7, passes])
    grid, profiles = Grid.spanning(-1.0, 1.0, 5), np.ones((2, 5))
    course = Course(passes.tolist(), list(sizes.T), profiles, grid)
    np.testing.assert_allclose(strip_errors(course, passes, sizes, course), 0.0, atol=1e-12)
    assert np.isnan(strip_errors(None, passes, sizes, course)).all()
