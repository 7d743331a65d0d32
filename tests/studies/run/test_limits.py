"""Runs that stop where a limit is first reached."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from study_examples import LOADS, ROLLERS, STEPPERS, after, run_differences, run_once, short

from tests.evolution import SCENARIOS
from wearsim.errors import Interrupted, ResultsFileError
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.integrate import Evolution
from wearsim.evolution.limits import Limit
from wearsim.evolution.state import WearState
from wearsim.scenario import load_scenario
from wearsim.studies.ensemble.batch import joined_problem
from wearsim.studies.opening import open_results
from wearsim.studies.run import run as studies
from wearsim.studies.run.assemble import assemble_problem
from wearsim.studies.run.draws import draw
from wearsim.studies.run.grid import strips_of_run
from wearsim.studies.run.result import Result
from wearsim.types import Grid


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "run.h5"


@pytest.mark.parametrize(
    ("text", "quantity", "value"),
    [
        ("depth 50 um", "depth", 50e-6),
        ("worn depth 0.05 mm", "depth", 50e-6),
        ("Roller depth 5um", "roller depth", 5e-6),
        ("volume 12 mm^3", "volume", 12e-9),
        ("lift_error=30um", "lift error", 30e-6),
        ("lift_error 5 um", "lift error", 5e-6),
        ("peak_pressure 900 MPa", "peak pressure", 9e8),
        ("peak pressure 900 MPa", "peak pressure", 9e8),
        ("clearance = 60 um", "clearance", 60e-6),
        ("width=14mm", "width", 14e-3),
        ("12 h", "time", 43_200.0),
        ("time 500 min", "time", 30_000.0),
        ("2e6 passes", "passes", 2e6),
        (90.0, "time", 90.0),
    ],
)
def test_limit_is_read(text: str | float, quantity: str, value: float) -> None:
    limit = Limit.parse(text)
    assert (limit.quantity, limit.value) == (quantity, pytest.approx(value, rel=1e-14))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("depth 50", 'needs a unit, got "50", expected a length such as'),
        ("depth 3 min", '"3 min"'),
        ("12", "'12' is not a limit, expected one such as \"depth 50 um\""),
        ("30 um", "'30 um' is not a limit, expected one such as \"depth 50 um\""),
        ("100 kpasses", "'100 kpasses' is not a limit, expected one such as"),
        ("deep 5 um", "'deep 5 um' is not a limit, expected one such as \"depth 50 um\""),
        ("forever", "is not a limit"),
        ("", "is not a limit"),
        ("-3 min", "must be above zero"),
        ("0 passes", "must be above zero"),
        ("1.5 passes", "is not a whole number of passes"),
        ("1.5 turns", "is not a whole number of turns"),
        ("100 kturns", "'100 kturns' is not a limit, expected one such as"),
        (float("nan"), "not a"),
    ],
)
def test_text_that_is_no_limit_is_refused(text: str | float, message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        Limit.parse(text)


STEPS = ("implicit", "stabilised", "explicit", "compiled passes")


@pytest.mark.parametrize("stepper", STEPS)
@pytest.mark.parametrize("text", ["depth 0.6 um", "volume 0.05 mm^3", "1.1 min", "3123 passes"])
def test_run_stops_at_the_limit_and_resumes_to_the_end(stepper: str, text: str, path: Path) -> None:
    scenario = short(**{**STEPPERS[stepper], **LOADS["spring"], **ROLLERS["wearing"]})
    whole = run_once(scenario)
    limit = Limit.parse(text)
    stopped = studies.run(scenario, path, until=text)
    values = stopped.raw.history[limit.variable].ravel()
    assert 0.0 < stopped.passes[-1] < 6000.0
    if stepper == "compiled passes":
        assert values[-2] < limit.value <= values[-1] * (1.0 + 1e-12)
        assert stopped.passes[-1] % 1.0 == 0.0
        assert values[-1] == pytest.approx(limit.value, rel=1e-3)
    else:
        assert values[-1] == pytest.approx(limit.value, rel=1e-7)
    assert (stopped.finished, stopped.until) == (True, text)
    assert stopped.record_passes[-1] == stopped.passes[-1]
    assert stopped.profiles[-1].max() == stopped.depth[-1]
    # the whole run agrees at the limit, within the error of the steps
    expected = np.interp(stopped.passes[-1], whole.passes, whole.depth)
    assert stopped.depth[-1] == pytest.approx(expected, rel=0.03)
    assert run_differences(open_results(path), stopped) == []
    resumed = studies.resume(path)
    assert resumed.until == ""
    assert run_differences(resumed, whole) == []


def test_further_limits_do_not_change_the_run(path: Path) -> None:
    scenario = short()
    studies.run(scenario, path, until="depth 0.4 um")
    again = studies.resume(path, until="depth 0.4 um")
    assert again.depth[-1] == pytest.approx(0.4e-6, rel=1e-7)
    second = studies.resume(path, until="volume 0.16 mm^3")
    assert run_differences(second, studies.run(scenario, until="volume 0.16 mm^3")) == []
    with pytest.raises(ResultsFileError, match=r"already reached depth .* past depth 0\.4 um"):
        studies.resume(path, until="depth 0.4 um")
    assert run_differences(studies.resume(path), run_once(scenario)) == []


def test_interrupted_run_resumes_to_its_limit(path: Path) -> None:
    scenario = short(evolution__tolerance=0.005)
    with pytest.raises(Interrupted):
        studies.run(scenario, path, until="depth 0.9 um", stop_requested=after(2))
    assert open_results(path).until == ""
    resumed = studies.resume(path)
    assert resumed.until == "depth 0.9 um"
    assert run_differences(resumed, studies.run(scenario, until="depth 0.9 um")) == []


@pytest.mark.parametrize("text", ["4 min", "12000 passes", "4000 turns"])
def test_later_end_extends_the_test(text: str) -> None:
    result = studies.run(short(), until=text)
    assert (result.passes[-1], result.finished, result.until) == (12_000.0, True, "")
    assert result.raw.total_passes == 12_000


def test_run_stops_at_a_turn_of_three_rollers_and_keeps_its_limit(path: Path) -> None:
    with pytest.raises(Interrupted):
        studies.run(short(), path, until="1041 turns", stop_requested=after(2))
    resumed = studies.resume(path)
    assert (resumed.passes[-1], resumed.until) == (3123.0, "1041 turns")
    assert run_differences(resumed, studies.run(short(), until="1041 turns")) == []
    assert studies.resume(path, until="4e3 turns").passes[-1] == 12_000.0


def test_depth_after_the_end_extends_the_test(path: Path) -> None:
    whole = studies.run(short(), path)
    limit = 1.7 * float(whole.depth[-1])
    extended = studies.resume(path, until=f"depth {limit!r} m")
    assert extended.depth[-1] == pytest.approx(limit, rel=1e-7)
    assert 6000.0 < extended.passes[-1] < 24_000.0
    assert run_differences(extended, studies.run(short(), until=f"depth {limit!r} m")) == []
    rows = len(whole.passes)
    np.testing.assert_array_equal(extended.depth[:rows], whole.depth)


def fixed_grid() -> Grid:
    """Return the strips of `short`, which its scenario gives."""
    return strips_of_run(draw(short()))


def _warning(result: Result) -> str:
    (found,) = (text for text in result.warnings if "not reached" in text)
    return found


def test_limit_that_is_never_reached_is_reported(path: Path) -> None:
    unworn = studies.run(short(wear__cylinder__k_over_h="0 1/Pa"), path, until="depth 1 um")
    assert (unworn.finished, unworn.until, unworn.passes[-1]) == (True, "", 6000.0)
    assert "limit depth 1 um is not reached: depth 0 um at the end" in _warning(unworn)
    assert _warning(open_results(path)) == _warning(unworn)
    logged = studies.run(short(**LOADS["recorded and thermal"]), until="depth 90 um")
    assert "it cannot be extended" in _warning(logged)
    assert "log" in _warning(logged)


def test_warning_of_the_error_at_a_limit_states_that_of_the_results() -> None:
    scenario = load_scenario(SCENARIOS / "cam-eccentric.toml", overrides={"contact.strips": 41})
    result = studies.run(scenario, until="1e5 turns")
    (warning,) = (text for text in result.warnings if "estimated error" in text)
    assert f"depth: {100.0 * result.final['relative_depth_error']:.2g} %" in warning


def test_limit_of_each_test_of_a_batch_is_that_of_the_test_alone() -> None:
    limit, problems, alone = Limit.parse("depth 0.6 um"), [], []
    for force in ("250 N", "300 N", "350 N"):
        scenario = short(load__normal_force=force)
        problem, stepper, _ = assemble_problem(draw(scenario), fixed_grid())
        problems.append(problem)
        alone.append(studies.run(scenario, until=limit.text))
    joined = replace(joined_problem(problems), model=problems[0].model)
    found: dict[int, WearState] = {}
    tests = Evolution(joined, fresh_state(joined), stepper, 6e3, 10**4, lambda _: np.inf)
    for advance in tests:
        for place, number in enumerate(advance.numbers.tolist()):
            state = None if number in found else limit.crossing(stepper, advance, place)
            if state is not None:
                found[number] = state
    assert sorted(found) == [0, 1, 2]
    for number, run in enumerate(alone):
        assert found[number].passes[0] == run.passes[-1]
        np.testing.assert_array_equal(found[number].cylinder_depth[0, 0, 0], run.profiles[-1])


@pytest.mark.parametrize(
    ("limit", "variable"),
    [
        ("width 2 mm", "width"),
        ("clearance 0.7 um", "descent"),
        ("volume 0.05 mm^3", "worn_volume"),
    ],
)
def test_run_stops_at_limits_of_other_quantities(limit: str, variable: str) -> None:
    result = studies.run(short(), until=limit)
    values = np.asarray(result.raw.history[variable]).reshape(len(result.passes), -1).max(axis=1)
    reached = Limit.parse(limit).value
    assert values[-1] == pytest.approx(reached, rel=1e-7)
    assert (values[:-1] < reached).all()


def test_run_of_a_cam_stops_at_its_lift_error() -> None:
    scenario = load_scenario(SCENARIOS / "cam-eccentric.toml", {"evolution.tolerance": 1e-2})
    result = studies.run(scenario, until="lift_error=2um")
    errors = np.asarray(result.raw.history["lift_error"]).reshape(len(result.passes), -1)
    assert errors[-1].max() == pytest.approx(2e-6, rel=1e-7)
    assert (errors[:-1] < 2e-6).all()
