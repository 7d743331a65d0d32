"""View of one contact: forces, patch and power, fields and strips, with a reference model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from wearsim.evolution.observables import greatest_between
from wearsim.levelling import Measured
from wearsim.report.panels import (
    BLACK,
    BLUE,
    ORANGE,
    Arrows,
    Axis,
    Contours,
    Image,
    Line,
    Mark,
    Panel,
    Patch,
    Sheet,
)
from wearsim.report.text import NOTHING, brief, footer, lapse, percent, shown
from wearsim.report.view import Frame, Row, Rows, Table, View
from wearsim.studies.contact.outline import patch_edges, patch_outlines
from wearsim.studies.contact.single import ContactStudy
from wearsim.types import ContactFields, ContactSolution, FloatArray, IntArray

_OF_EDGE = 0.25  # error of an edge of the patch, in strips
_DIGITS = 10  # after the point, of a fraction; beyond them is rounding
_DIFFERENCES = {
    "dissipation": "P_l(y), L2 over the strips",
    "greatest": "P_l(y), greatest over its maximum",
    "power": "dissipated power",
    "peak_pressure": "peak pressure",
    "half_length": "greatest half-length",
    "adhesion_fraction": "adhesion fraction, in points",
}


class ContactView(View):
    """Patch, peak pressure, forces and dissipated power of one contact.

    Panels: line load and dissipated power per length; with fields also pressure, traction, adhesion
    and power density. The table of pandas has the strips.
    """

    question = "Which load and which power does one contact have along the track?"

    def __init__(self, study: ContactStudy) -> None:
        super().__init__(study)
        self.start: dict[str, str] = {}  # description of a measured profile
        self.edges = patch_edges(study.solution.y, study.solution.half_length)

    @property
    def _width(self) -> float:
        """Width of the patch across the track [m]."""
        return float(self.edges[1] - self.edges[0]) if self.edges else 0.0

    @property
    def _width_error(self) -> float:
        """Estimated error of the width [m]: each edge is known to a part of a strip."""
        return 2.0 * _OF_EDGE * self.result.grid.spacing if self.edges else 0.0

    @property
    def _length(self) -> tuple[float, float | None]:
        """Greatest length of the patch along rolling, and its estimated error if known [m]."""
        study, half_length = self.result, self.result.solution.half_length
        greatest = float(half_length.max())
        if study.grid_error is None:
            return 2.0 * greatest, None
        # the relative error is that of the pressure; between the strips lies a parabola
        between = float(greatest_between(half_length)) - greatest
        return 2.0 * greatest, 2.0 * (between + (study.pressure_error or 0.0) * greatest)

    def rows(self) -> Rows:
        """Return the numbers of the contact."""
        study, point, solution = self.result, self.result.point, self.result.solution
        rounding = 1e-12 * point.normal_force * study.grid.spacing * study.grid.strips
        moment = solution.spin_moment if abs(solution.spin_moment) > rounding else 0.0
        pressure, power = solution.peak_pressure, solution.power
        length, length_error = self._length
        return [
            *(Row(*pair) for pair in self.start.items()),
            Row("contact model", study.described_model),
            Row("strips", f"{study.grid.strips} of {shown(study.grid.spacing, 'um')}"),
            Row("normal force", point.normal_force, "N"),
            Row("rolling speed", point.rolling_speed, "m/s"),
            Row("friction coefficient", float(np.mean(point.friction))),
            Row("longitudinal creepage", solution.longitudinal_creepage),
            Row("lateral creepage", point.creepage.lateral),
            Row("spin", f"{shown(point.creepage.spin, '1')} 1/m" if point.creepage.spin else "0"),
            Row.answer("patch length 2a", "patch_length", length, "mm", length_error),
            Row.answer("patch width", "patch_width", self._width, "mm", self._width_error)
            if self.edges
            else Row("patch width", NOTHING, answers={"patch_width": (0.0, "mm")}),
            Row.answer(
                "peak pressure",
                "peak_pressure",
                pressure,
                "MPa",
                _times(study.pressure_error, pressure),
            ),
            Row.answer("approach", "approach", solution.approach, "um"),
            Row.answer("longitudinal force", "force_x", solution.force_x, "N"),
            Row.answer("lateral force", "force_y", solution.force_y, "N"),
            Row.answer("spin moment", "spin_moment", moment, "N mm"),
            Row.answer("dissipated power", "power", power, "W", _times(study.grid_error, power)),
            Row("adhesion fraction", round(solution.adhesion_fraction, _DIGITS), "%"),
        ]

    def tables(self) -> list[Table]:
        """Return the differences from a reference, each with the reference's own error."""
        reference, errors = self.result.reference, self.result.errors
        if reference is None or errors is None:
            return []
        rows = []
        for name, error in vars(errors).items():
            sign = "" if name in {"dissipation", "greatest"} else "+" if error >= 0.0 else "-"
            text = f"{sign}{shown(abs(round(error, _DIGITS)), '%', 2)}"
            theirs = shown(round(getattr(reference.own, name), _DIGITS), "%", 2)
            rows.append(Row(_DIFFERENCES[name], f"{text}, its own error {theirs}"))
        return [
            Table(
                f"difference from '{reference.model}'",
                [*rows, Row("time of the reference", lapse(reference.seconds))],
            )
        ]

    def data(self) -> dict[str, Any]:
        """Return the contact and its strips in SI units."""
        study, point, solution = self.result, self.result.point, self.result.solution
        return {
            "title": self.title,
            "model": study.model,
            "described_model": study.described_model,
            "normal_force_N": point.normal_force,
            "rolling_speed_m_per_s": point.rolling_speed,
            "friction": point.friction,
            "longitudinal_creepage": solution.longitudinal_creepage,
            "lateral_creepage": point.creepage.lateral,
            "spin_per_m": point.creepage.spin,
            "patch_length_m": self._length[0],
            "patch_length_error_m": self._length[1],
            "patch_width_m": self._width,
            "patch_width_error_m": self._width_error,
            "peak_pressure_Pa": solution.peak_pressure,
            "approach_m": solution.approach,
            "force_x_N": solution.force_x,
            "force_y_N": solution.force_y,
            "spin_moment_N_m": solution.spin_moment,
            "power_W": solution.power,
            "adhesion_fraction": solution.adhesion_fraction,
            "iterations": solution.iterations,
            "power_error_W": _times(study.grid_error, solution.power),
            "peak_pressure_error_Pa": _times(study.pressure_error, solution.peak_pressure),
            "solve_seconds": study.seconds,
            "strips": {
                "y_m": solution.y,
                "half_length_m": solution.half_length,
                "line_load_N_per_m": solution.line_load,
                "dissipation_W_per_m": solution.dissipation,
            },
            "against": self._reference(),
            "notes": self.notes,
            "warnings": self.warnings,
        }

    def _reference(self) -> dict[str, Any] | None:
        """Return the reference in SI units, the differences from it and its own errors."""
        reference, errors = self.result.reference, self.result.errors
        if reference is None or errors is None:
            return None
        return {
            "model": reference.model,
            "errors": vars(errors),
            "own_errors": vars(reference.own),
            "power_W": reference.power,
            "peak_pressure_Pa": reference.peak_pressure,
            "half_length_m": reference.half_length,
            "adhesion_fraction": reference.adhesion_fraction,
            "seconds": reference.seconds,
            "strips": {
                "y_m": reference.y,
                "line_load_N_per_m": reference.line_load,
                "dissipation_W_per_m": reference.dissipation,
            },
        }

    def line(self) -> str:
        """Return the footer of the contact, with the error estimated from a grid half as fine."""
        study, source = self.result, "(estimated numerical error of the grid)"
        error = study.grid_error
        return footer(
            [study.described_model, f"{study.grid.strips} strips"],
            "" if error is None else f"dissipated power within {percent(error)} {source}",
            NOTHING if study.seconds is None else brief(study.seconds),
        )

    def frame(self) -> Frame:
        """Return the strips, one row each."""
        solution = self.result.solution
        units = {"y": "m", "half_length": "m", "line_load": "N/m", "dissipation": "W/m"}
        return Frame(
            [(name, unit, getattr(solution, name)) for name, unit in units.items()],
            "strip",
            range(len(solution.y)),
        )

    def panels(self, measured: Sequence[Measured] = ()) -> Sheet:
        """Return the fields, if there are any, line load and dissipated power per length."""
        study = self.result
        fields = {} if study.fields is None else _fields(study.fields, study.solution)
        return Sheet(
            f"{study.title}\n{study.described_model}\n"
            f"normal force {shown(study.point.normal_force, 'N')},"
            f" peak pressure {shown(study.solution.peak_pressure, 'MPa')},"
            f" dissipated power {shown(study.solution.power, 'W')}",
            fields | _strips(study),
            [
                *([["pressure", "traction"], ["areas", "power"]] if fields else []),
                ["line load", "dissipation"],
            ],
            (10.0, 8.2 if fields else 3.4),
        )


