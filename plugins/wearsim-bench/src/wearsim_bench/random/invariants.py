"""Invariants of wear tests: what must hold for any scenario."""

from __future__ import annotations

import json
import os
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from wearsim.errors import WearsimError
from wearsim.plugins import BODIES
from wearsim.scenario import Scenario
from wearsim.studies.ensemble.api import ensemble
from wearsim.studies.run.recorder import Event, Stepped
from wearsim.studies.run.result import Result
from wearsim.studies.run.run import resume, run
from wearsim_bench.contact.worn_profiles import failure_reason
from wearsim_bench.measure.measurement import Measurement
from wearsim_bench.random.transformations import (
    SYSTEMS,
    UnitSystem,
    has_mirror_image,
    in_units,
    mirrored,
)
from wearsim_bench.stated_errors.study import (
    CLEAR,
    QUANTITIES,
    SLOW,
    SMALL,
    STATED,
    stated,
    worn_of_result,
)

_UNITS = ("_m", "_m3", "_J", "_W", "_N", "_Pa")  # of numbers in JSON
EXCESS = "excess"  # count of a measurement: the deviation over what is allowed
SECONDS = 30.0  # limit on the process time of one run
ROUND_OFF = 1e-9  # of balances, and of values without a stated error
IN_UNITS = 0.1  # part of the stated error by which scaled and mirrored tests may differ
REALISATIONS = 3  # of a batch
MORE_LOAD = 1.25
TRUE_STEPS, TRUE_STRIPS = 0.03, 3  # tolerance and strips of the truth over those of a test
#: quantities compared, with the unit of their values
COMPARED = {
    "depth": "m",
    "roller_depth": "m",
    "worn_volume": "m^3",
    "roller_worn_volume": "m^3",
    "dissipated_energy": "J",
}


class InapplicableError(Exception):
    """An invariant does not apply to a scenario."""


@dataclass
class Subject:
    """A scenario, its run, and a folder for files.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    folder : Path
        Folder in which files are written.

    Attributes
    ----------
    errors : dict of str to float
        True and stated errors, where an invariant compares them.
    """

    scenario: Scenario
    folder: Path
    errors: dict[str, float] = field(default_factory=dict, init=False)
    _count: int = field(default=0, init=False)

    @cached_property
    def result(self) -> Result:
        """The finished run of the scenario."""
        return timed(self.scenario)

    def path(self) -> Path:
        """Return the path of a new file."""
        self._count += 1
        return self.folder / f"{self._count}.h5"


def timed(scenario: Scenario, output: Path | None = None, **options: Any) -> Result:
    """Return the run of a scenario; raise TimeoutError after `SECONDS` of process time."""
    return run(scenario, output, stop_requested=_deadline(), **options)


def _deadline() -> Callable[[], bool]:
    begin = time.process_time()

    def is_late() -> bool:
        if time.process_time() - begin > SECONDS:
            raise TimeoutError(f"takes longer than {SECONDS:g} s")
        return False

    return is_late


def last(result: Result, name: str) -> np.ndarray:
    """Return the last values of a column of the history."""
    return np.asarray(result.raw.history[name][-1], dtype=np.float64)


def deviation(one: Result, other: Result, part: float, units: UnitSystem | None = None) -> float:
    """Return the greatest difference of two runs over what is allowed.

    Parameters
    ----------
    one, other : Result
        The runs; the second may be in other units.
    part : float
        Part of both stated errors that is allowed, beside round-off.
    units : UnitSystem, optional
        The units of the second run over those of the first.
    """
    greatest = 0.0
    for name, unit in COMPARED.items():
        factor = 1.0 if units is None else units.factor(unit)
        first, second = last(one, name), last(other, name) / factor
        error = _error(one, name) + _error(other, name) / factor
        allowed = part * error + ROUND_OFF * np.abs(first).max() + np.finfo(float).tiny
        greatest = max(greatest, float(np.abs(first - second).max() / allowed))
    return greatest


def _error(result: Result, name: str) -> float:
    errors = {"worn_volume": "volume_error"}
    column = errors.get(name, f"{name}_error")
    return float(np.max(last(result, column))) if column in result.raw.history else 0.0


def runs(subject: Subject) -> float:
    """Return 0 if a run ends with finite numbers that are not negative."""
    result = subject.result
    for name, values in {**result.raw.history, **result.raw.records}.items():
        if not np.isfinite(values).all() and not name.startswith(("adhesion", "longitudinal")):
            raise AssertionError(f"{name} is not finite")
    for name in (*COMPARED, "power", "peak_pressure"):
        if (np.asarray(result.raw.history[name]) < 0.0).any():
            raise AssertionError(f"{name} is negative")
    return 0.0


