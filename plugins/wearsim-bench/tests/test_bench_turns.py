"""Methods timed in turns, and the comparison of the default stepper with solvers."""

import time

import pytest

from wearsim_bench.measure.measurement import Measurement
from wearsim_bench.stepping import turns
from wearsim_bench.stepping.turns import (
    NEGLIGIBLE,
    UNBEATEN,
    TimedRun,
    add_rounds,
    compared,
    conclusion,
)


def timed_run(method, times, depth, profile, volume, default=False):
    errors = {"depth": depth, "profile": profile, "volume": volume}
    row = Measurement("rig", method, "tolerance 1e-3", errors=errors, default=default)
    return TimedRun(row, lambda: None, list(times))


def remark_of(solver, *steppers):
    return compared([*steppers, solver], "implicit", ("BDF", "LSODA"))[-1].row.remark


SOLVER = timed_run("LSODA", [1.0, 2.0, 4.0], 1e-3, 1e-3, 1e-3)


def test_times_are_paired_and_ties_are_equal():
    # the medians of the times differ by a factor of 1.5, those of the ratios do not
    equal = timed_run("implicit", [1.03, 3.0, 3.0], 1.04e-3, 1e-4, 1e-4)
    assert remark_of(SOLVER, equal) == "dominated by tolerance 1e-3, 1 x time"
    slower = timed_run("implicit", [1.06, 2.12, 4.24], 1e-4, 1e-4, 1e-4)
    assert remark_of(SOLVER, slower) == f"{UNBEATEN}; nearest tolerance 1e-3, 1.06 x time"


@pytest.mark.parametrize("place", range(3))
def test_every_error_must_be_as_small(place):
    errors = [1e-4] * 3
    errors[place] = 3e-3
    stepper = timed_run("implicit", [0.1] * 3, *errors)
    name = ("depth", "profile", "volume")[place]
    assert remark_of(SOLVER, stepper) == f"{UNBEATEN}; nearest tolerance 1e-3, 3 x {name}"
    near = timed_run("implicit", [0.5] * 3, 1e-3, 1e-3, 1e-3)
    assert remark_of(SOLVER, stepper, near).startswith("dominated")


def test_negligible_errors_are_equal():
    solver = timed_run("BDF", [1.0], 1e-9, 1e-3, 0.1 * NEGLIGIBLE)
    assert remark_of(solver, timed_run("implicit", [0.5], NEGLIGIBLE, 1e-3, 0.0)).startswith("dom")
    assert UNBEATEN in remark_of(solver, timed_run("implicit", [0.5], 3 * NEGLIGIBLE, 1e-3, 0.0))


def test_only_solvers_with_notable_errors_are_compared():
    near = timed_run("LSODA", [1.0], 1e-3, 4e-5, 1e-3)
    other = timed_run("stabilised", [1.0], 1e-3, 1e-3, 1e-3)
    failed = TimedRun(Measurement("rig", "BDF", "tolerance 1e-3", failed="no"), lambda: None)
    stepper = timed_run("implicit", [0.5], 1e-4, 1e-4, 1e-4)
    for solver in (near, other, failed):
        assert remark_of(solver, stepper) == ""


def test_conclusion_lists_solvers_and_checks_the_default():
    default = timed_run("implicit", [0.5, 1.0, 2.0], 1e-4, 2e-3, 1e-4, default=True)
    faster = timed_run("BDF", [0.1, 0.2, 0.4], 1e-2, 1e-2, 1e-2)
    runs = compared([default, timed_run("LSODA", [1.0] * 3, 1e-2, 1e-2, 1e-2), faster], *NAMES)
    text = conclusion([run.measurement for run in runs], 1e-3)
    assert "of 2 settings of LSODA and BDF" in text
    assert "or more: 1 are not: BDF, tolerance 1e-3." in text
    assert "all of them." in conclusion([run.measurement for run in runs[:2]], 1e-3)
    assert text.endswith("The default meets its tolerance of 0.001, except in profile.")
    assert runs[0].measurement.seconds == 1.0


NAMES = "implicit", ("BDF", "LSODA")


def test_methods_take_turns_and_long_ones_run_once(monkeypatch):
    order = []

    def run_of(name, seconds):
        def run():
            order.append(name)
            time.sleep(seconds)

        row = Measurement("rig", name, "")
        return TimedRun(row, run, [turns.timed(run)[1]])

    monkeypatch.setattr(turns, "LONG", 0.02)
    runs = [run_of("a", 0.0), run_of("b", 0.0), run_of("long", 0.03)]
    runs.append(TimedRun(Measurement("rig", "failed", "", failed="no"), lambda: 1 / 0))
    add_rounds(runs, 3)
    assert order == ["a", "b", "long", "a", "b", "a", "b"]
    assert [len(run.times) for run in runs] == [3, 3, 1, 0]
