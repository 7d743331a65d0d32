"""View of a run: end state with estimated errors, panels, history and records."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.errors import WearsimError
from wearsim.levelling import ComputedProfile
from wearsim.report.csv_files import computed
from wearsim.report.surfaces import Sampling, Surface
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
from wearsim.studies.fatigue.view import (
    EXCLUDED as NO_FATIGUE,
    fatigue_data,
    fatigue_rows,
    fatigue_scenario,
    with_sources,
)
from wearsim.studies.run.result import Result
from wearsim.studies.run.schema import ALL_VARIABLES, AXES
from wearsim.types import FloatArray
from wearsim.units import LONG, engineers_unit

NO_STEPPING_ERROR = "Every roller pass is solved: there is no stepping error."
_NOT_MODEL = (
    "The stated error is that of the steps in time. It does not contain the errors of the contact"
    " model, of the wear law or of the inputs."
)

if TYPE_CHECKING:
    from wearsim.report.animation import Animation

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
    """End state of a run with its estimated error, of a cam also angles and lift error.

    Panels: profiles, depth, dissipated power, normal force, peak pressure; of a cam also the map
    of the depth, the worn shape and the lift error. Files: history and records; the table of pandas
    has the history.
    """

    verb, sheet = "run", "wearsim.studies.run.panels:run_sheet"

    def __init__(self, result: Result) -> None:
        super().__init__(result)
        raw, is_exact = result.raw, result.stepper == "per-pass"
        body, length = "cylinder", f"{count(raw.total_passes)} roller passes"
        if result.is_cam:
            turns = raw.total_passes / raw.kinematics["physical_rollers"]
            body, length = "cam", f"{count(turns)} turns"
        time = simulated(raw.total_passes / raw.kinematics["pass_rate"])
        self.question = f"How deep does the {body} wear in {length} ({time})?"
        self.heading = "end state" if result.finished else "current state"
        if result.failure:
            self.heading = "state before the failure"
        self.has_angles = result.is_cam
        if result.is_cam:
            self.sheet = "wearsim.studies.cam.panels:cam_run_sheet"
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
            below = Row("depth below nominal", result.depth_below_nominal[-1], "um")
            rows = [rows[0]._replace(label="depth worn since the start"), below]
        if np.any(np.asarray(result.roller_depth[-1]) > 0.0):
            rows.insert(1, stated("roller depth", "roller_depth", "um"))
        width = width_row(result.width[-1], result.raw.width_threshold)
        width = stated("width", "width", "mm") if np.any(result.width[-1]) else width
        rows += [
            *limit_rows(result),
            width,
            stated("worn volume", "worn_volume", "mm^3"),
            stated("dissipated energy", "dissipated_energy", "J"),
            stated("dissipated power", "power", "W"),
            stated("normal force", "normal_force", "N"),
            stated("peak pressure", "peak_pressure", "MPa"),
            stated("worn descent", "descent", "um"),
            stated("elastic approach", "elastic_approach", "um"),
            *self._of_cam(),
            *fatigue_rows(result),
        ]
        if error is None:
            return [*rows, Row("error of depth", NO_STEPPING_ERROR)]
        # the error refers to the greatest depth on either body
        depth = float(max(np.max(result.depth[-1]), np.max(result.roller_depth[-1])))
        part = f", {shown(error / depth, '%', 2)}" if depth > 0.0 else ""
        return [*rows, Row("estimated error of depth", f"{shown(error, 'um', 2)}{part}")]

    def _of_cam(self) -> Rows:
        """Return rows on angles and lift error of a cam; none of a cylinder."""
        final = self.result.final
        if "turns" not in final:
            return []

        def stated(name: str, unit: str, key: str) -> str:
            error = final[f"{name}_error_{key}"]
            return with_error(np.asarray(final[f"{name}_{key}"]), float(np.max(error)), unit)

        arm, greatest = self._arm_length(), float(np.max(final["lift_error_m"]))
        of_arm = f", {shown(greatest / arm, 'deg', 3)} of the arm" if arm else ""
        return [
            Row("turns of the cam", count(float(np.max(final["turns"])))),
            Row("angle of the depth", stated("depth_angle", "deg", "rad")),
            Row("angle of the peak pressure", stated("peak_pressure_angle", "deg", "rad")),
            Row(
                "lift error, peak to peak",
                stated("lift_error", "um", "m") + of_arm,
                answers={"lift_error": (greatest, "um")},
            ),
            Row("least wear of the lift", f"at {stated('least_wear_angle', 'deg', 'rad')}"),
            Row("greatest wear of the lift", f"at {stated('greatest_wear_angle', 'deg', 'rad')}"),
        ]

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
            **self._of_arm(),
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

    def _of_arm(self) -> dict[str, Any]:
        """Return the lift error of an arm as an angle [rad]; nothing of another follower."""
        final, arm = self.result.final, self._arm_length()
        if not arm or "lift_error_m" not in final:
            return {}
        names = ("lift_error", "station_lift_error", "station_lift_error_from_dwell")
        return {f"{name}_rad": (np.asarray(final[f"{name}_m"]) / arm).tolist() for name in names}

    def origin(self) -> dict[str, Any]:
        """Return length, records, scenario, files, plugins and software for JSON."""
        result = self.result
        length = {"total_passes": result.raw.total_passes, "record_passes": result.record_passes}
        return {**length, **super().origin()}

    def line(self) -> str:
        """Return the footer of the run, with the estimated errors of its steps and strips."""
        result = self.result
        used = [result.described_model, f"{len(result.y)} strips", result.stepper]
        error = "no stepping error"
        known = bool(np.isfinite(result.profile_error_by_strips[-1]).all())
        if result.stepper != "per-pass":
            used.append(f"tolerance {result.raw.tolerance:g}")
        if result.stepper != "per-pass" or known:
            depth = max(np.max(result.depth[-1]), np.max(result.roller_depth[-1]))
            volume = np.max(result.worn_volume[-1])
            text, parts = within("depth", np.max(result.depth_error[-1]), depth), "steps"
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
        return footer(used, error, lapse(result.raw.wall_seconds))

    def overview(self) -> Overview:
        """Return the worn body, its loads, and limits that are passed or not."""
        result, excluded = self.result, [*EXCLUDED, "scatter of the inputs"]
        if result.raw.fatigue:
            excluded.remove(NO_FATIGUE)
        sheet = self.panels()
        if result.is_cam:
            from wearsim.studies.cam.view import CAM_EXCLUDED, loads  # noqa: PLC0415

            load_rows, main = loads(result.scenario), sheet.panels["shape"]
            excluded += CAM_EXCLUDED
        else:
            named = {row.label: row for row in self.rows()}
            load_rows = [named[name] for name in ("normal force", "peak pressure")]
            main = sheet.first
        limits = limit_rows(result, brief=True)
        limits = limits or [Row("limits", "none in the scenario, table [limit]")]
        shown_rows = [row for row in self.rows()[1:] if row.label in _IN_OVERVIEW]
        groups = {"Loads": load_rows, "Limits": limits, "Wear": shown_rows}
        return Overview(main, groups, excluded)

    def profile(self, angle: float | None = None) -> ComputedProfile:
        """Return the worn profile with which measured ones are compared, of a cam at an angle."""
        return self.result.worn_profile(angle)

    def columns(self) -> Mapping[str, Columns]:
        """Return history, records, and of a cam its worn surface."""
        raw = self.result.raw
        history = [
            column
            for name, variable in raw.schema.variables.items()
            if variable.kind == "history"
            for column in _columns(name, raw.history[name], variable.dims, name, self._angles())
        ]
        scenario = fatigue_scenario(self.result)
        tables: dict[str, Columns] = {"history.csv": [with_sources(history, scenario)]}
        for file, name in _RECORDS.items():
            always = not name.startswith("roller") and name in raw.records
            if always or (name in raw.records and raw.records[name].any()):
                tables[file] = [with_sources(self._records(name), scenario)]
        surface = self.surface(Sampling())
        if surface is not None:
            tables["worn_cam.csv"] = [surface.columns]
            tables["along_angle.csv"] = [list(self._along_angle())]
        return tables

    def _angles(self) -> Sequence[str]:
        """Return the angles of the stations of a cam in words; none of a cylinder.

        Where a part of the turn ends, another begins at the same angle.
        """
        if not self.result.is_cam:
            return ()
        degrees = [f"{angle:.6g} deg" for angle in np.degrees(self.result.values("station_angle"))]
        following = [*degrees[1:], ""]
        return [
            f"before {this_angle}" if this_angle == next_angle else f"at {this_angle}"
            for this_angle, next_angle in zip(degrees, following, strict=True)
        ]

    def _along_angle(self) -> Iterator[Column]:
        """Yield angle, depth and lift error of a cam at every record, of an arm also its angle."""
        from wearsim.studies.cam.grooves import along_angle  # noqa: PLC0415  (not of a cylinder)
        from wearsim.studies.cam.observables import CURVE_ANGLES  # noqa: PLC0415

        depth, lift_error = along_angle(self.result)
        yield computed("angle", CURVE_ANGLES, "rad")
        quantities = {"depth": (depth, "m"), "lift error": (lift_error, "m")}
        if lever := self._arm_length():
            quantities["lift error of the arm"] = lift_error / lever, "rad"
        for name, (values, unit) in quantities.items():
            for passes, column in zip(self.result.record_passes, values.T, strict=True):
                yield computed(f"{name} at {passes:.12g} passes", column, unit)

    def _arm_length(self) -> float | None:
        """Return the length of a cam's arm [m]; None of another follower."""
        try:
            cam = self.result.scenario.cam
        except WearsimError:  # a plugin of the scenario is not installed
            return None
        return cam.follower.arm_length if cam is not None and cam.follower.swings else None

    def surface(self, sampling: Sampling) -> Surface | None:
        """Return the surface of a cam, unworn and worn; None for a cylinder."""
        if not self.result.is_cam:
            return None
        from wearsim.studies.cam.surface import worn_surface  # noqa: PLC0415  (not of a cylinder)

        return worn_surface(self.result, sampling)

    def animation(self) -> Animation | None:
        """Return the turn of a worn cam with its follower; None for a cylinder."""
        if not self.result.is_cam:
            return None
        from wearsim.studies.cam.drawing import turning  # noqa: PLC0415  (not of a cylinder)

        return turning(self.result)

    def _records(self, name: str) -> Iterator[Column]:
        """Yield y, and a column for every record and contact."""
        raw = self.result.raw
        yield from _columns("y", raw.static["y"], ("y",), "y")
        dims = ("y", *ALL_VARIABLES[name].dims[1:-1])
        angles = self._angles()
        quantity = {"depth_profile": "depth", "damage_profile": "damage"}.get(
            name.partition("_")[2], name
        )
        for passes, array in zip(raw.records["record_passes"], raw.records[name], strict=True):
            title = f"{quantity} at {passes:.12g} passes"
            yield from _columns(name, np.moveaxis(array, -1, 0), dims, title, angles)

    def frame(self) -> Frame:
        """Return the history, one row for each step."""
        result = self.result
        columns = [
            (name, item.unit, result.values(name))
            for name, item in result.raw.schema.variables.items()
            if item.kind == "history"
        ]
        return Frame(columns, "step", range(len(result.passes)))

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


def limit_rows(result: Result, *, brief: bool = False) -> Rows:
    """Return a row for each limit of [limit]: reached or not, when, and by how much.

    Parameters
    ----------
    result : Result
    brief : bool
        Whether the rows say that limits are passed or failed, and leave out by how much.
    """
    rows = list[Row]()
    for item in result.limits:
        unit, name = limit_unit(item["quantity"]), item["quantity"].replace("_", " ")
        side = "above" if item["excess"] >= 0.0 else "below"
        by = "" if brief else f", {abs(100.0 * item['excess']):.3g} % {side}"
        end = f"{in_unit(item['at_end'], unit)} of {shown(item['limit'], unit)} at the end{by}"
        words = ("failed", "passed") if brief else ("reached", "not reached")
        text = words[1]
        if item["reached"]:
            passes = item["reached_at_passes"]
            when = f"{count(round(passes))} passes"
            if result.is_cam:
                when = f"{count(round(passes / result.raw.kinematics['physical_rollers']))} turns"
            time = simulated(passes / result.raw.kinematics["pass_rate"])
            text = f"{words[0]} after about {when}, {time}"
        rows.append(Row(name if brief else f"limit of {name}", f"{text}: {end}"))
    return rows