def energy_balance(subject: Subject) -> float:
    """Return the relative difference of worn volume and K/H times energy over round-off."""
    result, law = subject.result, subject.scenario.wear
    if law is None or law.law != "archard-dissipation":
        raise InapplicableError
    factors = _wear_factors(result)
    energy = float(last(result, "dissipated_energy").sum())
    if factors is None or energy * sum(factors) == 0.0:
        raise InapplicableError
    rollers = float((result.raw.static["multiplicity"] @ last(result, "roller_worn_volume")).sum())
    volume = float(last(result, "worn_volume").sum()) + rollers
    return abs(volume / (energy * sum(factors)) - 1.0) / ROUND_OFF


def _wear_factors(result: Result) -> list[float] | None:
    """Return K/H of cylinder or cam and of the rollers [1/Pa]; None if not given as such."""
    options, drawn = getattr(result.scenario.wear, "options", None), result.drawn
    factors = []
    for body in BODIES:
        value = getattr(getattr(options, body), "k_over_h", None)
        values = drawn.get(f"wear.{body}.k_over_h", (value,))
        if len(values) != 1 or values[0] is None:
            return None
        factors.append(float(values[0]))
    (factor,) = drawn.get("wear.factor", (getattr(options, "factor", 1.0),))
    return [float(factor) * value for value in factors]


def mirror_image(subject: Subject) -> float:
    """Return the deviation from the mirror image."""
    if not has_mirror_image(subject.scenario):
        raise InapplicableError
    return deviation(subject.result, timed(mirrored(subject.scenario)), IN_UNITS)


def scaling(name: str) -> Callable[[Subject], float]:
    """Return an invariant: the deviation from the same test in other units."""

    def invariant(subject: Subject) -> float:
        units = SYSTEMS[name]
        scaled = timed(in_units(subject.scenario, units))
        return deviation(subject.result, scaled, IN_UNITS, units)

    return invariant


def half_and_resumed(subject: Subject) -> float:
    """Return the deviation of a test in two halves; both have the stated errors."""
    scenario, path = subject.scenario, subject.path()
    whole, key = scenario.total_passes, "operation.passes"
    half = whole // 2
    if scenario.cam is not None:
        key, half = "operation.turns", half // scenario.operation.rollers
    if half == 0:
        raise InapplicableError
    timed(scenario.changed({key: half}), path)
    ended = resume(path, until=f"{whole} passes")
    return deviation(subject.result, ended, 1.0)


