"""Stated errors due to the strips, against tests on fine strips."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import wearsim
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.strip_errors import Course, sizes_of, strip_errors
from wearsim.studies.run.assemble import assemble_problem
from wearsim.studies.run.draws import draw
from wearsim.studies.run.grid import start_of_run
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
    "contact.strips": 101,
}
#: nearly unworn, so that volumes on strips of twice the width may be equal by chance
FRESH: dict[str, object] = {
    "evolution.tolerance": 0.01,
    "roller.radius": "5.409 mm",
    "roller.crown_radius": "263.6 mm",
    "cylinder.radius": "33.66 mm",
    "load.normal_force": "1978 N",
    "friction.coefficient": 0.05414,
    "creepage": {"tilt": "-0.3666 mrad", "drive": "free", "bearing_torque": "4.216 N mm"},
    "operation.passes": 417_800,
    "wear.cylinder.k_over_h": "1e-13 1/Pa",
    "wear.roller.k_over_h": "3.068e-13 1/Pa",
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


def test_volume_of_a_nearly_unworn_free_roller_is_within_its_stated_error() -> None:
    result = run(FRESH)
    error = abs(result.worn_volume[-1] - fine(FRESH, result).worn_volume[-1])
    assert error <= result.volume_error[-1] <= 10.0 * error


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


def parabola(y: np.ndarray) -> np.ndarray:
    """Return depths of a groove whose deepest point is in the middle of no strip."""
    return np.maximum(1.0 - np.square((y - 0.03) / 0.8), 0.0)


def test_courses_on_exact_parabolas_differ_by_the_sampling_of_the_depth_alone() -> None:
    fine, coarse = (
        Grid.spanning(-1.0, 1.0, 41),
        Grid.spanning(-1.0 - 1.0 / 41.0, 1.0 + 1.0 / 41.0, 21),
    )
    passes = np.array([1.0, 10.0])
    deepest = parabola(fine.y).max()
    sizes = np.array([[0.5 * deepest, deepest], [0.0, 0.0], [0.5, 1.0]])
    tops = [np.array([0.5, 0.0, 0.5]), np.array([1.0, 0.0, 1.0])]
    other = Course(passes.tolist(), tops, parabola(coarse.y)[None], coarse)
    end = Course(profiles=parabola(fine.y)[None], grid=fine)
    depth, volume, profile = strip_errors(other, passes, sizes, end)[:, -1]
    assert 1.0 - deepest <= depth <= 2.0 * (1.0 - deepest)
    assert volume <= 1e-3
    # where the cubic polynomials cross the ends of the groove, and the ends lie within strips
    assert profile <= 4e-3


def test_greatest_depths_of_coarse_strips_are_those_between_them() -> None:
    scenario = wearsim.load_scenario(RIG, overrides=SHORT)
    problem = assemble_problem(draw(scenario), start_of_run(scenario, draw(scenario)))[0]
    state = fresh_state(problem)
    y, width = problem.grid.y, problem.grid.spacing
    depths = 1e-6 - np.square(y - 0.3 * width)
    worn = state.replaced(cylinder_depth=np.broadcast_to(depths, state.cylinder_depth.shape).copy())
    by_strips, between = (sizes_of(problem, worn.stacked, kind)[0, 0] for kind in (False, True))
    assert between == pytest.approx(1e-6, rel=1e-9)
    assert by_strips == pytest.approx(1e-6 - (0.3 * width) ** 2, rel=1e-9)
