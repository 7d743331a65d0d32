"""The figure of one contact: what happens inside its patch, and what each strip carries."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from wearsim.report.parts.patch_size import patch_edges, patches
from wearsim.report.parts.style import BLUE, ORANGE, PRESSURE, figure_style, name_axes
from wearsim.report.text.units import PER_SI, shown
from wearsim.types import ContactFields, ContactSolution, FloatArray

if TYPE_CHECKING:
    from wearsim.studies.contact.single import ContactStudy

MM, MPA, W_MM2 = PER_SI["mm"], PER_SI["MPa"], PER_SI["W/mm^2"]
N_MM, W_MM = PER_SI["N/mm"], PER_SI["W/mm"]
MAPS: list[Any] = [["pressure", "traction"], ["areas", "power"]]
STRIPS: list[Any] = ["line load", "dissipation"]
STICK, SLIDE = "#7fb2d9", "#f2c9a1"
Y_LABEL, X_LABEL = "y across [mm]", "x along rolling [mm]"


def contact_figure(study: ContactStudy, title: str) -> Figure:
    """Return the figure of a contact.

    Pressure, traction, adhesion and slip, and power density over the patch where the study holds
    the fields; line load and dissipation of the strips always.

    Parameters
    ----------
    study : ContactStudy
    title : str
        Written above the panels.

    Returns
    -------
    Figure
    """
    with figure_style():
        if study.fields is None:
            figure = Figure(figsize=(10.0, 3.4), layout="constrained")
            panels = figure.subplot_mosaic([STRIPS])
        else:
            figure = Figure(figsize=(10.0, 8.2), layout="constrained")
            panels = figure.subplot_mosaic([*MAPS, STRIPS], sharex=True)
            _draw_fields(panels, study.fields, study.solution)
        _draw_strips(panels, study.solution)
        figure.suptitle(f"{title}\n{_caption(study)}", fontsize=10.5)
    return figure


def _caption(study: ContactStudy) -> str:
    solution = study.solution
    return (
        f"{study.described_model}: {shown(study.point.normal_force, 'N')},"
        f" peak pressure {shown(solution.peak_pressure, 'MPa')},"
        f" power {shown(solution.power, 'W')}"
    )


def _draw_fields(panels: dict[str, Axes], fields: ContactFields, solution: ContactSolution) -> None:
    touching = np.flatnonzero(solution.half_length > 0.0)
    inside = slice(int(touching[0]), int(touching[-1]) + 1)
    y = np.broadcast_to(fields.y[inside], fields.x[:, inside].shape) * MM
    x = fields.x[:, inside] * MM
    traction = np.hypot(fields.traction_x, fields.traction_y)
    pressure = _pressure(fields, solution)[:, inside] * MPA
    _draw_map(panels["pressure"], y, x, pressure, "Pressure [MPa]")
    _draw_map(panels["traction"], y, x, traction[:, inside] * MPA, "Traction on cylinder [MPa]")
    _draw_arrows(
        panels["traction"], y, x, fields.traction_y[:, inside], fields.traction_x[:, inside]
    )
    _draw_areas(panels["areas"], y, x, fields.adhesion[:, inside].astype(float), solution)
    power = fields.power_density[:, inside] * W_MM2
    _draw_map(panels["power"], y, x, power, r"Power density [W/mm$^2$]")
    for row in MAPS:
        for name in row:
            ground = SLIDE if name == "areas" else "black"
            _draw_outline(panels[name], solution, ground)


def _pressure(fields: ContactFields, solution: ContactSolution) -> FloatArray:
    """Return the pressure; where a field is the parabola that bounds FASTSIM's tractions, Hertz's.

    The parabola carries the same line load with a peak 4/3 as high.
    """
    if fields.pressure.max() < 1.05 * solution.peak_pressure:
        return fields.pressure
    a = np.where(solution.half_length > 0.0, solution.half_length, 1.0)
    peak = 2.0 * solution.line_load / (np.pi * a)
    elliptic: FloatArray = peak * np.sqrt(np.maximum(0.0, 1.0 - (fields.x / a) ** 2))
    return elliptic


def _draw_map(axes: Axes, y: FloatArray, x: FloatArray, value: FloatArray, title: str) -> None:
    mesh = axes.pcolormesh(y, x, value, shading="gouraud", cmap=PRESSURE, vmin=0.0, rasterized=True)
    axes.figure.colorbar(mesh, ax=axes, pad=0.02, aspect=16)
    name_axes(axes, title, "", X_LABEL)


def _draw_arrows(
    axes: Axes, y: FloatArray, x: FloatArray, across: FloatArray, along: FloatArray
) -> None:
    """Draw the traction's direction and size on a coarse grid; the axes' scales differ."""
    rows = np.arange(y.shape[0])[_stride(y.shape[0], 8)]
    columns = np.arange(y.shape[1])[_stride(y.shape[1], 12)]
    pick = np.ix_(rows, columns)
    longest = float(np.hypot(across[pick], along[pick]).max(initial=0.0))
    if longest > 0.0:
        axes.quiver(
            y[pick], x[pick], across[pick], along[pick],
            color="white", scale=17.0 * longest, width=0.004, pivot="middle",
        )  # fmt: skip


def _draw_areas(
    axes: Axes, y: FloatArray, x: FloatArray, adhesion: FloatArray, solution: ContactSolution
) -> None:
    if min(y.shape) > 1:
        axes.contourf(y, x, adhesion, levels=[-0.5, 0.5, 1.5], colors=[SLIDE, STICK])
    part = solution.adhesion_fraction
    handles = [
        Patch(color=STICK, label=f"adhesion, {100.0 * part:.1f} % of the area"),
        Patch(color=SLIDE, label=f"slip, {100.0 * (1.0 - part):.1f} %"),
    ]
    axes.legend(handles=handles, loc="lower center", ncols=2)
    name_axes(axes, "Adhesion and slip", "", X_LABEL)


def _stride(length: int, wanted: int) -> slice:
    """Return about so many evenly spaced places, away from both ends."""
    step = max(length // wanted, 1)
    return slice((length - 1) % step // 2 + step // 2, None, step)


def _draw_outline(axes: Axes, solution: ContactSolution, ground: str) -> None:
    """Draw the edge of every patch, the leading one up, and fill what no strip's centre covers."""
    for strips in patches(solution.half_length):
        alone = np.zeros_like(solution.half_length)
        alone[strips] = solution.half_length[strips]
        edges = patch_edges(solution.y, alone)
        if edges is not None:
            _draw_edge(axes, solution.y[strips], solution.half_length[strips], edges, ground)
    greatest = float(solution.half_length.max()) * MM
    axes.set_ylim(-1.35 * greatest, 1.2 * greatest)
    axes.grid(visible=False)