def killed_and_resumed(subject: Subject) -> float:
    """Return 0 if a run that is killed and resumed equals the whole run bit for bit."""
    steps = int(subject.result.steps)
    if steps < 2:
        raise InapplicableError
    path = subject.path()
    scenario = subject.scenario.changed({"outputs.checkpoint_every": "1 us"})
    process = os.fork()
    if process == 0:
        _killed_after(scenario, path, steps // 2)
    os.waitpid(process, 0)
    if not path.exists():
        raise AssertionError(f"no file after {steps // 2} of {steps} steps")
    resumed = resume(path)
    for name, values in subject.result.raw.history.items():
        if not np.array_equal(values, resumed.raw.history[name], equal_nan=True):
            raise AssertionError(f"{name} differs after a kill in step {steps // 2} of {steps}")
    return 0.0


def _killed_after(scenario: Scenario, path: Path, steps: int) -> None:
    """Run a scenario in this process, and kill it after some steps."""
    done = 0

    def watch(event: Event) -> None:
        nonlocal done
        done += isinstance(event, Stepped)
        if done >= steps:
            os.kill(os.getpid(), signal.SIGKILL)

    try:
        run(scenario, path, on_event=watch)
    finally:
        os._exit(1)


def shell_equals_python(subject: Subject) -> float:
    """Return 0 if `wearsim run --json` prints the numbers of `wearsim.run`."""
    from typer.testing import CliRunner  # noqa: PLC0415  (slow to import)

    from wearsim.cli.app import app  # noqa: PLC0415  (slow to import)

    scenario, path = subject.scenario, subject.path()
    file = subject.folder / "scenario.toml"
    file.write_text(scenario.text)
    for name, text in scenario.files.items():
        (subject.folder / name).write_text(text)
    done = CliRunner().invoke(app, ["run", str(file), "-o", str(path), "--json", "--quiet"])
    if done.exit_code:
        raise AssertionError(f"exit code {done.exit_code}: {done.output[-300:]}")
    printed = json.loads(done.stdout)
    for name, value in subject.result.view.data().items():
        if name.endswith(_UNITS) and printed[name] != value:
            raise AssertionError(f"{name} is {printed[name]} from the shell, {value} in Python")
    return 0.0


def batch_equals_single(subject: Subject) -> float:
    """Return 0 if the tests of an ensemble equal single runs bit for bit."""
    scenario = subject.scenario
    if not scenario.random:
        raise InapplicableError
    many = ensemble(
        scenario, REALISATIONS, subject.path(), scheduler="serial", stop_requested=_deadline()
    )
    for number, depth in enumerate(many.values("depth")[:, -1]):
        single = timed(scenario.changed({"sampling.realisation": number}))
        if float(last(single, "depth").max()) != depth:
            raise AssertionError(f"depth of realisation {number}: {depth} in a batch")
    return 0.0


def more_load_wears_more(subject: Subject) -> float:
    """Return 0 if a greater constant load at prescribed creepage wears at least as much."""
    scenario = subject.scenario
    kind = scenario.load.kind
    if scenario.cam is not None or kind != "constant" or scenario.creepage.drive != "creepage":
        raise InapplicableError
    force = getattr(scenario.load.options, "normal_force", None)
    if not isinstance(force, float):
        raise InapplicableError
    more = timed(scenario.changed({"load.normal_force": f"{MORE_LOAD * force!r} N"}))
    volume, volume_of_more = (
        float(last(result, "worn_volume").sum()) for result in (subject.result, more)
    )
    errors = _error(subject.result, "worn_volume") + _error(more, "worn_volume")
    return max(volume - volume_of_more, 0.0) / max(errors, ROUND_OFF * volume, np.finfo(float).tiny)


def truth_within_stated_errors(subject: Subject) -> float:
    """Return the greatest ratio of true to stated error of depth, profile and volume.

    The truth is a run at a much smaller tolerance on three times as many strips of the same width.
    Relative errors below `SMALL` count as covered.
    """
    result, y = subject.result, np.asarray(subject.result.y)
    spacing = float(y[1] - y[0])
    changes: dict[str, object] = {
        "evolution.tolerance": TRUE_STEPS * subject.scenario.evolution.tolerance,
        "evolution.strip_error": False,
        "contact.strips": TRUE_STRIPS * len(y),
        "contact.width": f"{spacing * len(y)!r} m",
        "contact.centre": f"{0.5 * float(y[0] + y[-1])!r} m",
    }
    fine = worn_of_result(timed(subject.scenario.changed(changes)))
    if fine.depth == 0.0:
        raise InapplicableError
    true = np.abs(worn_of_result(result).changes_from(fine))
    stated_errors = stated(result)
    for name, error in zip(QUANTITIES, true.tolist(), strict=True):
        subject.errors |= {name: error, STATED + name: stated_errors[name]}
    limits = np.array([stated_errors[name] for name in QUANTITIES])
    return float((true / np.maximum(limits, SMALL)).max())


INVARIANTS: dict[str, Callable[[Subject], float]] = {
    "runs to its end, finite and not negative": runs,
    "volume is K/H times energy": energy_balance,
    "mirror image": mirror_image,
    **{f"{name} scaling": scaling(name) for name in SYSTEMS},
    "half test and resume": half_and_resumed,
    "kill and resume, bit for bit": killed_and_resumed,
    "shell equals Python": shell_equals_python,
    "batch equals single runs, bit for bit": batch_equals_single,
    "more load wears no less": more_load_wears_more,
    "truth within stated errors": truth_within_stated_errors,
}


def measured(name: str, scenario: Scenario, row: Measurement) -> Measurement:
    """Return a row with the excess of an invariant, 1 being the limit, and what is wrong.

    Parameters
    ----------
    name : str
        One of `INVARIANTS`.
    scenario : Scenario
        The scenario.
    row : Measurement
        Names of the test; its setting becomes the invariant.

    Returns
    -------
    Measurement
        With the count `EXCESS` where the invariant applies, and the true and stated errors of the
        last one; failed if the limit is exceeded; with a remark if a run ends with a clear error,
        or one that the scenario is compared with takes longer than `SECONDS`.
    """
    row = replace(row, setting=name)
    with TemporaryDirectory() as folder:
        subject = Subject(scenario, Path(folder))
        try:
            excess = INVARIANTS[name](subject)
        except InapplicableError:
            return row
        except WearsimError as error:
            return replace(row, remark=CLEAR + failure_reason(error))
        except TimeoutError as error:
            if name != next(iter(INVARIANTS)):  # another run than that of the scenario
                return replace(row, remark=SLOW + failure_reason(error))
            return replace(row, failed=failure_reason(error))
        except Exception as error:
            return replace(row, failed=failure_reason(error))
    counts = {EXCESS: excess, "tolerance": scenario.evolution.tolerance}
    failed = "" if excess <= 1.0 else f"{excess:.3g} times what is allowed"
    return replace(row, counts=counts, errors=subject.errors, failed=failed)
