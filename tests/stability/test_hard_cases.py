"""Scenes that break careless solvers: each runs to its end, smooth, balanced and finite."""

import numpy as np
import pytest

from tests.evolution import worn
from wearsim.evolution.advance import cylinder_depth_of, cylinder_volume_of
from wearsim.evolution.observables import oscillation

SHORT = {"contact__strips": 81, "operation__passes": 60_000}
STIFF = {"youngs_modulus": "2e5 GPa", "poisson_ratio": 0.3}
CASES = {
    "long patch, b/a 60": {"roller__crown_radius": "10 m"},
    "round patch, b/a 1": {"roller__crown_radius": "11.1 mm"},
    "short patch, b/a 0.3": {"roller__crown_radius": "3 mm"},
    "friction 0.001": {"friction__coefficient": 0.001},
    "friction 1": {"friction__coefficient": 1.0},
    "creepage 1e-6": {"creepage__longitudinal": 1e-6},
    "creepage negative": {"creepage__longitudinal": -1e-3},
    "pure spin": {"creepage__longitudinal": 0.0, "creepage__tilt": "2 mrad"},
    "pure lateral": {"creepage__longitudinal": 0.0, "creepage__yaw": "1 mrad"},
    "creepage through zero across the track": {
        "creepage__longitudinal": 1e-4,
        "creepage__differential_slip": True,
    },
    "the whole groove in ten passes": {
        "wear__cylinder__k_over_h": "1.5e-6 1/Pa",
        "operation__passes": 10,
    },
    "hardly any wear": {"wear__cylinder__k_over_h": "1.1e-17 1/Pa"},
    "a billion passes": {"operation__passes": 10**9},
    "rollers that wear a thousand times more": {"wear__roller__k_over_h": "1.1e-8 1/Pa"},
    "rollers that wear a thousand times less": {"wear__roller__k_over_h": "1.1e-14 1/Pa"},
    "near-incompressible cylinder": {
        "cylinder__material": {"youngs_modulus": "200 GPa", "poisson_ratio": 0.4999}
    },
    "near-rigid bodies": {"cylinder__material": STIFF, "roller__material": STIFF},
    "three strips": {"contact__strips": 3, "contact__width": "60 mm"},
    "three rollers with offsets and slack": {
        "roller__offset": ["-3 mm", "0 mm", "2 mm"],
        "creepage__tilt": ["1 mrad", "-2 mrad", "0.5 mrad"],
    },
}


@pytest.mark.parametrize("case", list(CASES))
def test_that_a_hard_case_runs_to_its_end_smooth_and_balanced(case):
    scene, state = worn(**{**SHORT, **CASES[case]})
    depth = state.cylinder_depth
    assert np.isfinite(depth).all()
    assert depth.min() >= 0.0
    assert cylinder_depth_of(state)[0] > 0.0
    factor = float(str(CASES[case].get("wear__cylinder__k_over_h", "1.1e-11 1/Pa")).split()[0])
    volume = cylinder_volume_of(scene, state)[0]
    assert volume == pytest.approx(factor * state.energy[0], rel=1e-10)
    assert state.depth_error[0] < 5e-3 * max(depth.max(), state.roller_depth.max())
    for contact in state.contacts:
        assert contact.line_load.sum() * scene.grid.spacing == pytest.approx(300.0, rel=1e-10)
        if scene.grid.strips > 10:
            assert oscillation(contact.line_load) < 0.05


PROFILES = {
    "a step in the groove": lambda y: np.where(np.abs(y) < 0.5, -8.0, 0.0),
    "a groove of two patches": lambda y: -8.0 * np.exp(-((y / 0.5) ** 2)),
    "roughness": lambda y: 0.5 * np.sin(2 * np.pi * y / 0.4) * np.cos(1.7 * y),
    "an edge": lambda y: np.where(y > 0.8, -60.0, 0.0),
}


@pytest.mark.parametrize("name", list(PROFILES))
def test_that_a_hard_profile_is_worn_in(tmp_path, name):
    y = np.linspace(-12.0, 12.0, 1201)
    rows = zip(y, PROFILES[name](y), strict=True)
    path = tmp_path / "profile.csv"
    path.write_text("y [mm], height [um]\n" + "\n".join(f"{a:.6f}, {b:.6f}" for a, b in rows))
    scene, state = worn(cylinder__profile=str(path), contact__strips=161, operation__passes=200_000)
    volume = cylinder_volume_of(scene, state)[0]
    assert volume == pytest.approx(1.1e-11 * state.energy[0], rel=1e-10)
    assert state.depth_error[0] < 5e-3 * cylinder_depth_of(state)[0]
    assert state.cylinder_depth.min() >= 0.0


def test_that_the_groove_does_not_depend_on_the_strips():
    depths = []
    for strips in (41, 81, 161, 321):
        _, state = worn(
            contact__strips=strips, operation__passes=200_000, evolution__tolerance=1e-4
        )
        depths.append(cylinder_depth_of(state)[0])
    errors = np.abs(np.array(depths[:-1]) / depths[-1] - 1.0)
    assert errors[0] < 2e-2
    assert errors[2] < 1e-3
    assert errors[2] < errors[1] < errors[0]
