"""Mirror images of wear tests: round-off does not grow through adaptive steps."""

import math

import numpy as np
import pytest

from tests.evolution import cylinder_depth_of, worn
from wearsim.evolution.steppers.base import Trial, rounded_length

SPRING = {"load__kind": "spring", "load__stiffness": "690 N/mm"}
#: offsets [mm], tilts and yaws [mrad] of three rollers, and other changes
CASES = {
    "tangential fastsim": (
        [1.178, 1.369, -0.989],
        [-1.386, -0.269, 0.390],
        [0.978, 0.927, 0.976],
        {
            "operation__duration": "450 min",
            "wear__roller__k_over_h": "3e-12 1/Pa",
            "contact__tangential": "fastsim",
            **SPRING,
        },
    ),
    "partial slip": (
        [1.275, 0.308, -1.273],
        [-1.381, -1.427, -0.176],
        [0.821, -0.775, -0.697],
        {"operation__duration": "20 min", **SPRING},
    ),
    "semi-hertzian": (
        [-0.062, 1.097, -1.410],
        [-0.169, -0.526, 1.365],
        [0.384, 0.042, -0.678],
        {
            "operation__duration": "20 min",
            "creepage__longitudinal": 1e-3,
            "contact__model": "semi-hertzian",
            "evolution__tolerance": 1e-5,
        },
    ),
}


def turned(sign, offset, tilt, yaw, changes):
    """Return problem and end state of a test, mirrored with the sign -1."""
    inputs = {
        "roller__offset": [f"{sign * value} mm" for value in offset],
        "creepage__tilt": [f"{sign * value} mrad" for value in tilt],
        "creepage__yaw": [f"{sign * value} mrad" for value in yaw],
    }
    common = {"creepage__longitudinal": 1e-4, "evolution__tolerance": 1e-4}
    return worn(**common | inputs | changes)


@pytest.mark.parametrize("case", list(CASES))
def test_mirrored_run_is_the_mirror_image(case):
    (problem, one), (_, other) = (turned(sign, *CASES[case]) for sign in (1, -1))
    assert problem.shape[1] == 3
    assert one.steps == other.steps
    assert one.steps > 25
    difference = abs(cylinder_depth_of(one) - cylinder_depth_of(other))
    assert difference <= 1e-5 * one.depth_error
    difference = np.linalg.norm(one.stacked - other.stacked[..., ::-1])
    assert difference <= 1e-5 * one.profile_error * np.linalg.norm(one.stacked)


@pytest.mark.parametrize("length", [1e-7, 0.3, 1.0, 77.3, 4.1e9])
def test_rounded_length_is_near_and_ignores_round_off(length):
    rounded = rounded_length(length)
    assert abs(math.log2(rounded / length)) <= 0.5 / 32 * (1.0 + 1e-9)
    assert rounded_length(rounded * (1.0 + 1e-13)) == rounded
    assert Trial(length, forced=False).proposed == rounded
    assert Trial(length, forced=True).proposed == length


def test_accepted_steps_with_almost_equal_errors_propose_the_same_step():
    proposed = []
    for ratio in (1.37, 1.37 * (1.0 + 1e-12)):
        trial = Trial(100.0, forced=False)
        assert trial.accepts(0.4, trial.proposed, ratio)
        proposed.append(Trial(trial.proposed, forced=False).proposed)
    assert proposed[0] == proposed[1]
    assert rounded_length(math.inf) == math.inf
    assert rounded_length(0.0) == 0.0
