"""View of a dissipation study: mean power with its interval, ranges, forces, realisations."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from wearsim.report.csv_files import drawn
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

    verb, sheet = "dissipation", "wearsim.studies.dissipation.panels:dissipation_sheet"

    def __init__(self, result: DissipationResult) -> None:
        super().__init__(result)
        number = number_of_realisations(result.count)
        self.question = f"How much power does one contact dissipate, in {number}?"

    def rows(self) -> Rows:
        """Return mean, ranges and standard deviation of the power, the mean first."""
        power = self.result.summaries["power"]
        rows = [Row("mean dissipated power", power.mean, "W", power.mean_interval.half_width)]
        rows.append(Row("inputs at their means", self.result.mean_problem_power, "W"))
        if power.count == 1 or power.is_constant:
            equal = "" if power.count == 1 else ", equal in all realisations"
            return [*rows, Row("dissipated power", shown(power.mean, "W") + equal)]
        for low, high in ((0.025, 0.975), (0.05, 0.95)):
            ends = [power.quantile(low), power.quantile(high)]
            values = " to ".join(in_unit(end.value, "W") for end in ends)
            # with the digits of the quantile, so that rounding does not put it outside its interval
            pairs = [(in_unit(end.low, "W"), in_unit(end.high, "W")) for end in ends]
            intervals = [
                TOO_FEW_REALISATIONS if NOTHING in pair else "..".join(pair) for pair in pairs
            ]
            confidence = " and ".join(dict.fromkeys(intervals))
            name = f"dissipated power, {100.0 * (high - low):g} %"
            rows.append(Row(name, f"{values} W (95 % confidence: {confidence})"))
        extremes = f"{in_unit(power.least, 'W')} to {shown(power.greatest, 'W')}"
        rows.append(Row("dissipated power, all", extremes))
        return [*rows, Row("standard deviation", power.std, "W")]

    def study(self) -> Rows:
        """Return rows on realisations, method and effort."""
        result, raw = self.result, self.result.raw
        done = count(result.count)
        design = [raw.plan, f"seed {raw.seed}"]
        if not result.finished:
            done, design = f"{done} of {count(raw.requested)}", [*design, "unfinished"]
        grid = [Row("friction sampled on", raw.friction_grid)] if raw.friction_grid else []
        effort = f"{lapse(raw.solve_seconds)} for the contacts, {lapse(raw.wall_seconds)} in total"
        return [
            Row("realisations", ", ".join([done, *design])),
            Row("contact model", result.described_model),
            Row("strips", f"{len(result.y)} of {shown(raw.strip_width, 'um')}"),
            *grid,
            Row("wall time", effort),
        ]

    def details(self) -> list[Table]:
        """Return the estimates of power, forces, moment and pressure."""
        return [Table("", [self._cells(name) for name in QUANTITIES], _HEADS)]

    def _cells(self, name: str) -> tuple[str, ...]:
        """Return mean, standard deviation, their intervals and skewness of a quantity."""
        result, (words, unit) = self.result, QUANTITIES[name]
        summary = result.summaries[name]
        force = float(abs(result.values("normal_force")).max())
        length = result.raw.strip_width * len(result.y)
        scale = {"force_x": force, "force_y": force, "spin_moment": force * length}
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
        varying = varying_rows(varying_inputs(self.result, None))
        return [*drawn_rows(self.result), *varying]

    def data(self) -> dict[str, Any]:
        """Return the estimates of the study in SI units."""
        result, raw = self.result, self.result.raw
        estimates = {
            f"{name}_{_SI[named.unit]}": raw.statistics[name] for name, named in QUANTITIES.items()
        }
        strips = {
            f"dissipation_{part}_W_per_m": result.values(f"dissipation_{part}")
            for part in ("mean", "std", "low", "high")
        }
        return {
            "title": result.title,
            "model": raw.model,
            "plan": raw.plan,
            "seed": raw.seed,
            "realisations": result.count,
            "requested": raw.requested,
            "finished": result.finished,
            "mean_problem_power_W": result.mean_problem_power,
            **estimates,
            "inputs": drawn_data(result),
            "random": varying_inputs(result, None),
            "friction_grid": raw.friction_grid or None,
            "strips": {"y_m": result.y, **strips},
            "solve_seconds": raw.solve_seconds,
            "wall_seconds": raw.wall_seconds,
            **self.ending(),
        }

    def line(self) -> str:
        """Return the footer of the study, with its sampling error."""
        result, power = self.result, self.result.summaries["power"]
        used = [result.described_model, f"{len(result.y)} strips", result.raw.plan]
        used.append(f"{count(result.count)} realisations")
        error = within("mean dissipated power", power.mean_interval.half_width, power.mean)
        return footer(used, f"{error} (95 % interval)", lapse(result.raw.wall_seconds))

    def columns(self) -> Mapping[str, Columns]:
        """Return realisations, drawn values first, and strips."""
        raw = self.result.raw
        numbers = Column("realisation", np.arange(self.result.count, dtype=np.float64))
        by_name = self._along("realisation")
        first = {item["key"]: by_name[item["key"]] for item in raw.inputs}
        realisations = [numbers, *(first | by_name).values()]
        return {"realisations.csv": [realisations], "strips.csv": [[*self._along("y").values()]]}

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
        columns = [
            (name, item.unit, self.result.values(name))
            for name, item in self.result.raw.schema.variables.items()
            if item.dims[0] == "realisation"
        ]
        return Frame(columns, "realisation", range(self.result.count))

    def options(self) -> Sequence[str]:
        """Return the options of the command that repeats the study."""
        raw = self.result.raw
        return ("-n", str(raw.requested), "--plan", raw.plan, "--seed", str(raw.seed))


def _ends(interval: Interval, unit: str) -> str:
    """Return the ends of an interval, if the sample suffices for them."""
    ends = [in_unit(end, unit) for end in (interval.low, interval.high)]
    enough = math.isfinite(interval.half_width) and interval.low < interval.high
    return " to ".join(ends) if enough else NOTHING
