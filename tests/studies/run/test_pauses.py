"""Logs with pauses at zero load and with gaps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.studies.study_examples import (
    RIG,
    STEPPERS,
    after,
    run_differences,
    run_in_parts,
    run_once,
)
from wearsim.errors import Interrupted, ScenarioError
from wearsim.scenario import Scenario, parse_scenario
from wearsim.studies.contact.single import study_contact
from wearsim.studies.ensemble.api import ensemble
from wearsim.studies.run import run as studies

# 50 passes a second, 120 s; a start without load, and a pause from 41 to 80 s
FORCES = {0: 0, 4: 0, 5: 300, 40: 340, 41: 0, 60: -1, 80: 0, 81: 300, 130: 260}
PAUSE = 41.0 * 50.0, 80.0 * 50.0


def log_of(forces: dict[float, float]) -> str:
    return "time [s],load [N]\n" + "".join(f"{t},{f}\n" for t, f in forces.items())


def paused(forces: dict[float, float] | None = None, **overrides: object) -> Scenario:
    """Return the rig with a log and overrides."""
    dotted = {key.replace("__", "."): value for key, value in overrides.items()}
    load = {"load": {"kind": "recorded", "file": "load.csv"}}
    text = log_of(FORCES if forces is None else forces)
    return parse_scenario(RIG, "rig.toml", {"load.csv": text}.__getitem__, {**load, **dotted})


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "run.h5"


@pytest.mark.parametrize("name", ["implicit", "stabilised", "explicit", "compiled passes"])
def test_nothing_wears_in_a_pause(name: str) -> None:
    result = run_once(paused(**STEPPERS[name], outputs__records=12))
    inside = (result.record_passes >= PAUSE[0]) & (result.record_passes <= PAUSE[1])
    assert inside.sum() >= 3
    depths = result.profiles.reshape(len(inside), -1).max(axis=1)
    assert np.ptp(depths[inside]) == 0.0
    assert (np.diff(depths[~inside][1:]) > 0.0).all()
    assert not result.raw.records["dissipation"][inside].any()
    assert result.raw.records["dissipation"][-1].any()
    at_start = result.passes <= 200.0
    assert not result.raw.history["power"][at_start].any()
    assert not result.raw.history["normal_force"][at_start].any()
    assert result.time[-1] == pytest.approx(120.0)


def test_explicit_step_to_a_pause_is_not_called_unstable() -> None:
    # next to a pause few strips of a conformal groove are in contact
    groove = {"wear.cylinder.k_over_h": "5e-10 1/Pa", "contact.width": "14 mm"}
    result = studies.run(paused(**STEPPERS["explicit"], **groove, contact__strips=51))
    assert np.abs(result.passes - PAUSE[0]).min() < 1e-6
    assert not any(text.startswith("unstable") for text in result.warnings)


@pytest.mark.parametrize("name", ["implicit", "compiled passes"])
def test_limit_after_a_pause_is_reached_by_the_same_wear(name: str) -> None:
    # the last record before the limit is in the pause
    stopped = studies.run(paused(**STEPPERS[name]), until="4200 passes")
    whole = studies.run(paused(**STEPPERS[name], outputs__every_passes=4200))
    assert stopped.passes[-1] == 4200.0
    depth = whole.profiles[list(whole.record_passes).index(4200.0)].max()
    assert stopped.depth[-1] == pytest.approx(depth, rel=1e-5)


def test_steppers_agree_on_a_log_with_pauses() -> None:
    exact = run_once(paused(**STEPPERS["compiled passes"], outputs__records=12))
    for name in ("implicit", "stabilised", "explicit"):
        result = run_once(paused(**STEPPERS[name], outputs__records=12))
        tolerance = float(STEPPERS[name]["evolution.tolerance"])  # type: ignore[arg-type]
        assert result.depth[-1] == pytest.approx(exact.depth[-1], rel=tolerance)
        energy = exact.raw.history["dissipated_energy"][-1]
        assert result.raw.history["dissipated_energy"][-1] == pytest.approx(energy, rel=tolerance)


def test_passes_in_python_pass_over_a_pause() -> None:
    quick = {t / 50.0: f for t, f in FORCES.items()}
    result = studies.run(paused(quick, **STEPPERS["passes in Python"]))
    inside = (result.record_passes >= 41) & (result.record_passes <= 80)
    assert np.ptp(result.profiles[inside].reshape(inside.sum(), -1).max(axis=1)) == 0.0
    compiled = studies.run(paused(quick, **STEPPERS["compiled passes"], operation__passes=100))
    assert result.depth[-1] == pytest.approx(compiled.depth[-1], rel=0.05)


def test_pause_changes_nothing_but_the_time() -> None:
    # the same log without the pause from 41 to 80 s
    shorter = {t - 39 if t >= 80 else t: f for t, f in FORCES.items() if t not in (41, 60)}
    for stepper, difference in (("implicit", 2e-4), ("per-pass", 1e-12)):
        options: dict[str, object] = {"evolution__stepper": stepper}
        options |= {"evolution__strip_error": False, "evolution__tolerance": 3e-4}
        with_pause = studies.run(paused(**options))
        without = studies.run(paused(shorter, **options, operation__passes=4050))
        assert with_pause.depth[-1] == pytest.approx(without.depth[-1], rel=difference)


@pytest.mark.parametrize("name", ["implicit", "stabilised", "compiled passes"])
def test_spring_may_lift_the_roller_next_to_a_pause(name: str) -> None:
    coarser = {"evolution.tolerance": 1e-3} if name == "stabilised" else {}
    spring = {"load__stiffness": "20000 N/mm"}
    result = run_once(paused(**STEPPERS[name] | coarser, **spring))
    assert result.finished
    exact = run_once(paused(**STEPPERS["compiled passes"], **spring))
    assert result.depth[-1] == pytest.approx(exact.depth[-1], rel=5e-3)
    before = result.raw.history["normal_force"][:, 0][result.passes < 300.0]
    assert (before >= 0.0).all()


@pytest.mark.parametrize("name", ["implicit", "stabilised", "compiled passes"])
def test_run_stopped_before_or_in_a_pause_equals_an_unbroken_one(name: str, path: Path) -> None:
    coarse = {"evolution.tolerance": 0.02}  # a dozen steps
    overrides = {**STEPPERS[name], **coarse, "outputs.records": 12, "evolution.strip_error": False}
    unbroken = studies.run(paused(**overrides))
    assert ((unbroken.passes > PAUSE[0]) & (unbroken.passes < PAUSE[1])).any()
    in_parts, parts = run_in_parts(paused(**overrides), path, 1)
    assert parts > 5
    assert run_differences(in_parts, unbroken) == []


def test_errors_by_strips_are_known_where_a_load_rises_slowly_from_zero() -> None:
    rising = {0: 300, 48: 300, 48.1: 0, 60: 0, 108: 400, 120: 400}
    wear = {"wear__cylinder__k_over_h": "2.5e-9 1/Pa", "load__stiffness": "1000 N/mm"}
    result = studies.run(paused(rising, **wear, contact__strips=161, contact__width="20 mm"))
    assert np.isfinite(result.errors["peak_pressure"]).all()
    assert not any("error by strips" in text for text in result.warnings)


def test_thermal_load_relaxes_in_a_pause() -> None:
    thermal = {"gain": "300 N/W", "time_constant": "30 s"}
    results = [
        studies.run(paused(**STEPPERS[name], load__thermal=thermal))
        for name in ("implicit", "compiled passes")
    ]
    forces = [result.raw.history["normal_force"][-1, 0] for result in results]
    assert forces[0] == pytest.approx(forces[1], rel=2e-3)


def test_ensemble_passes_over_pauses(tmp_path: Path) -> None:
    random = {"distribution": "uniform", "low": 0.08, "high": 0.12}
    scenario = paused(friction__coefficient=random, evolution__tolerance=0.005)
    depths = {
        count: ensemble(scenario, count, tmp_path / f"{count}.h5", scheduler="serial").values(
            "depth"
        )
        for count in (1, 3)
    }
    for count, found in depths.items():  # the same bits in a batch of any size
        np.testing.assert_array_equal(found, depths[3][:count])
    settings = {"friction.coefficient": random, "evolution.tolerance": 0.005}
    for number in (0, 2):
        alone = studies.run(paused(**settings, sampling__realisation=number))
        assert depths[3][number, -1] == pytest.approx(alone.depth[-1], rel=1e-5)


@pytest.mark.parametrize(
    ("forces", "message"),
    [
        (
            {0: 300, 60: -10, 130: 300},
            "file: load.csv: the load falls to zero or below, and contact is lost, got -10 N at",
        ),
        ({0: 0, 60: 0, 130: 0}, "file: load.csv: the load is never above zero up to 2 min"),
    ],
)
def test_log_without_sense_is_refused(forces: dict[float, float], message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        studies.run(paused(forces))


def test_contact_before_the_first_load_is_refused() -> None:
    with pytest.raises(ScenarioError, match="the load is zero at the start, and there is no"):
        study_contact(paused())


GAP = {float(k): 300.0 - k for k in [*range(11), *range(70, 131)]}


def test_gap_is_interpolated_held_or_an_error() -> None:
    loads = {gaps: paused(GAP, load__gaps=gaps).load.built for gaps in ("hold", "interpolate")}
    times = np.array([10.0, 40.0, 69.999, 71.0])
    np.testing.assert_allclose(loads["interpolate"].force(times), 300.0 - times, rtol=1e-12)
    np.testing.assert_allclose(loads["hold"].force(times), [290.0, 290.0, 290.0, 229.0])
    assert loads["hold"].mean(10.0, 70.0) == pytest.approx(290.0, rel=1e-12)
    assert loads["hold"].mean(69.0, 71.0) == pytest.approx(0.5 * (290.0 + 229.5), rel=1e-12)
    assert loads["hold"].gaps.tolist() == [[10.0, 70.0]]
    with pytest.raises(ScenarioError) as caught:
        paused(GAP, load__gaps="error")
    assert "load.csv: has a gap from 0.166667 to 1.16667 min, 60 times the usual" in str(
        caught.value
    )


def test_schedule_of_few_times_has_no_gaps() -> None:
    assert paused().load.built.gaps.shape == (0, 2)


def test_interrupted_pause_continues(path: Path) -> None:
    scenario = paused(operation__passes=3000, evolution__tolerance=0.01)  # ends in the pause
    with pytest.raises(Interrupted):
        studies.run(scenario, path, stop_requested=after(2))
    result = studies.resume(path)
    assert result.passes[-1] == 3000.0
    assert result.raw.history["power"][-1] == 0.0
    assert run_differences(result, studies.run(scenario)) == []
