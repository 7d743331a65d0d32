"""True and stated errors of random tests, and their statistics."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wearsim.errors import WearsimError
from wearsim.evolution.strips import same_strips
from wearsim.studies.run.draws import draw
from wearsim.studies.run.grid import start_of_run
from wearsim.studies.run.result import Result
from wearsim.studies.run.run import run
from wearsim.types import FloatArray, Grid
from wearsim_bench.contact.worn_profiles import failure_reason
from wearsim_bench.measure.measurement import Measurement
from wearsim_bench.stated_errors.observed import errors_of
from wearsim_bench.stated_errors.random_tests import RandomTest
from wearsim_bench.stated_errors.references import Worn, on_strips, reference_of, stacked

QUANTITIES = ("depth", "profile", "volume")
STATED = "stated_"  # prefix of the stated error of a quantity
STEPS, STRIPS = "steps_", "strips_"  # prefixes of the true errors by steps and by strips alone
DRAWN = "drawn_at_passes"  # count: whether inputs are drawn at every pass
OWN = "reference_"  # prefix of the change of the reference by half its strips
TESTS = "tests"  # group of the measurements of single tests
SMALL = 1e-6  # true errors below it count as covered, and have no ratio
QUANTILES = {"q05": 0.05, "q25": 0.25, "median": 0.5, "q75": 0.75, "q95": 0.95}
CLEAR, SLOW, LACKS = "ends with an error: ", "is stopped: ", "has no reference: "
SECONDS = 300.0  # limit on the process time of a run, which other work does not change


def measured(test: RandomTest, folder: Path | None) -> Measurement:
    """Return time, true and stated errors of a random test, or the reason of its failure.

    The reason begins with `CLEAR` if the run ends with an error of wearsim, with `SLOW` if it was
    stopped after `SECONDS`, and with `LACKS` if the reference cannot be computed.

    Parameters
    ----------
    test : RandomTest
        The test.
    folder : Path, optional
        Folder of the references, see `reference_of`.
    """
    row = Measurement(TESTS, test.name, test.stratum)
    try:
        result, seconds = timed_run(test)
    except WearsimError as error:
        return _failed(row, CLEAR, error)
    except TimeoutError as error:
        return _failed(row, SLOW, error)
    except Exception as error:  # a fault of wearsim
        return _failed(row, "", error)
    try:
        reference = reference_of(test, folder)
        same, grew = _without_stepping_error(test, result, folder)
        observed = errors_of(result, reference.observed)
    except Exception as error:
        return _failed(row, LACKS, error)
    worn = worn_of_result(result)
    errors = {
        **_named("", worn.changes_from(reference)),
        **{STATED + name: value for name, value in stated(result).items()},
        **_named(STEPS, worn.changes_from(same)),
        **_named(STRIPS, same.changes_from(reference)),
        **{name: true for name, (true, _) in observed.items()},
        **{STATED + name: estimate for name, (_, estimate) in observed.items()},
    }
    counts: dict[str, float] = {
        "tolerance": test.tolerance,
        "steps": result.steps,
        "solves": int(np.max(result.solves[-1])),
        "strips": len(worn.y),
        "strips_grew": int(grew),
        DRAWN: int(any(item.is_redrawn for item in test.scenario().random)),
        "final_depth": worn.depth,
        "finer": float((worn.y[1] - worn.y[0]) / (reference.y[1] - reference.y[0])),
        "reference_seconds": float(reference.seconds),
        **_named(OWN, reference.by_strips),
        **_named(OWN + STEPS, reference.by_steps),
    }
    return row.with_results(seconds, errors, counts)


def _failed(row: Measurement, kind: str, error: Exception) -> Measurement:
    return Measurement(row.group, row.method, row.setting, failed=kind + failure_reason(error))


def _named(prefix: str, values: FloatArray) -> dict[str, float]:
    """Return absolute values of the quantities by name."""
    return {
        prefix + name: abs(float(value)) for name, value in zip(QUANTITIES, values, strict=True)
    }


def timed_run(test: RandomTest, **further: object) -> tuple[Result, float]:
    """Return the result of a test with further changes of its scenario, and its time [s].

    Raises
    ------
    WearsimError
        As `wearsim.run`.
    TimeoutError
        After `SECONDS` of process time.
    """
    start, begin = time.perf_counter(), time.process_time()

    def is_late() -> bool:
        if time.process_time() - begin > SECONDS:
            raise TimeoutError(f"the run takes longer than {SECONDS:g} s")
        return False

    result = run(test.scenario(**further), stop_requested=is_late)
    return result, time.perf_counter() - start


def worn_of_result(result: Result) -> Worn:
    """Return the depths at the end of a run, of a cam at its stations as in a reference."""
    raw = result.raw
    last = {name: values[-1] for name, values in {**raw.history, **raw.records}.items()}
    rollers = raw.static["multiplicity"] @ last["roller_worn_volume"]
    depth = last["station_depth" if "station_depth" in last else "depth"].max()
    return Worn(
        np.asarray(result.y),
        stacked(last["cylinder_depth_profile"], last["roller_depth_profile"]),
        float(max(depth, last["roller_depth"].max())),
        float(np.ravel(last["worn_volume"] + rollers)[0]),
    )


def stated(result: Result) -> dict[str, float]:
    """Return the stated relative errors at the end of a run by quantity.

    Those of a cam are the errors due to steps and strips only, since a reference has the stations
    of the run.
    """
    last = {name: column[-1] for name, column in result.raw.history.items()}
    errors = {}
    for name in QUANTITIES:
        error = float(np.max(result.final[f"relative_{name}_error"]))
        by_stations = last.get(f"{name}_error_by_stations")
        if by_stations is not None:
            error *= 1.0 - float(np.max(by_stations / last[f"{name}_error"]))
        errors[name] = error
    return errors


def _without_stepping_error(
    test: RandomTest, result: Result, folder: Path | None
) -> tuple[Worn, bool]:
    """Return the end of a test on the strips of its run, and whether these grew with the groove."""
    scenario, y = test.scenario(), np.asarray(result.y)
    start, end = start_of_run(scenario, draw(scenario)), Grid(y, float(y[1] - y[0]))
    return on_strips(test, start, end, folder), not same_strips(start, end)


@dataclass(frozen=True)
class Coverage:
    """Statistics of the stated errors of one quantity.

    Parameters
    ----------
    true, stated, tolerances : sequence of float
        Relative errors of every test, and its tolerance.
    by_steps : sequence of float
        True errors by steps alone, zero where inputs are drawn at every pass.
    """

    true: Sequence[float]
    stated: Sequence[float]
    tolerances: Sequence[float]
    by_steps: Sequence[float] = ()

    @property
    def covered(self) -> int:
        """Tests with a stated error of at least the true one, or a true error below `SMALL`."""
        return sum(s >= t or t < SMALL for s, t in zip(self.stated, self.true, strict=True))

    @property
    def met(self) -> int:
        """Tests with a true error within their tolerance."""
        return sum(t <= limit for t, limit in zip(self.true, self.tolerances, strict=True))

    @property
    def ratios(self) -> list[float]:
        """Stated over true errors, where the true error is above `SMALL`."""
        return [s / t for s, t in zip(self.stated, self.true, strict=True) if t > SMALL]

    @property
    def greatest_step(self) -> float:
        """Greatest true error by steps alone over the tolerance."""
        pairs = zip(self.by_steps, self.tolerances, strict=False)
        return max((error / limit for error, limit in pairs), default=0.0)

    @property
    def counts(self) -> dict[str, float]:
        """The statistics by name."""
        ratios = self.ratios
        numbers: dict[str, float] = {
            "tests": len(self.true),
            "covered": self.covered,
            "met": self.met,
        }
        if self.true:
            numbers |= {"greatest": max(self.true), "greatest_step": self.greatest_step}
        quantiles = np.quantile(ratios, list(QUANTILES.values())) if ratios else ()
        return {**numbers, **dict(zip(QUANTILES, map(float, quantiles), strict=False))}


def coverage(rows: Sequence[Measurement], quantity: str) -> Coverage:
    """Return the statistics of a quantity over tests that have it and have not failed."""
    done = [row for row in rows if not row.failed and quantity in row.errors]
    return Coverage(
        [row.errors[quantity] for row in done],
        [row.errors[STATED + quantity] for row in done],
        [row.counts["tolerance"] for row in done],
        # the scatter of draws is no error by steps
        [0.0 if row.counts.get(DRAWN) else row.errors.get(STEPS + quantity, 0.0) for row in done],
    )


def worst(rows: Sequence[Measurement], quantity: str, count: int) -> list[Measurement]:
    """Return the tests with the greatest ratios of true to stated error, in decreasing order."""

    def ratio(row: Measurement) -> float:
        true, estimate = row.errors[quantity], row.errors[STATED + quantity]
        return float("inf") if true < SMALL else estimate / true

    done = [row for row in rows if not row.failed and quantity in row.errors]
    return [row for row in sorted(done, key=ratio)[:count] if ratio(row) < 1.0]
