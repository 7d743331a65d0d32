"""Identification of the wear factor from measured profiles of several tests."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from wearsim.errors import Mistake, mistake_in
from wearsim.profiles import ProfileChoice
from wearsim.quantities import quantity
from wearsim.results.io.files import write_results
from wearsim.results.io.outputs import output_lock
from wearsim.scenario import Scenario, as_scenario, require_run
from wearsim.studies.automatic import with_chosen_model
from wearsim.studies.cam.cam_wear import Wanted, size_of
from wearsim.studies.cam.turn import turn_of
from wearsim.studies.failures import too_deep
from wearsim.studies.identify.analysis import Identified, identified
from wearsim.studies.identify.inputs import contained_inputs, with_known
from wearsim.studies.identify.lifts import read_change
from wearsim.studies.identify.likelihood import depth_range
from wearsim.studies.identify.measurements import (
    Measurement,
    key_of,
    measurements_of,
    read_tests,
    tables_of,
)
from wearsim.studies.identify.pooling import FEW_DRAWS, content, specimens_of
from wearsim.studies.identify.result import IdentificationResult
from wearsim.studies.identify.traces import Trace, read_trace, smoothed
from wearsim.studies.identify.trajectories import TOLERANCE, Grower, Trajectories, check_law
from wearsim.studies.progress import shown_progress
from wearsim.units import QuantityError, as_written
from wearsim.uq.hierarchy.verdict import NEGLIGIBLE

MOST_DRAWS = 768  # where a trace leaves few of the first ones
OF_NOISE = 0.15  # tolerance of wear tests over the relative noise of the traces
_LEAST_SIGNAL = 3.0  # depth over the noise
_MOST_STD = 0.25  # of a measured depth, over the depth
_SHARE = ("cylinder", "roller")


def identify(
    scenario: Scenario | str | Path,
    tests: Sequence[str | Path | Measurement] | str | Path,
    output: str | Path | None = None,
    *,
    before: Sequence[str | Path] = (),
    shoulders: float | str | None = None,
    curvature: bool = False,
    share: Sequence[str] = (),
    fix: Mapping[str, object] | None = None,
    choice: ProfileChoice | None = None,
    draws: int | None = None,
    negligible: float = NEGLIGIBLE,
    force: bool = False,
    progress: bool = False,
    on_progress: Callable[[int, int], None] | None = None,
) -> IdentificationResult:
    """Identify the wear factor K/H from measured grooves, and whether it scatters.

    The worn profile of a test is computed for draws of its other inputs, and compared with the
    measured one for all wear factors. The wear factors of the tests are then described by
    ln K/H ~ N(m, t^2).

    Parameters
    ----------
    scenario : Scenario or path
        A scenario of a run, or its file. Its random inputs are those that may differ between the
        tests; a random K/H of it is not used.
    tests : sequence of path, or path
        Profiles, each of one test, or a tests file (TOML); items may be `Measurement` too.
    output : path, optional
        Results file; without it the result is kept in memory only.
    before : sequence of path
        Profiles of the same places before the tests, in the order of the tests.
    shoulders : float or str, optional
        Distance from the middle of a groove beyond which the surface is unworn, "9 mm" or in
        metres; found by default.
    curvature : bool
        Whether the traces have an unknown curvature beside offset and inclination, as of a bow of
        the instrument's guide; they need unworn shoulders then.
    share : sequence of str
        ("cylinder", "roller") if both bodies have one unknown factor of their K/H.
    fix : mapping of str to object, optional
        Inputs that are known and equal in all tests, {"friction": 0.1}.
    choice : ProfileChoice, optional
        Columns, units and rows of the profiles.
    draws : int, optional
        Number of draws of the other inputs; by default 256, and 768 where the shape of a groove
        leaves few of them, or 128 where a wear test is needed for each of several K/H.
    negligible : float
        Scatter of ln K/H below which it is negligible.
    force : bool
        Overwrite an existing file.
    progress : bool
        Whether to show the progress, on a terminal or in a notebook.
    on_progress : callable, optional
        Called with the numbers of completed and of all wear tests.

    Returns
    -------
    IdentificationResult

    Raises
    ------
    ScenarioError, CapabilityError, ResultsFileError
        If scenario, tests file or a profile cannot be used.
    TypeError, ValueError
        If an argument is invalid.
    SolverError
        If a wear test fails.

    Examples
    --------
    >>> from wearsim.studies.identify.measurements import Measurement
    >>> depths = [Measurement(f"test {d}", depth=d * 1e-6, depth_std=1e-6) for d in (28, 48, 62)]
    >>> found = wearsim.identify("rig.toml", depths)
    >>> found.verdict
    'random'
    """
    started, created = time.monotonic(), datetime.now(UTC).isoformat(timespec="seconds")
    scenario = as_scenario(scenario)
    if fix:
        scenario = scenario.changed({key_of(key): value for key, value in fix.items()})
    require_run(scenario)
    check_law(scenario)
    scenario = with_chosen_model(scenario, test=True)
    if share and sorted(share) != sorted(_SHARE):
        raise ValueError(f"share must be {', '.join(_SHARE)}, got {', '.join(share)}")
    width = quantity(shoulders, "m") if isinstance(shoulders, str) else shoulders
    items = _measurements(tests, before, choice, width, curvature)
    files = [path for item in items for path in item.files]
    with output_lock(output, force, [*scenario.paths, *files]):
        study = _Study(scenario, items, draws, bool(share))
        with shown_progress(progress, "Counter", on_progress, scenario) as watch:
            rows = study.rows(watch)
        data = content(
            study.scenario,
            specimens_of(rows),
            negligible,
            study.notes,
            created,
            time.monotonic() - started,
            measured=tables_of(items),
            draws=draws,
            shared=bool(share),
            contained=contained_inputs(study.scenario, items, [key_of(key) for key in fix or ()]),
        )
        data.warnings.extend(study.left_out)
        if output is not None:
            write_results(Path(output), data)
    return IdentificationResult(data, Path(output) if output is not None else None)


def _measurements(
    tests: Sequence[str | Path | Measurement] | str | Path,
    before: Sequence[str | Path],
    choice: ProfileChoice | None,
    shoulders: float | None,
    curvature: bool,
) -> list[Measurement]:
    """Return the measurements given by files, by a tests file, or as they are."""
    if isinstance(tests, str | Path):
        if Path(tests).suffix.lower() == ".toml":
            return [
                replace(item, curvature=item.curvature or curvature) for item in read_tests(tests)
            ]
        tests = [tests]
    if not isinstance(tests, Sequence):
        kind = type(tests).__name__
        raise TypeError(
            f"tests must be files of profiles, a tests file or Measurements, got a {kind}"
        )
    given = [item for item in tests if isinstance(item, Measurement)]
    if given and (before or len(given) < len(tests)):
        raise TypeError("tests are either files or Measurement objects, not both")
    if not tests:
        raise ValueError("no test is given; name its profile, or a tests file")
    if given:
        return [replace(item, curvature=item.curvature or curvature) for item in given]
    files = [item for item in tests if not isinstance(item, Measurement)]
    return measurements_of(files, before, choice, shoulders, curvature)


@dataclass(frozen=True)
class _Ready:
    """A measurement with its scenario, trace, passes and range of depths."""

    item: Measurement
    scenario: Scenario
    trace: Trace | None
    passes: float
    depths: tuple[float, float]


class _Study:
    """Traces and trajectories of an identification."""

    def __init__(
        self, scenario: Scenario, items: Sequence[Measurement], draws: int | None, shared: bool
    ) -> None:
        self.scenario, self.items, self.draws, self.shared = scenario, items, draws, shared
        self.notes: list[str] = list(scenario.notes)
        self.left_out: list[str] = []
        self._by_inputs: dict[str, list[_Ready]] = {}
        for item in items:
            if ready := self._ready(item):
                self._by_inputs.setdefault(
                    repr((sorted(item.values.items()), sorted(item.errors.items()))), []
                ).append(ready)
        if not self._by_inputs:
            raise mistake_in(
                items[0].file or items[0].name, f"no groove can be used: {'; '.join(self.left_out)}"
            )

    def _ready(self, item: Measurement) -> _Ready | None:
        """Read a measurement; None if it is left out."""
        if item.body == "roller" and not self.shared:
            raise item.refused(
                Mistake(
                    "",
                    "body",
                    "wear of the roller is measured, and its K/H is that of the scenario",
                    None,
                    "share = cylinder, roller (--share k=cylinder,roller)",
                )
            )
        _check_place(self.scenario, item)
        scenario = with_known(self.scenario, item)
        require_run(scenario)
        passes = _passes(scenario, item)
        crown = scenario.roller.crown_radius
        if item.profile is not None and not scenario.axial_gap.is_crowned:
            raise mistake_in(
                scenario.file,
                "makes grooves that this study cannot level, those of circular crowns only",
                scenario.roller.axial_profile.form,
                "crown_radius, or depth = in the tests",
                table="roller",
                key="axial_profile",
            )
        if item.lift is not None:
            trace = read_change(item, turn_of(scenario).cam.follower)
            size = float(size_of(item.surface, smoothed(trace.height)))
            return _Ready(item, scenario, trace, passes, (0.5 * size, 1.2 * size))
        if item.profile is None:
            return _Ready(item, scenario, None, passes, _possible_depths(scenario, item))
        trace = read_trace(item, crown)
        self.notes += [f"{item.name}: {text}" for text in trace.notes]
        if trace.depth is None or trace.noise is None:
            greatest = 0.125 * (trace.y[-1] - trace.y[0]) ** 2 / crown
            return _Ready(item, scenario, trace, passes, (0.2 * greatest, 1.2 * greatest))
        if trace.depth < _LEAST_SIGNAL * trace.noise.std:
            self.left_out.append(
                f"{item.name} is left out: its groove is {1e6 * trace.depth:.3g} um deep, and the"
                f" noise of the shoulders is {1e6 * trace.noise.std:.3g} um, so that no wear can be"
                " seen; if it wore less than the others, K/H of the others is not that of all"
            )
            return None
        return _Ready(item, scenario, trace, passes, (trace.depth, trace.depth))

    def rows(self, watch: Callable[[int, int], None] | None) -> list[Identified]:
        """Run the wear tests, and return the wear factor of each groove in the given order."""
        identified_tests: dict[int, Identified] = {}
        counts = {"done": 0, "before": 0}

        def report(done: int, total: int) -> None:
            if watch is not None:
                watch(counts["before"] + done, counts["before"] + total)
            counts["done"] = counts["before"] + done

        for group in self._by_inputs.values():
            some, trajectories = self._group(group, self.draws, report)
            counts["before"] = counts["done"]
            few = min(row.kernel.effective_size for row in some) < FEW_DRAWS
            if few and self.draws is None and trajectories.values and not trajectories.reasons:
                # the shape of a groove leaves few draws of the slack of several rollers
                some, trajectories = self._group(group, MOST_DRAWS, report)
                counts["before"] = counts["done"]
            for reason in trajectories.reasons:
                note = f"a wear test for each of several K/H, since {reason}"
                self.notes += [note] if note not in self.notes else []
            if trajectories.lost:
                self.notes.append(f"{trajectories.lost} draws are left out, whose tests failed")
            identified_tests.update({id(row.item): row for row in some})
        return [identified_tests[id(item)] for item in self.items if id(item) in identified_tests]

    def _group(
        self, group: Sequence[_Ready], draws: int | None, report: Callable[[int, int], None]
    ) -> tuple[list[Identified], Trajectories]:
        """Return the wear factors of tests with the same inputs, and their trajectories."""
        angles = {
            ready.item.surface: ready.item.angle for ready in group if ready.item.angle is not None
        }
        # where the noise is small, numerical errors of a shape would make some draws more probable
        tolerance = min(
            [TOLERANCE, *(OF_NOISE * ready.trace.relative_noise for ready in group if ready.trace)]
        )
        grower = Grower(group[0].scenario, draws, self.shared, report, angles, tolerance)
        wanted = [Wanted(test.item.surface, test.passes, *test.depths) for test in group]
        trajectories = (
            grower.grow_on_cam(wanted) if self.scenario.cam is not None else grower.grow(wanted)
        )
        rows = [
            identified(
                *(ready.item, ready.trace, trajectories, ready.passes),
                ready.scenario.roller.crown_radius,
            )
            for ready in group
        ]
        return [replace(row, shares=shares(row, trajectories)) for row in rows], trajectories


def shares(row: Identified, trajectories: Trajectories) -> dict[str, float]:
    """Return the part of the variance of ln K/H that follows each input, by rank correlation.

    Parameters
    ----------
    row : Identified
    trajectories : Trajectories
        Those of its draws.
    """
    used = np.exp(row.likelihood.log_evidence - row.likelihood.log_evidence.max()) > 1e-3
    if used.sum() < 16:
        return {}
    mean = row.likelihood.mean[used].argsort().argsort()
    parts = {}
    for key, values in trajectories.values.items():
        size = np.abs(values[used])
        if np.ptp(size) > 0.0:
            parts[key] = float(np.corrcoef(size.argsort().argsort(), mean)[0, 1] ** 2)
    return parts


def _passes(scenario: Scenario, item: Measurement) -> float:
    """Return the passes at which a groove was measured."""
    if item.at is None:
        return float(scenario.total_passes)
    text, units = item.at.strip(), {"passes": 1.0, **dict([scenario.life_unit])}
    unit = next((unit for unit in units if text.endswith(unit)), "")
    try:
        number = float(text.removesuffix(unit)) if unit else quantity(text, "s")
        passes = number * units.get(unit, scenario.pass_rate)
    except ValueError as error:
        raise item.refused(
            Mistake(
                "",
                "at",
                error.what if isinstance(error, QuantityError) else "is no number of passes",
                as_written(item.at),
                'a time such as "100 min", or "2e5 passes", of a cam also "1e5 turns"',
            )
        ) from error
    if not 0.0 < passes <= scenario.total_passes * (1.0 + 1e-9):
        raise item.refused(
            Mistake(
                "",
                "at",
                "is not within the test",
                item.at,
                f"up to {scenario.total_time / 60.0:.6g} min",
            )
        )
    return passes


def _possible_depths(scenario: Scenario, item: Measurement) -> tuple[float, float]:
    """Return the least and the greatest depth that a measured depth leaves possible [m]."""
    depth, std = item.depth, item.depth_std
    assert depth is not None
    assert std is not None
    if std > _MOST_STD * depth:
        raise item.refused(
            Mistake(
                "",
                "depth_std",
                f"is more than a quarter of the depth of {1e6 * depth:.4g} um: a depth of zero is"
                " almost possible, and K/H has no lower bound",
                f"{1e6 * std:.4g} um",
                f"at most {1e6 * _MOST_STD * depth:.4g} um, or the test left out",
            )
        )
    if text := too_deep(scenario, depth):
        raise item.refused(Mistake("", "depth", text, None, "a depth in its unit, '48 um'"))
    return depth_range(depth, std)


def _check_place(scenario: Scenario, item: Measurement) -> None:
    """Refuse a groove of a cam without its angle, and an angle or a lift of a cylinder."""
    if scenario.cam is None:
        for key, value in (("angle", item.angle), ("lift", item.lift)):
            if value is not None:
                raise item.refused(
                    Mistake(
                        "", key, "is for a cam, and the scenario has a cylinder", None, f"no {key}"
                    )
                )
    elif item.lift is None and item.angle is None and item.body == "cylinder":
        raise item.refused(
            Mistake(
                "",
                "angle",
                "is needed for a groove of a cam: where the trace crosses it",
                None,
                'angle = "112 deg" with profile, in a tests file (--tests)',
            )
        )
    elif item.angle is not None and item.body == "roller":
        raise item.refused(
            Mistake("", "angle", "has no meaning for a groove of the roller", None, "no angle")
        )
