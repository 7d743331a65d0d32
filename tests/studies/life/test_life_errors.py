"""Numerical bounds of lives by limits of peak pressure, width and clearance."""

from __future__ import annotations

import numpy as np
import pytest

from wearsim.scenario import parse_scenario
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.life.api import life
from wearsim.studies.life.result import LifeResult

LOG = "time [s],load [N]\n0,200\n27000,2000\n"


def lives(limit: dict[str, str], factor: str, **changes: object) -> LifeResult:
    """Return two lives of the rig under a load that rises."""
    base = shipped_scenario("rig-450min")
    given: dict[str, object] = {
        "load": {"kind": "recorded", "file": "load.csv"},
        "operation.rollers": 1,
        "friction.coefficient": {"distribution": "lognormal", "median": 0.1, "factor": 1.3},
        "wear.cylinder.k_over_h": factor,
        "limit": limit,
        **{key.replace("__", "."): value for key, value in changes.items()},
    }
    scenario = parse_scenario(base.text, "rig.toml", lambda file: LOG, given)
    return life(scenario, 2, None, scheduler="serial")


@pytest.mark.parametrize(
    ("limit", "factor"),
    [
        ({"peak_pressure": "900 MPa"}, "1e-12 1/Pa"),
        pytest.param({"width": "9 mm"}, "1e-11 1/Pa", marks=pytest.mark.slow),
        pytest.param({"clearance": "10 um"}, "1e-11 1/Pa", marks=pytest.mark.slow),
    ],
    ids=["peak pressure", "width", "clearance"],
)
def test_bounds_of_a_life_include_that_on_fine_strips(limit: dict[str, str], factor: str) -> None:
    found = lives(limit, factor)
    fine = lives(limit, factor, contact__strips=301, evolution__tolerance=1e-4)
    low, high = found.values("life_low"), found.values("life_high")
    true = fine.values("life")
    assert np.isfinite(high).all()
    assert (low <= true).all()
    assert (true <= high).all()
    assert ((high - low) / true < 0.2).all()
    # finer strips and steps have narrower bounds
    assert (fine.values("life_high") - fine.values("life_low") < high - low).all()


def test_bounds_include_peaks_at_the_ends_of_rollers() -> None:
    limit, width = {"peak_pressure": "600 MPa"}, {"roller__width": "8 mm"}
    found = lives(limit, "1e-11 1/Pa", **width)
    fine = lives(limit, "1e-11 1/Pa", **width, contact__strips=161)
    assert (found.at_end("width") > 7.9e-3).all()  # the groove is as wide as the roller
    true = fine.values("life")
    assert (np.abs(found.values("life") / true - 1.0) > 0.05).all()
    assert (found.values("life_low") <= true).all()
    assert (true <= found.values("life_high")).all()


def test_bounds_include_the_order_of_different_rollers() -> None:
    # rollers of different tilt, in steps at the same time, and one after another
    changes: dict[str, object] = {
        "load": {"normal_force": "307 N"},
        "operation.rollers": 3,
        "creepage.tilt": ["-0.7 mrad", "1.2 mrad", "0 mrad"],
        "wear.roller.k_over_h": "2e-8 1/Pa",
        "contact.strips": 81,
        "contact.width": "14 mm",
        "evolution.tolerance": 1e-4,
        "evolution.strip_error": False,
    }
    limit = {"depth": "4 um"}
    found = lives(limit, "1e-7 1/Pa", **changes)
    single = lives(limit, "1e-7 1/Pa", **changes, evolution__stepper="per-pass")
    low, high = found.values("life_low"), found.values("life_high")
    true = single.values("life")
    assert (np.abs(found.values("life") / true - 1.0) > 1e-3).any()
    assert (low <= true).all()
    assert (true <= high).all()
