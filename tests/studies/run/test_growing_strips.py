"""Strips that grow with the groove during a test."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import wearsim
from wearsim.errors import Interrupted
from wearsim.evolution.strips import averaged
from wearsim.types import Grid

RIG = Path(__file__).parents[3] / "scenarios" / "rig-450min.toml"
K_OVER_H = 1.1e-11
DEEP: dict[str, object] = {"operation.duration": "30000 min", "evolution.tolerance": 1e-2}
FACTOR = {"distribution": "lognormal", "median": "1e-10 1/Pa", "factor": 3}
FREE: dict[str, object] = {"drive": "free", "bearing_torque": "10 N mm"}
SLIGHT: dict[str, object] = {"operation.rollers": 1, "operation.duration": "100000 min"}


def run(changes: dict[str, object], **options: object) -> wearsim.Result:
    return wearsim.run(wearsim.load_scenario(RIG, overrides=changes), **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("changes", "width"),
    [
        ({"creepage": FREE}, "16 mm"),
        ({"creepage.longitudinal": 1e-5, "creepage.differential_slip": True}, "16 mm"),
        ({"creepage": {**FREE, "bearing_torque": "1 N mm"}}, "8 mm"),
    ],
)
def test_slow_wear_is_resolved_in_a_long_test(changes: dict[str, object], width: str) -> None:
    slight = {**SLIGHT, **changes}
    resolved = run({**slight, "contact.strips": 321, "contact.width": width})
    result = run(slight)
    assert np.ptp(result.y) < 40e-3  # steps that find a contact far away are too long
    assert result.depth[-1] == pytest.approx(resolved.depth[-1], rel=1e-2)
    assert result.worn_volume[-1] == pytest.approx(resolved.worn_volume[-1], rel=1e-2, abs=0.0)


def test_groove_of_a_long_test_agrees_with_fine_strips() -> None:
    fine = run({**DEEP, "contact.strips": 801, "contact.width": "60 mm"})
    grown = run(DEEP)
    assert len(grown.y) < 450
    assert np.ptp(grown.y) > 2.0 * 10.0 * 1.545e-3  # ten times as wide as the fresh contact
    assert grown.depth[-1] == pytest.approx(fine.depth[-1], rel=2e-4)
    assert grown.worn_volume[-1] == pytest.approx(
        K_OVER_H * grown.dissipated_energy[-1], rel=1e-12, abs=0.0
    )
    assert grown.width[-1] == pytest.approx(fine.width[-1], rel=5e-3)


def test_line_load_of_every_record_carries_the_load() -> None:
    result = run(DEEP)
    spacing = result.y[1] - result.y[0]
    loads = result.raw.records["line_load"].sum(axis=-1).ravel() * spacing
    np.testing.assert_allclose(loads, 300.0, rtol=1e-9)


def test_resumed_run_with_grown_strips_equals_an_unbroken_one(tmp_path: Path) -> None:
    whole, left = run(DEEP), 0

    def stop() -> bool:
        nonlocal left
        left += 1
        return left in {10, 20, 30}

    path = tmp_path / "run.h5"
    with pytest.raises(Interrupted):
        run(DEEP, output=path, stop_requested=stop)
    for _ in range(2):
        with pytest.raises(Interrupted):
            wearsim.resume(path, stop_requested=stop)
    resumed = wearsim.resume(path)
    np.testing.assert_array_equal(resumed.y, whole.y)
    np.testing.assert_array_equal(resumed.depth, whole.depth)
    np.testing.assert_array_equal(resumed.profiles[-1], whole.profiles[-1])
    np.testing.assert_allclose(resumed.profiles, whole.profiles, rtol=1e-12, atol=1e-18)


def test_realisations_with_grown_strips_equal_single_ones(tmp_path: Path) -> None:
    changes = {
        **DEEP,
        "evolution.allow_deep": True,
        "operation.duration": "3000 min",
        "outputs.records": 3,
        "wear.cylinder.k_over_h": {
            "distribution": "lognormal",
            "median": "1e-10 1/Pa",
            "factor": 3,
        },
    }
    scenario = wearsim.load_scenario(RIG, overrides=changes)
    found = wearsim.ensemble(scenario, 6, tmp_path / "e.h5", scheduler="serial").values("depth")
    for number in (0, 3, 5):
        single = run({**changes, "sampling.realisation": number})
        assert found[number, -1] == single.depth[-1]


def test_averages_over_other_strips_keep_the_integral() -> None:
    old, values = Grid.spanning(-1.0, 1.0, 41), np.random.default_rng(0).random((3, 41))
    for new in (Grid.spanning(-3.0, 3.0, 41), Grid.spanning(-1.2, 1.4, 17)):
        integral = averaged(values, old, new).sum(axis=-1) * new.spacing
        np.testing.assert_allclose(integral, values.sum(axis=-1) * old.spacing, rtol=1e-13)
    wider = averaged(values, old, Grid.spanning(-1.0 - 2.0 / 41, 1.0 + 2.0 / 41, 43))
    np.testing.assert_array_equal(wider[:, 1:-1], values)
    np.testing.assert_array_equal(wider[:, [0, -1]], 0.0)
