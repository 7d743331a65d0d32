"""View of a dissipation study: mean power with its interval, ranges, forces, and panels."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from wearsim.levelling import Measured
from wearsim.report.csv_files import drawn
from wearsim.report.panels import (
    BLACK,
    GREEN,
    GREY,
    HEADROOM,
    ORANGE,
    Axis,
    Band,
    Line,
    Panel,
    Sheet,
    Span,
    convergence,
    histogram,
    message,
    worn_limits,
)
from wearsim.report.text import (
    NOTHING,
    TOO_FEW_REALISATIONS,
    Named,
    count,
    footer,
    in_unit,
    lapse,
    number_of_realisations,
    shown,
    within,
)
from wearsim.report.view import Column, Columns, Frame, Row, Rows, Table
from wearsim.results.study_view import (
    CONSTANT,
    StudyView,
    drawn_data,
    drawn_rows,
    varying_inputs,
    varying_rows,
)
from wearsim.studies.dissipation.result import DissipationResult
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.estimation.moments import is_constant

QUANTITIES = {
    "power": Named("dissipated power", "W"),
    "force_x": Named("longitudinal force", "N"),
    "force_y": Named("lateral force", "N"),
    "spin_moment": Named("spin moment", "N mm"),
    "normal_force": Named("normal force", "N"),
    "peak_pressure": Named("peak pressure", "MPa"),
}
_SI = {"W": "W", "N": "N", "N mm": "N_m", "MPa": "Pa"}
_ROUNDING = 1e-12  # rounding errors of forces, relative to the normal force
_HEADS = ("", "mean", "95 % interval", "std", "95 % interval", "skewness")


class DissipationView(StudyView[DissipationResult]):
    """Mean dissipated power with its 95 % interval, ranges of the power, and forces.

    Panels: power per length with its band, density of the power, realisations, convergence. Files:
    realisations and strips; the table of pandas has the realisations.
    """

    verb = "dissipation"

    def __init__(self, result: DissipationResult) -> None:
        super().__init__(result)
        realisations = number_of_realisations(result.count)
        self.question = f"How much power does one contact dissipate, in {realisations}?"

    def rows(self) -> Rows:
        """Return mean, ranges and standard deviation of the power, the mean first."""
        power = self.result.summaries["power"]
        rows = [
            Row.answer(
                *("mean dissipated power", "mean_power", power.mean, "W"),
                power.mean_interval.half_width,
            ),
            Row("inputs at their means", self.result.mean_problem_power, "W"),
        ]
        if power.count == 1 or power.is_constant:
            equal = ", equal in all realisations" * (power.count > 1)
            return [*rows, Row("dissipated power", shown(power.mean, "W") + equal)]
        for low, high in ((0.025, 0.975), (0.05, 0.95)):
            ends = [power.quantile(low), power.quantile(high)]
            values = " to ".join(in_unit(end.value, "W") for end in ends)
            # with the digits of the quantile, so that rounding does not put it outside its interval
            pairs = [(in_unit(end.low, "W"), in_unit(end.high, "W")) for end in ends]
            intervals = (
                TOO_FEW_REALISATIONS if NOTHING in pair else "..".join(pair) for pair in pairs
            )
            text = f"{values} W (95 % confidence: {' and '.join(dict.fromkeys(intervals))})"
            rows.append(Row(f"dissipated power, {100.0 * (high - low):g} %", text))
        return [
            *rows,
            Row(
                "dissipated power, all",
                f"{in_unit(power.least, 'W')} to {shown(power.greatest, 'W')}",
            ),
            Row.answer("standard deviation", "std_power", power.std, "W"),
        ]

    def study(self) -> Rows:
        """Return rows on realisations, method and effort."""
        result, raw = self.result, self.result.raw
        requested, unfinished = (
            ("", "") if result.finished else (f" of {count(raw.requested)}", ", unfinished")
        )
        return [
            Row(
                "realisations",
                f"{count(result.count)}{requested}, {raw.plan}, seed {raw.seed}{unfinished}",
            ),
            Row("contact model", result.described_model),
            Row("strips", f"{len(result.y)} of {shown(raw.strip_width, 'um')}"),
            *([Row("friction sampled on", raw.friction_grid)] if raw.friction_grid else []),
            Row(
                "wall time",
                f"{lapse(raw.solve_seconds)} for the contacts, {lapse(raw.wall_seconds)} in total",
            ),
        ]

    def details(self) -> list[Table]:
        """Return the estimates of power, forces, moment and pressure."""
        return [Table("", [self._cells(name) for name in QUANTITIES], _HEADS)]

    def _cells(self, name: str) -> tuple[str, ...]:
        """Return mean, standard deviation, their intervals and skewness of a quantity."""
        result, (words, unit) = self.result, QUANTITIES[name]
        summary, width = result.summaries[name], result.raw.strip_width * len(result.y)
        force = float(abs(result.values("normal_force")).max())
        scale = {"force_x": force, "force_y": force, "spin_moment": force * width}
        rounding = _ROUNDING * scale.get(name, 0.0)
        mean = 0.0 if abs(summary.mean) <= rounding else summary.mean
        if is_constant(mean, summary.std, rounding):
            return (words, shown(mean, unit), NOTHING, CONSTANT, NOTHING, NOTHING)
        return (
            words,
            shown(mean, unit),
            _ends(summary.mean_interval, unit),
            shown(summary.std, unit),
            _ends(summary.std_interval, unit),
            shown(summary.skewness, "1", 3),
        )

    def random_inputs(self) -> Rows:
        """Return the draws of the random inputs, and those that vary over the contact."""
        return [*drawn_rows(self.result), *varying_rows(varying_inputs(self.result, None))]

    def data(self) -> dict[str, Any]:
        """Return the estimates of the study in SI units."""
        result, raw = self.result, self.result.raw
        return {
            "title": result.title,
            "model": raw.model,
            "plan": raw.plan,
            "seed": raw.seed,
            "realisations": result.count,
            "requested": raw.requested,
            "finished": result.finished,
            "mean_problem_power_W": result.mean_problem_power,
            **{
                f"{key}_{_SI[named.unit]}": raw.statistics[key] for key, named in QUANTITIES.items()
            },
            "inputs": drawn_data(result),
            "random": varying_inputs(result, None),
            "friction_grid": raw.friction_grid or None,
            "strips": {
                "y_m": result.y,
                **{
                    f"dissipation_{part}_W_per_m": result.values(f"dissipation_{part}")
                    for part in ("mean", "std", "low", "high")
                },
            },
            "solve_seconds": raw.solve_seconds,
            "wall_seconds": raw.wall_seconds,
            **self.ending(),
        }

    def line(self) -> str:
        """Return the footer of the study, with its sampling error."""
        result, power = self.result, self.result.summaries["power"]
        error = within("mean dissipated power", power.mean_interval.half_width, power.mean)
        return footer(
            [
                result.described_model,
                f"{len(result.y)} strips",
                result.raw.plan,
                f"{count(result.count)} realisations",
            ],
            f"{error} (95 % interval)",
            lapse(result.raw.wall_seconds),
        )

    def columns(self) -> Mapping[str, Columns]:
        """Return realisations, drawn values first, and strips."""
        by_name = self._along("realisation")
        drawn_first = {key: by_name[key] for key in self.result.inputs} | by_name
        return {
            "realisations.csv": [
                [
                    Column("realisation", np.arange(self.result.count, dtype=np.float64)),
                    *drawn_first.values(),
                ]
            ],
            "strips.csv": [[*self._along("y").values()]],
        }

    def _along(self, axis: str) -> dict[str, Column]:
        """Return the columns of the variables along one axis."""
        raw = self.result.raw
        return {
            name: drawn(name, raw.variables[name], variable.unit)
            for name, variable in raw.schema.variables.items()
            if variable.dims == (axis,)
        }

    def frame(self) -> Frame:
        """Return the realisations, one row each."""
        return Frame(
            [
                (name, item.unit, self.result.values(name))
                for name, item in self.result.raw.schema.variables.items()
                if item.dims[0] == "realisation"
            ],
            "realisation",
            range(self.result.count),
        )

    def options(self) -> Sequence[str]:
        """Return the options of the command that repeats the study."""
        raw = self.result.raw
        return ("-n", str(raw.requested), "--plan", raw.plan, "--seed", str(raw.seed))

    def panels(self, measured: Sequence[Measured] = ()) -> Sheet:
        """Return convergence of mean and deviation, density of the power, power per length."""
        result = self.result
        course, constant = result.convergence(), result.summaries["power"].is_constant
        panels = {
            "density": _density(result),
            "band": _band(result),
            "realisations": _realisations(result),
        }
        for name, title in (
            ("mean", "Mean dissipated power, with standard error"),
            ("std", "Standard deviation, with standard error"),
        ):
            value, error = getattr(course, name), getattr(course, f"{name}_error")
            if constant:  # a constant power has rounding errors only
                error = np.zeros_like(error)
                value = np.zeros_like(value) if name == "std" else value
            panels[name] = convergence(
                title, f"{name} of $P_d$", "W", course.count, value, value - error, value + error
            )
        return Sheet(
            f"{result.title}\n{_caption(result)}",
            panels,
            [["mean", "density", "realisations"], ["std", "density", "band"]],
            (13.0, 6.8),
            widths=[1.0, 1.15, 1.1],
        )


def _ends(interval: Interval, unit: str) -> str:
    """Return the ends of an interval, if the sample suffices for them."""
    enough = math.isfinite(interval.half_width) and interval.low < interval.high
    return f"{in_unit(interval.low, unit)} to {in_unit(interval.high, unit)}" if enough else NOTHING


MOST_LINES = 200
CLASSES = 30
_EQUAL = 1e-9  # relative difference of curves that are drawn as one


def _caption(result: DissipationResult) -> str:
    power, raw = result.summaries["power"], result.raw
    text = (
        f"{number_of_realisations(result.count)} ({raw.plan}, {result.described_model}"
        f"{'' if result.finished else ', unfinished'})\n"
        f"mean dissipated power {shown(power.mean, 'W')}"
    )
    if result.count == 1:
        return text
    if power.is_constant:
        return f"{text}, equal in all realisations"
    band = " to ".join(in_unit(power.quantile(p).value, "W", 3) for p in (0.025, 0.975))
    return f"{text}, std {shown(power.std, 'W')}, 95 % range {band} W"


def _density(result: DissipationResult) -> Panel:
    power, summary, title = result.power, result.summaries["power"], "Density of dissipated power"
    at_means = f"inputs at their means: {shown(result.mean_problem_power, 'W')}"
    if result.count == 1 or summary.is_constant:
        where = f"{shown(summary.mean, 'W')} in {number_of_realisations(result.count)}"
        return message(title, f"{where}: no density to draw", at_means)
    bars, edges = histogram(power, CLASSES)
    margin = 0.05 * (edges[-1] - edges[0])
    low, high = max(edges[0] - margin, 0.0), edges[-1] + margin  # the power is not negative
    across = np.linspace(low, high, 400)
    score = (across - summary.mean) / summary.std
    lines = (
        (summary.mean, BLACK, "-", f"mean: {shown(summary.mean, 'W')}"),
        (result.mean_problem_power, GREEN, "--", at_means),
        (summary.quantile(0.025).value, GREY, ":", "2.5 % and 97.5 % quantile"),
        (summary.quantile(0.975).value, GREY, ":", ""),
    )
    ends = f"from {shown(float(power.min()), 'W')} to {shown(float(power.max()), 'W')}"
    return Panel(
        title,
        Axis("$P_d$", "W", limits=(low, high)),
        Axis("probability density", "1/W", 1.0, limits=(0.0, None), margin=(0.0, HEADROOM)),
        [
            bars,
            Line(
                across,
                np.exp(-0.5 * score**2) / (summary.std * math.sqrt(math.tau)),
                colour=ORANGE,
                label="normal distribution, same mean and std",
            ),
            *(
                Span(place, colour=colour, dash=dash, label=label, reach=1.0 / (1.0 + HEADROOM))
                for place, colour, dash, label in lines
            ),
        ],
        f"{count(len(power))} realisations, {ends}.",
        legend="upper right",
    )


def _realisations(result: DissipationResult) -> Panel:
    kept = result.dissipation
    rows = kept[:MOST_LINES]
    title = number_of_realisations(len(rows))
    if len(kept) > 1 and float(np.ptp(kept, axis=0).max()) <= _EQUAL * float(kept.max()):
        rows, title = rows[:1], "equal in all"
    return Panel(
        f"Dissipated power per length, {title}",
        _across(result),
        Axis("$P_l$", "W/mm", limits=(0.0, None)),
        [Line(result.y, rows, width=0.6, alpha=float(np.clip(15.0 / len(rows), 0.12, 1.0)))],
        "Dissipated power across the track in single realisations.",
    )


def _across(result: DissipationResult) -> Axis:
    return Axis("y", "mm", limits=worn_limits(result.y, result.values("dissipation_high")))


def _band(result: DissipationResult) -> Panel:
    y, values = result.y, result.values
    return Panel(
        "Mean and 95 % range",
        _across(result),
        Axis("$P_l$", "W/mm", limits=(0.0, None), margin=(0.0, HEADROOM)),
        [
            Band(y, values("dissipation_low"), values("dissipation_high"), label="2.5 to 97.5 %"),
            Line(y, values("dissipation_mean"), colour=BLACK, label="mean"),
            Line(
                *(y, values("mean_problem_dissipation"), "--"),
                colour=GREEN,
                label="inputs at their means",
            ),
        ],
        "Dissipated power per length: mean over the realisations and their 95 % band.",
        legend="upper center",
        columns=3,
    )
