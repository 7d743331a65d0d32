"""View of a run: end state with estimated errors, panels, history and records."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from wearsim.levelling import ComputedProfile
from wearsim.report.csv_files import computed
from wearsim.report.text import (
    ROUNDING,
    count,
    footer,
    in_unit,
    lapse,
    limit_unit,
    percent,
    shown,
    simulated,
    with_error,
    with_unit,
    within,
)
from wearsim.report.view import Column, Columns, Frame, Overview, Row, Rows, width_row
from wearsim.results.study_view import StudyView, varying_inputs, varying_rows
from wearsim.studies.fatigue.observables import fatigue_scenario
from wearsim.studies.fatigue.view import (
    fatigue_data,
    fatigue_rows,
    with_sources,
)
from wearsim.studies.run.result import Result
from wearsim.studies.run.schema import ALL_VARIABLES, AXES
from wearsim.types import FloatArray
from wearsim.units import LONG, engineers_unit

NO_STEPPING_ERROR = "Every roller pass is solved: there is no stepping error."
_NOT_MODEL = (
    "The stated error is that of the steps and strips, and of the stations of a cam. It does not"
    " contain the errors of the contact model, of the wear law or of the inputs."
)

_RECORDS = {
    "cylinder_depth_profiles.csv": "cylinder_depth_profile",
    "roller_depth_profiles.csv": "roller_depth_profile",
    "line_load.csv": "line_load",
    "dissipation.csv": "dissipation",
    "cylinder_damage_profiles.csv": "cylinder_damage_profile",
    "roller_damage_profiles.csv": "roller_damage_profile",
}


def excluded_effects(has_fatigue: bool) -> list[str]:
    """Return the effects that are not modelled; fatigue is one unless it is computed."""
    effects = ["heating", "plastic flow", "load carried by a lubricant film"]
    return effects if has_fatigue else ["fatigue (pitting)", *effects]


class RunView(StudyView[Result]):
    """End state of a run with its estimated error.

    Panels: profiles, depth, dissipated power, normal force, peak pressure. Files: history and
    records; the table of pandas has the history.
    """

    verb, sheet = "run", "wearsim.studies.run.panels:run_sheet"
    body, unit, per_unit = "cylinder", "roller passes", 1.0  # of the length of a test
    excluded: tuple[str, ...] = ()  # besides `excluded_effects`

    def __init__(self, result: Result) -> None:
        super().__init__(result)
        raw = result.raw
        self.question = (
            f"How deep does the {self.body} wear in {count(raw.total_passes / self.per_unit)}"
            f" {self.unit} ({simulated(raw.total_passes / raw.kinematics['pass_rate'])})?"
        )
        self.heading = "end state" if result.finished else "current state"
        if result.failure:
            self.heading = "state before the failure"
        self._is_exact = result.stepper == "per-pass"  # every roller pass is solved
        self.basis = NO_STEPPING_ERROR if self._is_exact else _NOT_MODEL

    def standing(self) -> str:
        """Return the passes and the simulated time that the run has reached."""
        result = self.result
        passes, total = float(result.passes[-1]), float(result.raw.total_passes)
        time = simulated(float(result.time[-1]))
        if result.until:
            reached, error = count(passes), result.passes_error
            if error is not None and error > ROUNDING * passes:
                digits = max(math.floor(math.log10(error)), 0)  # those that the error leaves
                reached = f"{count(round(passes, -digits))} ± {in_unit(error, '1', 2)}"
                seconds, rate = np.array(result.time[-1]), result.raw.kinematics["pass_rate"]
                time = with_error(seconds, error / rate, "min" if seconds < LONG else "h")
            return f"stopped at {result.until}: pass {reached} of {count(total)}, {time}"
        if result.finished:
            return f"finished: {count(passes)} passes, {time}"
        reached = f"pass {count(passes)} of {count(total)} ({100.0 * passes / total:.1f} %), {time}"
        return f"{'failed after' if result.failure else 'unfinished:'} {reached}"

    def rows(self) -> Rows:
        """Return the observables at the end of the run, the depth with its error first."""
        result = self.result
        errors = {name: float(np.max(values[-1])) for name, values in result.errors.items()}
        errors["depth_below_nominal"] = result.depth_below_nominal_error
        of_both, total = self._of_both_bodies()
        energy = float(np.max(result.dissipated_energy[-1]))
        # wear by energy: the energy and the volume of each body have the same relative error
        if math.isclose(errors["dissipated_energy"] * total, of_both * energy):
            errors["worn_volume"] *= float(np.max(result.worn_volume[-1])) / (total or 1.0)

        def stated(label: str, name: str, unit: str) -> Row:
            values = np.asarray(getattr(result, name)[-1])
            return Row(
                label,
                with_error(values, errors.get(name), unit),
                answers={name: (float(np.max(values)), unit)},
            )

        started_worn, width = result.start_height.any(), result.width[-1]
        error = None if self._is_exact else float(np.max(result.depth_error[-1]))
        return [
            Row(
                "depth worn since the start" if started_worn else "depth",
                *(result.depth[-1], "um", error),
                {"depth": (float(np.max(result.depth[-1])), "um")},
            ),
            *(
                [stated("roller depth", "roller_depth", "um")]
                if np.any(np.asarray(result.roller_depth[-1]) > 0.0)
                else []
            ),
            *([stated("depth below nominal", "depth_below_nominal", "um")] if started_worn else []),
            *self.limit_rows(),
            stated("width", "width", "mm")
            if np.any(width)
            else width_row(width, result.raw.width_threshold),
            stated("worn volume", "worn_volume", "mm^3"),
            stated("dissipated energy", "dissipated_energy", "J"),
            stated("dissipated power", "power", "W"),
            stated("normal force", "normal_force", "N"),
            stated("peak pressure", "peak_pressure", "MPa"),
            stated("worn descent", "descent", "um"),
            stated("elastic approach", "elastic_approach", "um"),
            *self.along_angle(),
            *fatigue_rows(result, self.body),
            self._error_row(error),
        ]

    def _error_row(self, error: float | None) -> Row:
        """Return the row on the error of the depth [m], also relative to the greatest depth."""
        if error is None:
            return Row("error of depth", NO_STEPPING_ERROR)
        depth, whose = self._greatest_depth()
        part = f", {shown(error / depth, '%', 2)}{whose}" if depth > 0.0 else ""
        return Row("estimated error of depth", f"{shown(error, 'um', 2)}{part}")

    def _greatest_depth(self) -> tuple[float, str]:
        """Return the depth to which its error is related, and whose it is if not the cylinder's."""
        depth, roller = (
            float(np.max(values[-1])) for values in (self.result.depth, self.result.roller_depth)
        )
        return (roller, " of the roller depth") if roller > depth else (depth, "")

    def _of_both_bodies(self) -> tuple[float, float]:
        """Return the error of the volume worn off both bodies, and that volume [m^3]."""
        result, last = self.result, self.result.raw.history
        rollers = result.raw.static["multiplicity"] @ last["roller_worn_volume"][-1]
        return float(np.max(result.volume_error[-1])), float(
            np.max(last["worn_volume"][-1] + rollers)
        )

    def study(self) -> Rows:
        """Return rows on the test, its failure, and the effort of the computation."""
        result, raw = self.result, self.result.raw
        first, last = (count(float(result.record_passes[place])) for place in (0, -1))
        in_full = f", {count(_last(result.full_solves))} roller passes solved in full"
        return [
            Row("test", self.standing()),
            *(
                [Row("failure", result.failure), Row("failed at", raw.failed_at)]
                if result.failure
                else []
            ),
            Row("contact model", result.described_model),
            Row("stepper", f"{result.stepper}, tolerance {raw.tolerance:g}"),
            Row("seed", str(raw.seed)),
            Row("records", f"{len(result.record_passes)}, at passes {first} to {last}"),
            Row("strips", str(len(result.y))),
            Row("steps", f"{count(_last(result.steps))}, {count(_last(result.rejected))} rejected"),
            Row("contact solves", count(_last(result.solves)) + in_full * self._is_exact),
            Row("wall time", lapse(raw.wall_seconds)),
        ]

    def random_inputs(self) -> Rows:
        """Return drawn values, and inputs that vary in time."""
        drawn = self.result.raw.drawn
        rows = [Row("random inputs", "one realisation, not the means")] if drawn else []
        for key, item in drawn.items():
            unit, size = engineers_unit(item["unit"])
            text = " / ".join(f"{value / size:.6g}" for value in item["values"])
            rows.append(Row(f"drawn {key}", with_unit(text, unit)))
        return [*rows, *varying_rows(varying_inputs(self.result, drawn))]

    def data(self) -> dict[str, Any]:
        """Return the end state and the effort of the run in SI units."""
        result = self.result
        return {
            **result.final,
            "title": result.title,
            "model": result.model,
            "stepper": result.stepper,
            "tolerance": result.raw.tolerance,
            "strips": len(result.y),
            "finished": bool(result.finished),
            "until": result.until or None,
            "passes_error": result.passes_error,
            "failure": result.failure or None,
            "failed_at": result.raw.failed_at or None,
            "steps": _last(result.steps),
            "rejected": _last(result.rejected),
            "solves": _last(result.solves),
            "full_solves": _last(result.full_solves),
            "wall_seconds": result.raw.wall_seconds,
            "drawn": result.raw.drawn,
            "random": varying_inputs(result, result.raw.drawn),
            **self.ending(),
            "limits": result.limits,
            **fatigue_data(result),
        }

    def origin(self) -> dict[str, Any]:
        """Return length, records, scenario, files, plugins and software for JSON."""
        result = self.result
        return {
            "total_passes": result.raw.total_passes,
            "record_passes": result.record_passes,
            **super().origin(),
        }

    def line(self) -> str:
        """Return the footer of the run, with the estimated errors of its steps and strips."""
        result, error = self.result, "no stepping error"
        known = bool(np.isfinite(result.profile_error_by_strips[-1]).all())
        if known or not self._is_exact:
            depth, whose = self._greatest_depth()
            by_depth, parts = "", "steps"
            if known:
                shares = (
                    np.max(part[-1]) / depth if depth > 0.0 else 0.0
                    for part in (result.depth_error_by_steps, result.depth_error_by_strips)
                )
                by_depth = " (steps {}, strips {})".format(*map(percent, shares))
                parts = "steps and strips"
            volume = self._of_both_bodies()
            error = (
                f"{within('depth', np.max(result.depth_error[-1]), depth)}{whose}{by_depth},"
                f" {within('profile', np.max(result.profile_error[-1]), 1.0)},"
                f" {within('worn volume', *volume)} (estimated numerical error of the {parts},"
                " not of model or inputs)"
            )
        return footer(
            [
                result.described_model,
                f"{len(result.y)} strips",
                result.stepper,
                *([] if self._is_exact else [f"tolerance {result.raw.tolerance:g}"]),
            ],
            error,
            lapse(result.raw.wall_seconds),
        )

    def overview(self) -> Overview:
        """Return the worn body, its loads, and limits that are passed or not."""
        sheet, has_fatigue = self.panels(), bool(self.result.raw.fatigue)
        return Overview(
            sheet.panels.get("shape", sheet.first),
            {
                "Loads": self.loads(),
                "Limits": self.limit_rows(brief=True)
                or [Row("limits", "none in the scenario, table [limit]")],
                "Wear": self._rows_of("roller depth", "width", "lift error, peak to peak"),
            },
            [*excluded_effects(has_fatigue), "scatter of the inputs", *self.excluded],
        )

    def loads(self) -> Rows:
        """Return the loads of the overview."""
        return self._rows_of("normal force", "peak pressure")

    def _rows_of(self, *labels: str) -> Rows:
        return [row for row in self.rows() if row.label in labels]

    def profile(self, angle: float | None = None) -> ComputedProfile:
        """Return the worn profile with which measured ones are compared, of a cam at an angle."""
        return self.result.worn_profile(angle)

    def columns(self) -> Mapping[str, Columns]:
        """Return history and records."""
        raw, scenario = self.result.raw, fatigue_scenario(self.result)
        history = (
            column
            for name, variable in raw.schema.variables.items()
            if variable.kind == "history"
            for column in _columns(name, raw.history[name], variable.dims, name, self.angles())
        )
        return {
            "history.csv": [with_sources(history, scenario)],
            **{
                file: [with_sources(self._records(name), scenario)]
                for file, name in _RECORDS.items()
                if name in raw.records
                and (not name.startswith("roller") or raw.records[name].any())
            },
        }

    def angles(self) -> Sequence[str]:
        """Return the angles of the stations of a cam in words; none of a cylinder."""
        return ()

    def along_angle(self) -> Rows:
        """Return rows on angles and lift error of a cam; none of a cylinder."""
        return []

    def _records(self, name: str) -> Iterator[Column]:
        """Yield y, and a column for every record and contact."""
        raw = self.result.raw
        yield from _columns("y", raw.static["y"], ("y",), "y")
        dims, angles = ("y", *ALL_VARIABLES[name].dims[1:-1]), self.angles()
        quantity = {"depth_profile": "depth", "damage_profile": "damage"}.get(
            name.partition("_")[2], name
        )
        for passes, array in zip(raw.records["record_passes"], raw.records[name], strict=True):
            yield from _columns(
                name, np.moveaxis(array, -1, 0), dims, f"{quantity} at {passes:.12g} passes", angles
            )

    def frame(self) -> Frame:
        """Return the history, one row for each step."""
        result = self.result
        return Frame(
            [
                (name, item.unit, result.values(name))
                for name, item in result.raw.schema.variables.items()
                if item.kind == "history"
            ],
            "step",
            range(len(result.passes)),
        )

    def limit_rows(self, *, brief: bool = False) -> Rows:
        """Return a row for each limit of [limit]: reached or not, when, and by how much.

        Parameters
        ----------
        brief : bool
            Whether the rows say that limits are passed or failed, and leave out by how much.
        """
        return [self._limit_row(item, brief) for item in self.result.limits]

    def _limit_row(self, item: Mapping[str, Any], brief: bool) -> Row:
        """Return the row of a limit, of `Result.limits`; `brief` as of `limit_rows`."""
        unit, name = limit_unit(item["quantity"]), item["quantity"].replace("_", " ")
        side = "above" if item["excess"] >= 0.0 else "below"
        by = "" if brief else f", {abs(100.0 * item['excess']):.3g} % {side}"
        end = f"{in_unit(item['at_end'], unit)} of {shown(item['limit'], unit)} at the end{by}"
        text = "passed" if brief else "not reached"
        if item["reached"]:
            passes = item["reached_at_passes"]
            when = f"{count(round(passes / self.per_unit))} {self.unit.split()[-1]}"
            time = simulated(passes / self.result.raw.kinematics["pass_rate"])
            text = f"{'failed' if brief else 'reached'} after about {when}, {time}"
        return Row(name if brief else f"limit of {name}", f"{text}: {end}")

    def options(self) -> Sequence[str]:
        """Return the options of the command that repeats the run."""
        until = self.result.raw.until
        return ("--until", until) if until else ()


def _columns(
    name: str, array: FloatArray, dims: Sequence[str], title: str, angles: Sequence[str] = ()
) -> Iterator[Column]:
    """Yield the columns of an array with rows along the first axis, the others in the titles."""
    for index in np.ndindex(array.shape[1:]):
        labels = [
            angles[number] if dim == "station" and angles else f"{dim} {number + AXES[dim].first}"
            for dim, number, length in zip(dims[1:], index, array.shape[1:], strict=True)
            if length > 1
        ]
        yield computed(
            " ".join([title, *labels]), array[(slice(None), *index)], ALL_VARIABLES[name].unit, name
        )


def _last(value: Any) -> int:
    """Return the last value of a history, or the number itself."""
    return int(np.ravel(value)[-1])
