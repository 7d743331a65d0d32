"""Forecast of a test against the test itself."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from study_examples import PITTING

import wearsim
from tests.evolution import SCENARIOS
from wearsim.studies.dry_run import dry_run

LOOSE = {"evolution.tolerance": 1e-2}
TESTS = {
    "cylinder": ("rig-450min", {}),
    "both bodies wear": ("rig-450min", {"wear.roller.k_over_h": "5e-12 1/Pa"}),
    "tilted rollers": ("rig-three-rollers", {}),
    "adhesion": ("rig-450min", {"creepage.longitudinal": 1e-4}),
    "spring": ("rig-450min", {"load.kind": "spring", "load.stiffness": "2000 N/mm"}),
    "recorded load": ("rig-logged-load", {}),
    "end of a roller": ("rig-450min", {"roller.width": "8 mm"}),
    "stabilised": ("rig-450min", {"evolution.stepper": "stabilised"}),
    "explicit": ("rig-450min", {"evolution.stepper": "explicit", "operation.passes": 20_000}),
    "pass by pass": ("rig-450min", {"evolution.stepper": "per-pass", "operation.passes": 9000}),
    "FASTSIM": ("rig-450min", {"contact.tangential": "fastsim"}),
    "many records": ("rig-450min", {"outputs.every_passes": 675}),
    "cam": ("cam-eccentric", {}),
    "swinging follower": ("cam-swinging", {}),
}
ERROR = 0.12  # of the depth, from which the lightest grooves are forecast
AREA = 0.05  # of volume and energy


@pytest.mark.parametrize("name", TESTS)
def test_forecast_agrees_with_the_run(name: str, tmp_path: Path) -> None:
    file, changes = TESTS[name]
    settings = {**({} if "pass" in name or "explicit" in name else LOOSE), **changes}
    scenario = wearsim.load_scenario(SCENARIOS / f"{file}.toml", settings)
    forecast = dry_run(scenario)["forecast"]
    result = wearsim.run(scenario, tmp_path / "run.h5")
    history = result.raw.history

    def last(name: str) -> float:
        return float(history[name][-1].max())

    assert forecast["depth_m"] == pytest.approx(last("depth"), rel=ERROR)
    assert forecast["roller_depth_m"] == pytest.approx(last("roller_depth"), rel=ERROR, abs=1e-9)
    assert forecast["worn_volume_m3"] == pytest.approx(last("worn_volume"), rel=AREA, abs=0.0)
    assert forecast["dissipated_energy_J"] == pytest.approx(last("dissipated_energy"), rel=AREA)
    assert forecast["peak_pressure_Pa"] == pytest.approx(last("peak_pressure"), rel=0.5)
    if "cam" in scenario.file:
        assert forecast["lift_error_m"] == pytest.approx(last("lift_error"), rel=ERROR)
    size = (tmp_path / "run.h5").stat().st_size
    steps = scenario.total_passes if "pass" in name else len(result.passes) - 1
    for key, value in (("steps", steps), ("file_bytes", size)):
        assert 1.0 / 3.0 < forecast[key] / value < 3.0, (key, forecast[key], value)


def test_start_profile_that_fits_the_roller(tmp_path: Path) -> None:
    """The gap is zero throughout the contact; the groove is centred on its middle."""
    rows = (f"{y},{-max(10.0 - y * y, 0.0)}" for y in np.linspace(-8.0, 8.0, 401))
    profile = tmp_path / "groove.csv"
    profile.write_text("\n".join(["y [mm],height [um]", *rows]))
    changes = {**LOOSE, "cylinder.profile": str(profile)}
    scenario = wearsim.load_scenario(SCENARIOS / "rig-450min.toml", changes)
    checked = dry_run(scenario)
    assert not [text for text in checked["warnings"] if "forecast" in text]
    assert checked["forecast"]["depth_m"] == pytest.approx(
        wearsim.run(scenario).depth[-1], rel=ERROR
    )


@pytest.mark.parametrize(
    ("file", "changes", "factor"),
    [
        ("rig-450min", {"fatigue.remove": True}, 3.0),
        ("cam-eccentric", {"fatigue.roller": PITTING}, 3.0),
        (
            "rig-450min",
            {
                "fatigue.scatter": "weakest-link",
                "fatigue.reference_area": "100 mm^2",
                "operation.rollers": 2,
                "roller.offset": ["-1 mm", "1 mm"],
                "operation.passes": 20_000,
            },
            3.0,
        ),
        ("rig-450min", {"wear.cylinder.k_over_h": "0 1/Pa", "operation.passes": 2000}, 1.001),
    ],
    ids=["rig", "cam", "two rollers", "no wear"],
)
def test_forecast_of_damage_agrees_with_the_run(file, changes, factor) -> None:
    fatigue = {"fatigue": {"slope": 1.125, "cylinder": PITTING}, "evolution.strip_error": False}
    limit = {"limit.damage": 1e-4}
    scenario = wearsim.load_scenario(
        SCENARIOS / f"{file}.toml", {**LOOSE, **fatigue, **limit, **changes}
    )
    forecast = dry_run(scenario)["forecast"]
    result = wearsim.run(scenario)
    damage = result.values("damage").reshape(len(result.passes), -1).max(axis=1)
    assert 1.0 / factor < forecast["damage"] / damage[-1] < factor
    chance = 1.0 - 0.9 ** (forecast["damage"] ** 1.125)
    assert forecast["pitting"] == pytest.approx(chance, rel=1e-9)
    (found,) = (item for item in forecast["limits"] if item["quantity"] == "damage")
    passes = np.interp(1e-4, damage, result.passes)
    assert 1.0 / factor < found["reached_at_passes"] / passes < factor


def test_rollers_of_different_yaw_on_a_cam_take_longer_than_equal_ones() -> None:
    different = {"operation.rollers": 3, "creepage.yaw": ["1 mrad", "-2 mrad", "3 mrad"]}
    seconds = [
        dry_run(wearsim.load_scenario(SCENARIOS / "cam-cycloidal.toml", changes))["forecast"][
            "wall_time_s"
        ]
        for changes in ({"operation.rollers": 3}, different)
    ]
    assert seconds[1] > 4.0 * seconds[0]  # 10 to 17 times when measured


def test_inputs_drawn_at_every_pass_have_a_forecast_of_their_time_and_memory() -> None:
    drawn = {"distribution": "lognormal", "median": 0.1, "factor": 1.2, "persistence": "per-pass"}
    rig = wearsim.load_scenario(SCENARIOS / "rig-450min.toml")
    one, many = (
        dry_run(scenario)["forecast"]
        for scenario in (rig, rig.changed({"friction.coefficient": drawn}))
    )
    steps = [item["wall_time_s"] - 1.0 for item in (one, many)]  # without the start
    assert 5.0 < steps[1] / steps[0] < 100.0  # 64 contacts: 20 to 30 times when measured
    assert many["memory_bytes"] < 2.0 * one["memory_bytes"]


def test_spring_that_unloads_has_a_forecast_up_to_its_travel() -> None:
    stiff = {"load.kind": "spring", "load.stiffness": "20000 N/mm"}
    scenario = wearsim.load_scenario(SCENARIOS / "rig-450min.toml", stiff)
    forecast = dry_run(scenario)["forecast"]
    # 300 N are lost over 15 um and the elastic approach of 4.5 um
    assert 14e-6 < forecast["depth_m"] < 20e-6


def test_test_without_wear_has_a_forecast() -> None:
    rolls = wearsim.load_scenario(SCENARIOS / "rig-450min.toml", {"creepage.longitudinal": 0.0})
    forecast = dry_run(rolls)["forecast"]
    assert forecast["depth_m"] == forecast["dissipated_energy_J"] == 0.0
    assert forecast["peak_pressure_Pa"] == pytest.approx(680e6, rel=0.01)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"operation.passes": 200_000_000}, "forecast: a depth of 1.3"),
        (
            {"operation.passes": 10**9},
            "forecast: the worn depth of 3.9[0-9]* mm exceeds a tenth of roller.radius = 20 mm",
        ),
        (
            {"contact.width": "30 mm", "contact.strips": 25},
            "contact.strips: 3 of 25 strips are in contact before wear, which needs 5",
        ),
        ({"roller.width": "8 mm"}, "forecast of the width: the groove grows as wide as the roller"),
        (
            {"roller.crown_radius": "5 mm", "operation.passes": 10**9},
            "exceeds roller.crown_radius = 5 mm, and half-spaces are not valid",
        ),
    ],
)
def test_deep_and_wide_grooves_give_warnings(changes: dict[str, object], message: str) -> None:
    scenario = wearsim.load_scenario(SCENARIOS / "rig-450min.toml", changes)
    warnings = dry_run(scenario)["warnings"]
    assert re.search(message, "\n".join(warnings))


def test_strips_that_suffice_for_the_run_are_not_refused() -> None:
    rig = wearsim.load_scenario(SCENARIOS / "rig-450min.toml", LOOSE)
    narrowest = {"contact.width": f"{1.06 * wearsim.run(rig).width[-1] * 1e3:.3f} mm"}
    narrow = rig.changed(narrowest)
    assert wearsim.run(narrow).finished
    assert dry_run(narrow)["forecast"]["depth_m"] > 0.0
