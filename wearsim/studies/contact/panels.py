"""Panels of one contact: fields over the patch, line load and dissipated power per length."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

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
from wearsim.report.text import shown
from wearsim.studies.contact.outline import patch_outlines
from wearsim.studies.contact.single import ContactStudy
from wearsim.types import ContactFields, ContactSolution, FloatArray, IntArray

STICK, SLIDE = "#7fb2d9", "#f2c9a1"
Y = Axis("y", "mm")


def contact_sheet(study: ContactStudy, measured: Sequence[Measured] = ()) -> Sheet:
    """Return the panels of a contact: fields if it has any, and always those over the strips."""
    title = (
        f"{study.title}\n{study.described_model}\n"
        f"normal force {shown(study.point.normal_force, 'N')},"
        f" peak pressure {shown(study.solution.peak_pressure, 'MPa')},"
        f" dissipated power {shown(study.solution.power, 'W')}"
    )
    panels = {} if study.fields is None else _fields(study.fields, study.solution)
    rows = [["pressure", "traction"], ["areas", "power"]] if panels else []
    panels |= _strips(study)
    rows.append(["line load", "dissipation"])
    return Sheet(title, panels, rows, (10.0, 8.2 if study.fields is not None else 3.4))


def _fields(fields: ContactFields, solution: ContactSolution) -> dict[str, Panel]:
    touching = np.flatnonzero(solution.half_length > 0.0)
    inside = slice(int(touching[0]), int(touching[-1]) + 1)
    x = fields.x[:, inside]
    y = np.broadcast_to(fields.y[inside], x.shape)
    traction_x, traction_y = fields.traction_x[:, inside], fields.traction_y[:, inside]
    greatest = float(solution.half_length.max())
    along = Axis("x (rolling direction)", "mm", limits=(-1.35 * greatest, 1.2 * greatest))
    across = Axis("y", "mm", limits=(None, None))
    outlines = patch_outlines(solution.y, solution.half_length)
    ground = [Patch(*outline, colour=BLACK) for outline in outlines]
    edges = [Line(*outline, colour=BLACK, width=0.8) for outline in outlines]

    def panel(title: str, text: str, *marks: Mark) -> Panel:
        return Panel(title, across, along, [*ground, *marks, *edges], text)

    pick = np.ix_(_spread_out(y.shape[0], 8), _spread_out(y.shape[1], 12))
    arrows = Arrows(y[pick], x[pick], traction_y[pick], traction_x[pick], colour="white")
    percent = 100.0 * solution.adhesion_fraction
    areas: list[Mark] = [Patch(*outline, colour=SLIDE) for outline in outlines]
    if min(y.shape) > 1:
        adhesion = fields.adhesion[:, inside].astype(float)
        areas.append(Contours(y, x, adhesion, (-0.5, 0.5, 1.5), (SLIDE, STICK)))
    for colour, label in (
        (STICK, f"adhesion, {percent:.1f} % of the area"),
        (SLIDE, f"slip, {100.0 - percent:.1f} %"),
    ):
        areas.append(Patch(np.full(3, y[0, 0]), np.zeros(3), colour=colour, label=label))
    pressure = _pressure(fields, solution)[:, inside]
    return {
        "pressure": panel(
            "Pressure",
            "Normal pressure over the patch.",
            Image(y, x, pressure, Axis("pressure", "MPa")),
        ),
        "traction": panel(
            "Traction on the cylinder",
            "Size and direction of the traction on the cylinder.",
            Image(y, x, np.hypot(traction_x, traction_y), Axis("traction", "MPa")),
            arrows,
        ),
        "areas": Panel(
            "Adhesion and slip",
            across,
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
    inside = _touching(solution.line_load)
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
            theirs: FloatArray = getattr(reference, key)
            near = _touching(reference.line_load)
            text = reference.model
            if key == "dissipation":
                text += f"; difference {shown(errors.dissipation, '%', 2)} (L2)"
            curve = reference.y[near], theirs[near]
            marks.append(Line(*curve, dash="--", width=1.0, colour=BLACK, label=text))
            top = 1.25 * 1.05 * max(float(values.max()), float(theirs.max()))
        y, caption = Axis(label, unit, limits=(0.0, top)), f"{title} across the track."
        panels[name] = Panel(title, Y, y, marks, caption, legend="upper center")
    return panels


def _touching(line_load: FloatArray) -> slice:
    """Return the range of strips in contact, with one more at both ends."""
    first, last = np.flatnonzero(line_load > 0.0)[[0, -1]].tolist()
    return slice(max(first - 1, 0), last + 2)