def _times(error: float | None, value: float) -> float | None:
    """Return an error from a relative one, if there is any."""
    return None if error is None else error * value


STICK, SLIDE = "#7fb2d9", "#f2c9a1"
Y = Axis("y", "mm")


def _fields(fields: ContactFields, solution: ContactSolution) -> dict[str, Panel]:
    inside = _touching(solution.half_length)
    x = fields.x[:, inside]
    y = np.broadcast_to(fields.y[inside], x.shape)
    traction_x, traction_y = fields.traction_x[:, inside], fields.traction_y[:, inside]
    greatest = float(solution.half_length.max())
    along = Axis("x (rolling direction)", "mm", limits=(-1.35 * greatest, 1.2 * greatest))
    outlines = patch_outlines(solution.y, solution.half_length)
    ground = [Patch(*outline, colour=BLACK) for outline in outlines]
    edges = [Line(*outline, colour=BLACK, width=0.8) for outline in outlines]

    def panel(title: str, text: str, *marks: Mark) -> Panel:
        return Panel(title, Y, along, [*ground, *marks, *edges], text)

    pick = np.ix_(_spread_out(y.shape[0], 8), _spread_out(y.shape[1], 12))
    percent = 100.0 * solution.adhesion_fraction
    labels = {
        STICK: f"adhesion, {percent:.1f} % of the area",
        SLIDE: f"slip, {100.0 - percent:.1f} %",
    }
    adhesion = y, x, fields.adhesion[:, inside].astype(float)
    areas: list[Mark] = [
        *(Patch(*outline, colour=SLIDE) for outline in outlines),
        *([Contours(*adhesion, (-0.5, 0.5, 1.5), (SLIDE, STICK))] if min(y.shape) > 1 else []),
        *(
            Patch(np.full(3, y[0, 0]), np.zeros(3), colour=colour, label=label)
            for colour, label in labels.items()
        ),
    ]
    return {
        "pressure": panel(
            "Pressure",
            "Normal pressure over the patch.",
            Image(y, x, _pressure(fields, solution)[:, inside], Axis("pressure", "MPa")),
        ),
        "traction": panel(
            "Traction on the cylinder",
            "Size and direction of the traction on the cylinder.",
            Image(y, x, np.hypot(traction_x, traction_y), Axis("traction", "MPa")),
            Arrows(y[pick], x[pick], traction_y[pick], traction_x[pick], colour="white"),
        ),
        "areas": Panel(
            "Adhesion and slip",
            Y,
            along,
            [*areas, *edges],
            f"The surfaces adhere on {percent:.1f} % of the area.",
            legend="lower center",
            columns=2,
        ),
        "power": panel(
            "Dissipated power density",
            "Dissipated power per area.",
            Image(y, x, fields.power_density[:, inside], Axis("power density", "W/mm^2")),
        ),
    }


