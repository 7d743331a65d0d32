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
    within,
)
from wearsim.report.view import Column, Columns, Frame, Overview, Row, Rows, width_row
from wearsim.results.study_view import StudyView, varying_inputs, varying_rows
from wearsim.studies.fatigue.observables import fatigue_scenario
from wearsim.studies.fatigue.view import (
    EXCLUDED as NO_FATIGUE,
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

_IN_OVERVIEW = {"roller depth", "width", "lift error, peak to peak"}
#: what wear tests do not contain
EXCLUDED = (NO_FATIGUE, "heating", "plastic flow", "load carried by a lubricant film")
_RECORDS = {
    "cylinder_depth_profiles.csv": "cylinder_depth_profile",
    "roller_depth_profiles.csv": "roller_depth_profile",
    "line_load.csv": "line_load",
    "dissipation.csv": "dissipation",
    "cylinder_damage_profiles.csv": "cylinder_damage_profile",
    "roller_damage_profiles.csv": "roller_damage_profile",
}


class RunView(StudyView[Result]):
    """End state of a run with its estimated error.

    Panels: profiles, depth, dissipated power, normal force, peak pressure. Files: history and
    records; the table of pandas has the history.
    """

    verb, sheet = "run", "wearsim.studies.run.panels:run_sheet"
    body, unit, per_unit = "cylinder", "roller passes", 1.0  # of the length of a test
    excluded: tuple[str, ...] = ()  # besides `EXCLUDED`

    def __init__(self, result: Result) -> None:
        super().__init__(result)
        raw, is_exact = result.raw, result.stepper == "per-pass"
        length = f"{count(raw.total_passes / self.per_unit)} {self.unit}"
        time = simulated(raw.total_passes / raw.kinematics["pass_rate"])
        self.question = f"How deep does the {self.body} wear in {length} ({time})?"
        self.heading = "end state" if result.finished else "current state"
        if result.failure:
            self.heading = "state before the failure"
        self.basis = NO_STEPPING_ERROR if is_exact else _NOT_MODEL

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
        part = f"{100.0 * passes / total:.1f} %"
        word = "failed after" if result.failure else "unfinished:"
        return f"{word} pass {count(passes)} of {count(total)} ({part}), {time}"

    def rows(self) -> Rows:
        """Return the observables at the end of the run, the depth with its error first."""
        result, is_exact = self.result, self.result.stepper == "per-pass"
        errors = {name: float(np.max(values[-1])) for name, values in result.errors.items()}

        def stated(label: str, name: str, unit: str) -> Row:
            values = np.asarray(getattr(result, name)[-1])
            answers = {name: (float(np.max(values)), unit)}
            return Row(label, with_error(values, errors.get(name), unit), answers=answers)

        error = None if is_exact else float(np.max(result.depth_error[-1]))
        answers = {"depth": (float(np.max(result.depth[-1])), "um")}
        rows = [Row("depth", result.depth[-1], "um", error, answers)]
        if result.start_height.any():
            errors["depth_below_nominal"] = result.depth_below_nominal_error
            below = stated("depth below nominal", "depth_below_nominal", "um")
            rows = [rows[0]._replace(label="depth worn since the start"), below]
        if np.any(np.asarray(result.roller_depth[-1]) > 0.0):
            rows.insert(1, stated("roller depth", "roller_depth", "um"))
        rows += [
            *self.limit_rows(),
            stated("width", "width", "mm")
            if np.any(result.width[-1])
            else width_row(result.width[-1], result.raw.width_threshold),
            stated("worn volume", "worn_volume", "mm^3"),
            stated("dissipated energy", "dissipated_energy", "J"),
            stated("dissipated power", "power", "W"),
            stated("normal force", "normal_force", "N"),
            stated("peak pressure", "peak_pressure", "MPa"),
            stated("worn descent", "descent", "um"),
            stated("elastic approach", "elastic_approach", "um"),
            *self.along_angle(),
            *fatigue_rows(result, self.body),
        ]
        if error is None:
            return [*rows, Row("error of depth", NO_STEPPING_ERROR)]
        depth, whose = self._greatest_depth()
        part = f", {shown(error / depth, '%', 2)}{whose}" if depth > 0.0 else ""
        return [*rows, Row("estimated error of depth", f"{shown(error, 'um', 2)}{part}")]

    def _greatest_depth(self) -> tuple[float, str]:
        """Return the depth to which its error is related, and whose it is if not the cylinder's."""
        depth, roller = (
            float(np.max(values[-1])) for values in (self.result.depth, self.result.roller_depth)
        )
        return (roller, " of the roller depth") if roller > depth else (depth, "")

    def study(self) -> Rows:
        """Return rows on the test, its failure, and the effort of the computation."""
        result, solves = self.result, count(_last(self.result.solves))
        first, last = (count(float(result.record_passes[place])) for place in (0, -1))
        failure = [Row("failure", result.failure), Row("failed at", result.raw.failed_at)]
        if result.stepper == "per-pass":
            solves += f", {count(_last(result.full_solves))} roller passes solved in full"
        return [
            Row("test", self.standing()),
            *(failure if result.failure else []),
            Row("contact model", result.described_model),
            Row("stepper", f"{result.stepper}, tolerance {result.raw.tolerance:g}"),
            Row("seed", str(result.raw.seed)),
            Row("records", f"{len(result.record_passes)}, at passes {first} to {last}"),
            Row("strips", str(len(result.y))),
            Row("steps", f"{count(_last(result.steps))}, {count(_last(result.rejected))} rejected"),
            Row("contact solves", solves),
            Row("wall time", lapse(result.raw.wall_seconds)),
        ]

    def random_inputs(self) -> Rows:
        """Return drawn values, and inputs that vary in time."""
        drawn = self.result.raw.drawn
        rows = [Row("random inputs", "one realisation, not the means")] if drawn else []
        for key, item in drawn.items():
            unit, size = engineers_unit(item["unit"])
            text = " / ".join(f"{value / size:.6g}" for value in item["values"])
            rows.append(Row(f"drawn {key}", text if unit == "1" else f"{text} {unit}"))
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
        result = self.result
        error, has_steps = "no stepping error", result.stepper != "per-pass"
        known = bool(np.isfinite(result.profile_error_by_strips[-1]).all())
        if has_steps or known:
            depth, whose = self._greatest_depth()
            volume = np.max(result.worn_volume[-1])
            text, parts = within("depth", np.max(result.depth_error[-1]), depth) + whose, "steps"
            if known:
                parts = "steps and strips"
                by = (
                    np.max(part[-1])
                    for part in (result.depth_error_by_steps, result.depth_error_by_strips)
                )
                steps, strips = (percent(part / depth if depth > 0.0 else 0.0) for part in by)
                text += f" (steps {steps}, strips {strips})"
            volume_text = within("worn volume", np.max(result.volume_error[-1]), volume)
            profile = within("profile", np.max(result.profile_error[-1]), 1.0)
            error = (
                f"{text}, {profile}, {volume_text} (estimated numerical error of the {parts}, not"
                " of model or inputs)"
            )
        return footer(
            [
                result.described_model,
                f"{len(result.y)} strips",
                result.stepper,
                *([f"tolerance {result.raw.tolerance:g}"] if has_steps else []),
            ],
            error,
            lapse(result.raw.wall_seconds),
        )

    def overview(self) -> Overview:
        """Return the worn body, its loads, and limits that are passed or not."""
        excluded = [*EXCLUDED, "scatter of the inputs", *self.excluded]
        if self.result.raw.fatigue:
            excluded.remove(NO_FATIGUE)
        sheet = self.panels()
        limits = self.limit_rows(brief=True)
        limits = limits or [Row("limits", "none in the scenario, table [limit]")]
        shown_rows = [row for row in self.rows()[1:] if row.label in _IN_OVERVIEW]
        return Overview(
            sheet.panels.get("shape", sheet.first),
            {"Loads": self.loads(), "Limits": limits, "Wear": shown_rows},
            excluded,
        )

    def loads(self) -> Rows:
        """Return the loads of the overview."""
        named = {row.label: row for row in self.rows()}
        return [named[name] for name in ("normal force", "peak pressure")]

    def profile(self, angle: float | None = None) -> ComputedProfile:
        """Return the worn profile with which measured ones are compared, of a cam at an angle."""
        return self.result.worn_profile(angle)

    def columns(self) -> Mapping[str, Columns]:
        """Return history and records."""
        raw = self.result.raw
        history = [
            column
            for name, variable in raw.schema.variables.items()
            if variable.kind == "history"
            for column in _columns(name, raw.history[name], variable.dims, name, self.angles())
        ]
        scenario = fatigue_scenario(self.result)
        tables: dict[str, Columns] = {"history.csv": [with_sources(history, scenario)]}
        for file, name in _RECORDS.items():
            always = not name.startswith("roller") and name in raw.records
            if always or (name in raw.records and raw.records[name].any()):
                tables[file] = [with_sources(self._records(name), scenario)]
        return tables

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
        dims = ("y", *ALL_VARIABLES[name].dims[1:-1])
        angles = self.angles()
        quantity = {"depth_profile": "depth", "damage_profile": "damage"}.get(
            name.partition("_")[2], name
        )
        for passes, array in zip(raw.records["record_passes"], raw.records[name], strict=True):
            title = f"{quantity} at {passes:.12g} passes"
            yield from _columns(name, np.moveaxis(array, -1, 0), dims, title, angles)

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
        rows = list[Row]()
        for item in self.result.limits:
            unit, name = limit_unit(item["quantity"]), item["quantity"].replace("_", " ")
            side = "above" if item["excess"] >= 0.0 else "below"
            by = "" if brief else f", {abs(100.0 * item['excess']):.3g} % {side}"
            end = f"{in_unit(item['at_end'], unit)} of {shown(item['limit'], unit)} at the end{by}"
            words = ("failed", "passed") if brief else ("reached", "not reached")
            text = words[1]
            if item["reached"]:
                passes = item["reached_at_passes"]
                when = f"{count(round(passes / self.per_unit))} {self.unit.split()[-1]}"
                time = simulated(passes / self.result.raw.kinematics["pass_rate"])
                text = f"{words[0]} after about {when}, {time}"
            rows.append(Row(name if brief else f"limit of {name}", f"{text}: {end}"))
        return rows

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
        values = array[(slice(None), *index)]
        yield computed(" ".join([title, *labels]), values, ALL_VARIABLES[name].unit, name)


def _last(value: Any) -> int:
    """Return the last value of a history, or the number itself."""
    return int(np.ravel(value)[-1])
