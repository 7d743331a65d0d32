"""View of an ensemble: estimates with intervals, Sobol indices, random inputs, realisations."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any, TypeVar

import numpy as np

from wearsim.levelling import ComputedProfile
from wearsim.report.csv_files import computed, drawn
from wearsim.report.text import (
    NINETY_PERCENT,
    NOTHING,
    OBSERVABLES,
    QUANTILES,
    TOO_FEW_REALISATIONS,
    cells,
    count,
    footer,
    in_unit,
    lapse,
    number_of_realisations,
    part_with_interval,
    shown,
    si_key,
    simulated,
    too_few,
    within,
)
from wearsim.report.view import Answer, Column, Columns, Frame, Row, Rows, Table
from wearsim.results.study_view import (
    CONSTANT,
    StudyView,
    drawn_data,
    drawn_rows,
    progress_text,
    varying_inputs,
    varying_rows,
)
from wearsim.studies.ensemble.file.data import Band, Effect, EnsembleData
from wearsim.studies.ensemble.file.schema import ALL_OBSERVABLES, FAILED, KEPT, LIFE, PENDING
from wearsim.studies.ensemble.result import EnsembleResult
from wearsim.studies.fatigue.observables import fatigue_scenario
from wearsim.studies.fatigue.view import (
    fatigue_data,
    source_rows,
    with_sources,
)
from wearsim.uq.estimation.estimates import Estimate, Target

INTERVAL = "  95 % interval"
_HEADS = ("at the end", "mean", "std", "5 %", "median", "95 %")
_SCALARS = ("steps", "solves", "depth_error", "volume_error", "control")
_BLOCK = 16384  # realisations in memory at a time
#: names of CSV files and of the quantity, of curves other than damage
_CURVES = {"depth_profile": ("profile", "depth"), "lift_error_curve": ("lift_error", "lift error")}

Shown = TypeVar("Shown", bound=EnsembleResult)


class RealisationsView(StudyView[Shown]):
    """What ensembles and lives have in common: failures, realisations, random inputs."""

    @property
    def failures(self) -> str:  # type: ignore[override]
        """Number of failed realisations, the first error, and what can be done."""
        result = self.result
        if not result.failed:
            return ""
        first, text = next(iter(result.errors.items()))
        return (
            f"{count(result.failed)} of {count(result.count + result.failed)} realisations"
            f" failed; the first is number {first}: {text}\n"
            "the same draws fail again unless the scenario or the software changes; after a lack of"
            " memory, a killed worker or an updated plugin repeat them with:"
            f" wearsim resume {result.path} --failed"
        )

    def random_inputs(self) -> Rows:
        """Return the draws of the random inputs, and descriptions of those that vary in time."""
        varying = {item["name"]: item["text"] for item in self.result.raw.groups}
        varying |= varying_inputs(self.result, self.result.inputs)
        return [*drawn_rows(self.result), *varying_rows(varying)]

    def observables_table(self, title: str) -> Table:
        """Return the estimates of all observables at the end, with intervals."""
        return Table(
            "",
            [line for name in observed(self.result) for line in _lines(self.result, name)],
            (title, *_HEADS[1:]),
        )

    def answers(self) -> dict[str, Answer]:
        """Return the numbers of the rows and of the table of observables, ``depth.p95``.

        The name of an observable alone stands for its mean.
        """
        answers = super().answers()
        for name in observed(self.result):
            words, unit = OBSERVABLES[name]
            estimate = self.result.estimate(name, -1, QUANTILES)
            values = {
                "": estimate.mean,
                ".mean": estimate.mean,
                ".std": estimate.std,
                **{f".p{100.0 * p:g}": interval for p, interval in estimate.quantiles},
            }
            answers |= {
                f"{name}{ending}": Answer(value.value, unit, words)
                for ending, value in values.items()
            }
        return answers

    def frame(self) -> Frame:
        """Return the successful realisations, one row each, at the end of the test."""
        result = self.result
        return Frame(
            [
                (
                    name,
                    item.unit,
                    result.at_end(name) if name in result.observables else result.values(name),
                )
                for name, item in result.raw.schema.variables.items()
                if item.dims[0] == "realisation" and name not in {"status", "error"}
            ],
            "realisation",
            result.numbers,
        )

    def columns(self) -> Mapping[str, Columns]:
        """Return realisations, courses, and profile and lift error at the end."""
        result, scenario = self.result, fatigue_scenario(self.result)
        tables: dict[str, Columns] = {
            "realisations.csv": (
                with_sources(block, scenario) for block in _realisations(result.raw)
            ),
            **({"courses.csv": [with_sources(_courses(result), scenario)]} if result.count else {}),
        }
        for name in [name for name in KEPT if result.count and name in result.raw.schema.variables]:
            band, (file, what) = result.band(name), _CURVES.get(name, (name, "damage"))
            if what != "damage" or band.mean.any():  # of a body that may pit
                tables[f"{file}.csv"] = [
                    with_sources(_band(result.raw, name, what, band), scenario)
                ]
        if result.failed:
            tables["failures.csv"] = [
                [
                    Column("realisation", list(map(str, result.errors))),
                    Column("error", list(result.errors.values())),
                ]
            ]
        return tables


class EnsembleView(RealisationsView[EnsembleResult]):
    """Mean depth with its interval, further estimates, and what the scatter is due to.

    Panels: density, course, convergence, profile, Sobol indices, values against the first input; of
    a cam also the lift error. Files: realisations, courses, profile; the table of pandas has the
    realisations.
    """

    verb, sheet = "ensemble", "wearsim.studies.ensemble.panels:ensemble_sheet"

    def __init__(self, result: EnsembleResult) -> None:
        super().__init__(result)
        self.question = (
            f"How deep do {number_of_realisations(result.count)} of a test of"
            f" {count(result.raw.total_passes)} roller passes ({simulated(result.raw.total_time)})"
            " wear the cylinder?"
        )

    def rows(self) -> Rows:
        """Return the estimates with their intervals, the mean depth first."""
        result = self.result
        if result.count == 0:
            return [Row("depth", "no test is completed")]
        depth = result.estimate("depth", -1, (*NINETY_PERCENT, 0.5))
        rows = [Row("mean depth", depth.mean, "um")]
        if result.count > 1 and not result.is_constant("depth"):
            low, high = (depth.quantile(p) for p in NINETY_PERCENT)
            rows += [
                Row(
                    "90 % of the tests",
                    f"{in_unit(low.value, 'um', 3)} to {shown(high.value, 'um', 3)}",
                ),
                Row("median", depth.quantile(0.5), "um"),
                Row("95 % of the tests are below", high, "um"),
                Row("standard deviation", depth.std, "um"),
            ]
        others = ("width", "worn_volume", "roller_depth", "dissipated_energy", "peak_pressure")
        return rows + [
            Row(f"mean {words}", result.estimate(name, -1, ()).mean, unit)
            for name, (words, unit) in ((name, OBSERVABLES[name]) for name in others)
            if result.at_end(name).any()
        ]

    def study(self) -> Rows:
        """Return rows on realisations, design, method, precision and effort."""
        result, raw = self.result, self.result.raw
        wall, ended = raw.wall_seconds, result.count + result.failed
        effort = lapse(wall)
        if wall and ended:
            effort += f", {shown(ended / wall, '1', 3)} realisations per second"
        return [
            Row(
                "realisations",
                progress_text(result.count, result.failed, result.requested, result.finished),
            ),
            Row("sampling design", f"{raw.plan}, seed {raw.seed}"),
            Row(
                "length of a test",
                f"{count(raw.total_passes)} passes, {shown(raw.total_time, 'min')}",
            ),
            *source_rows(fatigue_scenario(result)),
            Row("contact model", result.described_model),
            Row("stepper", f"{raw.stepper}, tolerance {raw.tolerance:g}"),
            *(
                [Row("95 % intervals", result.estimate("depth", -1, ()).method)]
                if result.count and result.plan != "monte-carlo"
                else []
            ),
            *(self._precision() if result.count else []),
            Row("wall time", effort),
        ]

    def _precision(self) -> Rows:
        """Return rows on the target and on the variance removed by a control variate."""
        result, until = self.result, self.result.until
        rows = [Row(f"precision {until}", _target_met(result))] if until else []
        saved = result.estimate("depth", -1, ()).variance_saved
        if saved is None:
            return rows
        text = f"removes {shown(saved, '%', 3)} of the variance of the mean depth"
        if saved < 1.0:
            text += f", equivalent to {count(result.count / (1.0 - saved))} realisations without"
        return [*rows, Row("control variate", text)]

    def details(self) -> list[Table]:
        """Return the estimates of all observables, and the Sobol indices of the depth."""
        return [self.observables_table(_HEADS[0]), self._effects()] if self.result.count else []

    def _effects(self) -> Table:
        """Return the Sobol indices of the depth."""
        result, head = self.result, "Sobol indices of the depth"
        if why := no_effects(result):
            return Table("", [[f"{head}: {why}"]], [""])
        effects = sorted(result.sensitivity("depth"), key=lambda item: item.without_effect)
        totals = any(item.total is not None for item in effects)
        return Table(
            "",
            [_effect(result, item, totals) for item in effects],
            [head, "first order", *(["total"] if totals else [])],
        )

    def data(self) -> dict[str, Any]:
        """Return the estimates in SI units."""
        result, raw = self.result, self.result.raw
        is_reached = None
        if result.until:
            target = Target.parse(result.until)
            is_reached = bool(result.count) and bool(target.reached(result.estimate_for(target)))
        return {
            "title": result.title,
            "model": raw.model,
            "stepper": raw.stepper,
            "plan": raw.plan,
            "seed": raw.seed,
            "requested": result.requested,
            "realisations": result.count,
            "failed": result.failed,
            "errors": dict(result.errors.items()),
            "finished": result.finished,
            "until": raw.until or None,
            "until_reached": is_reached,
            "total_passes": raw.total_passes,
            "total_time_s": raw.total_time,
            **{si_key(name): _estimate(result.estimate(name)) for name in result.observables},
            "sensitivity_of_depth": [
                {
                    "input": item.name,
                    "first_order": asdict(item.first),
                    "total": asdict(item.total) if item.total else None,
                    "without_effect": bool(item.without_effect),
                }
                for item in (result.sensitivity("depth") if result.count else [])
            ],
            "inputs": drawn_data(result),
            "random": varying_inputs(result, result.inputs),
            "record_passes": result.record_passes,
            **fatigue_data(result),
            "wall_seconds": raw.wall_seconds,
            **self.ending(),
        }

    def line(self) -> str:
        """Return the footer of the ensemble, with its sampling errors."""
        result, raw, error = self.result, self.result.raw, ""
        if result.count:
            depth = result.estimate("depth", -1, (0.95,))
            items = ("mean depth", depth.mean), ("its 95 % quantile", depth.quantiles[0][1])
            errors = (within(name, item.half_width, item.value) for name, item in items)
            error = f"{', '.join(errors)} (95 % intervals)"
        return footer(
            [
                result.described_model,
                raw.stepper,
                f"tolerance {raw.tolerance:g}",
                raw.plan,
                f"{count(result.count)} realisations",
            ],
            error,
            lapse(raw.wall_seconds),
        )

    def profile(self, angle: float | None = None) -> ComputedProfile:
        """Return the mean profile, with which measured ones are compared."""
        return self.result.worn_profile()

    def options(self) -> Sequence[str]:
        """Return the options of the command that repeats the ensemble."""
        raw = self.result.raw
        return [
            *("-n", str(self.result.requested), "--plan", raw.plan, "--seed", str(raw.seed)),
            *(["--precision", raw.until] if raw.until else []),
        ]


def observed(result: EnsembleResult) -> list[str]:
    """Return the names of the observables that are not zero in all realisations."""
    return [
        name for name in (result.observables if result.count else ()) if result.at_end(name).any()
    ]


def _lines(result: EnsembleResult, name: str) -> list[tuple[str, ...]]:
    """Return the estimates of an observable, and below them their intervals."""
    named, estimate = OBSERVABLES[name], result.estimate(name, -1, QUANTILES)
    items = [estimate.mean, estimate.std, *(interval for _, interval in estimate.quantiles)]
    texts, nothing = [cells(item, named.unit) for item in items], [NOTHING] * len(QUANTILES)
    if result.is_constant(name) and result.count > 1:
        return [(named.label, texts[0][0], CONSTANT, *nothing)]
    if named.unit == "deg":  # the mean of 359 and 1 deg is not 180 deg
        texts[:2] = [(NOTHING, "")] * 2
    values, intervals = zip(*texts, strict=True)
    if result.count == 1:
        return [(named.label, values[0], NOTHING, *nothing)]
    return [(named.label, *values), (INTERVAL, *intervals)]


def known_effects(result: EnsembleResult, name: str) -> list[Effect]:
    """Return the effects of the inputs on an observable, none if no index is known."""
    effects = [] if result.count < 2 else result.sensitivity(name)
    return effects if any(math.isfinite(item.first.value) for item in effects) else []


def no_effects(result: EnsembleResult) -> str:
    """Return why there are no Sobol indices of the depth, or an empty text."""
    if result.count > 1 and result.is_constant("depth"):
        return "none, the depth is equal in all realisations"
    return "" if known_effects(result, "depth") else too_few(result.fewest_for_indices())


def _effect(result: EnsembleResult, item: Effect, totals: bool) -> list[str]:
    """Return the Sobol indices of a random input as cells."""
    if not math.isfinite(item.first.value):
        return [item.name, too_few(result.fewest_for_indices([item.name])), *[""] * totals]
    indices = [index for index in (item.first, item.total) if index]
    if not item.without_effect:
        return [item.name, *map(part_with_interval, indices)]
    return [
        item.name,
        *(f"not significant, at most {shown(index.high, '%', 2)}" for index in indices),
    ]


def _target_met(result: EnsembleResult) -> str:
    """Return whether the target is reached, and the half-width of the interval."""
    target = Target.parse(result.until)
    estimate = result.estimate_for(target)
    interval, achieved = target.interval(estimate), target.achieved(estimate)
    is_reached, realisations = target.reached(estimate), f"{count(result.count)} realisations"
    word = "reached" if is_reached else "not reached"
    if not math.isfinite(interval.half_width) or math.isnan(interval.value):
        return f"{word}: {TOO_FEW_REALISATIONS}"
    if interval.half_width == 0.0:
        text = f"{word}: equal in all {realisations}"
    elif math.isinf(achieved):
        text = f"{word}: the estimate is 0, its relative half-width is undefined"
    else:
        text = f"{word}: within {shown(achieved, '%', 2)} with {realisations}"
    # the interval is narrow by chance in a small sample
    too_small = achieved <= target.width and not is_reached
    return f"{text}, but the sample is too small" if too_small else text


def _estimate(estimate: Estimate) -> dict[str, Any]:
    return {
        **asdict(estimate),
        "quantiles": [{"probability": p, **asdict(interval)} for p, interval in estimate.quantiles],
    }


def _realisations(raw: EnsembleData) -> Iterator[list[Column]]:
    """Yield drawn values and results of all realisations except pending ones, in blocks."""
    for start in range(0, raw.requested, _BLOCK):
        stop = min(start + _BLOCK, raw.requested)
        chosen = raw.status[start:stop] != PENDING
        yield [column._replace(values=column.values[chosen]) for column in _block(raw, start, stop)]


def _block(raw: EnsembleData, start: int, stop: int) -> Iterator[Column]:
    failed = raw.status[start:stop] == FAILED
    yield Column("realisation", np.arange(start, stop, dtype=np.float64))
    yield Column("failed", failed.astype(np.float64))
    for item in raw.inputs:
        key, values = item["key"], raw.rows(item["key"], start, stop)
        for number, column in enumerate(np.atleast_2d(values.T), 1):
            yield drawn(key if values.ndim == 1 else f"{key} roller {number}", column, item["unit"])
    for name in (*ALL_OBSERVABLES, *_SCALARS, *LIFE):
        if name in raw.schema.variables:
            values = raw.rows(name, start, stop)
            yield computed(
                name,
                np.where(failed, np.nan, values[:, -1] if values.ndim > 1 else values),
                raw.schema.variables[name].unit,
            )


def _courses(result: EnsembleResult) -> Iterator[Column]:
    """Yield the estimates of each observable at every record."""
    yield Column("passes", result.record_passes)
    yield computed("time", result.record_time, "s")
    for name in result.observables:
        course, unit = result.course(name), ALL_OBSERVABLES[name].unit
        columns = {
            "mean": course.mean,
            "mean low": course.mean_low,
            "mean high": course.mean_high,
            "std": course.std,
            **{f"{100.0 * p:g} %": values for p, values in course.quantiles.items()},
        }
        yield from (computed(f"{name} {end}", part, unit, name) for end, part in columns.items())


def _band(raw: EnsembleData, name: str, what: str, band: Band) -> list[Column]:
    """Return mean and band of a curve at the end, under the name of its quantity."""
    variables, parts = raw.schema.variables, ("mean", "std", "low", "high")
    axis, unit = variables[name].dims[-1], variables[name].unit
    return [
        computed(axis, band.y, variables[axis].unit),
        *(computed(f"{what} {part}", getattr(band, part), unit) for part in parts),
    ]