def _pressure(fields: ContactFields, solution: ContactSolution) -> FloatArray:
    """Return the pressure field; replace FASTSIM's parabolic traction bound by Hertz's ellipse.

    The parabola has the same line load and 4/3 of the peak pressure.
    """
    if fields.pressure.max() < 1.05 * solution.peak_pressure:
        return fields.pressure
    a = np.where(solution.half_length > 0.0, solution.half_length, 1.0)
    peak = 2.0 * solution.line_load / (np.pi * a)
    return np.asarray(peak * np.sqrt(np.maximum(0.0, 1.0 - (fields.x / a) ** 2)))


def _spread_out(length: int, wanted: int) -> IntArray:
    """Return evenly spaced indices, about as many as wanted, that keep away from both ends."""
    step = max(length // wanted, 1)
    return np.arange((length - 1) % step // 2 + step // 2, length, step)


def _strips(study: ContactStudy) -> dict[str, Panel]:
    """Return line load and dissipated power per length, also of a reference."""
    solution, reference, errors = study.solution, study.reference, study.errors
    inside = _touching(solution.line_load, 1)
    panels = {}
    for name, key, unit, colour, title, label in (
        ("line load", "line_load", "N/mm", BLUE, "Line load", "q"),
        (
            "dissipation", "dissipation", "W/mm", ORANGE,
            "Dissipated power per length", "$P_l$",
        ),
    ):  # fmt: skip
        values: FloatArray = getattr(solution, key)
        marks, top = [Line(solution.y[inside], values[inside], colour=colour)], None
        if reference is not None and errors is not None:
            theirs, near = getattr(reference, key), _touching(reference.line_load, 1)
            curve, text = (reference.y[near], theirs[near]), reference.model
            if key == "dissipation":
                text += f"; difference {shown(errors.dissipation, '%', 2)} (L2)"
            marks.append(Line(*curve, "--", width=1.0, colour=BLACK, label=text))
            top = 1.25 * 1.05 * max(float(values.max()), float(theirs.max()))
        panels[name] = Panel(
            title,
            Y,
            Axis(label, unit, limits=(0.0, top)),
            marks,
            f"{title} across the track.",
            legend="upper center",
        )
    return panels


def _touching(values: FloatArray, beyond: int = 0) -> slice:
    """Return the range of strips in contact, where values are positive, and some at both ends."""
    first, last = np.flatnonzero(values > 0.0)[[0, -1]].tolist()
    return slice(max(first - beyond, 0), last + 1 + beyond)