def _draw_edge(
    axes: Axes, y: FloatArray, a: FloatArray, edges: tuple[float, float], ground: str
) -> None:
    """Draw the edge of one patch."""
    part = np.linspace(0.0, 1.0, 12)
    left, right = edges[0] + (y[0] - edges[0]) * part, y[-1] + (edges[1] - y[-1]) * part
    outline = np.concatenate([left, y, right]) * MM
    ends = np.sqrt(part)  # the square of a falls linearly
    height = np.concatenate([a[0] * ends, a, a[-1] * ends[::-1]]) * MM
    around = np.concatenate([outline, outline[::-1]]), np.concatenate([height, -height[::-1]])
    axes.fill(*around, color=ground, lw=0, zorder=0)
    axes.plot(*around, "k", lw=0.8)


def _draw_strips(panels: dict[str, Axes], solution: ContactSolution) -> None:
    """Draw line load and dissipation of the strips."""
    touching = np.flatnonzero(solution.half_length > 0.0)
    inside = slice(max(int(touching[0]) - 1, 0), int(touching[-1]) + 2)
    y = solution.y[inside] * MM
    load, power = panels["line load"], panels["dissipation"]
    load.plot(y, solution.line_load[inside] * N_MM, color=BLUE)
    name_axes(load, "Line load of the strips [N/mm]", Y_LABEL, "q(y)")
    power.plot(y, solution.dissipation[inside] * W_MM, color=ORANGE)
    name_axes(power, "Dissipation of the strips [W/mm]", Y_LABEL, r"$P_l$(y)")
    for axes in (load, power):
        axes.set_ylim(bottom=0.0)
