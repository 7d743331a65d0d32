"""Figure of one contact: fields over the patch, line load and dissipated power of the strips."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from wearsim.report.parts import (
    BLUE,
    ORANGE,
    PRESSURE,
    name_axes,
    patch_edges,
    patches,
    titled_figure,
)
from wearsim.report.text import PER_SI, shown
from wearsim.studies.contact.single import ContactStudy
from wearsim.types import ContactFields, ContactSolution, FloatArray, IntArray

MM, MPA, W_MM2 = PER_SI["mm"], PER_SI["MPa"], PER_SI["W/mm^2"]
N_MM, W_MM = PER_SI["N/mm"], PER_SI["W/mm"]
MAPS: list[Any] = [["pressure", "traction"], ["areas", "power"]]
STRIPS: list[Any] = ["line load", "dissipation"]
STICK, SLIDE = "#7fb2d9", "#f2c9a1"
Y_LABEL, X_LABEL = "y [mm]", "x (rolling direction) [mm]"


def contact_figure(study: ContactStudy, title: str) -> Figure:
    """Return the figure of a contact.

    It shows pressure, traction, adhesion, slip and power density over the patch if the study has
    fields, and always line load and dissipated power per length.

    Parameters
    ----------
    study : ContactStudy
    title : str
        Title of the figure.

    Returns
    -------
    Figure
    """
    caption = (
        f"{title}\n{study.described_model}\nnormal force {shown(study.point.normal_force, 'N')},"
        f" peak pressure {shown(study.solution.peak_pressure, 'MPa')},"
        f" dissipated power {shown(study.solution.power, 'W')}"
    )
    maps = [] if study.fields is None else MAPS
    with titled_figure(10.0, 8.2 if maps else 3.4, caption) as figure:
        panels = figure.subplot_mosaic([*maps, STRIPS], sharex=bool(maps))
        if study.fields is not None:
            _draw_fields(panels, study.fields, study.solution)
        _draw_strips(panels, study.solution)
    return figure


def _draw_fields(panels: dict[str, Axes], fields: ContactFields, solution: ContactSolution) -> None:
    touching = np.flatnonzero(solution.half_length > 0.0)
    inside = slice(int(touching[0]), int(touching[-1]) + 1)
    y = np.broadcast_to(fields.y[inside], fields.x[:, inside].shape) * MM
    x = fields.x[:, inside] * MM
    for name, value, title in (
        ("pressure", _pressure(fields, solution) * MPA, "Pressure [MPa]"),
        (
            "traction",
            np.hypot(fields.traction_x, fields.traction_y) * MPA,
            "Traction on the cylinder [MPa]",
        ),
        ("power", fields.power_density * W_MM2, r"Dissipated power density [W/mm$^2$]"),
    ):
        axes = panels[name]
        mesh = axes.pcolormesh(
            y, x, value[:, inside], shading="gouraud", cmap=PRESSURE, vmin=0.0, rasterized=True
        )
        axes.figure.colorbar(mesh, ax=axes, pad=0.02, aspect=16)
        name_axes(axes, title, "", X_LABEL)
    _draw_arrows(
        panels["traction"], y, x, fields.traction_y[:, inside], fields.traction_x[:, inside]
    )
    _draw_areas(panels["areas"], y, x, fields.adhesion[:, inside].astype(float), solution)
    for name in [name for row in MAPS for name in row]:
        _draw_outlines(panels[name], solution, SLIDE if name == "areas" else "black")


def _pressure(fields: ContactFields, solution: ContactSolution) -> FloatArray:
    """Return the pressure field; replace FASTSIM's parabolic traction bound by Hertz's ellipse.

    The parabola has the same line load and 4/3 of the peak pressure.
    """
    if fields.pressure.max() < 1.05 * solution.peak_pressure:
        return fields.pressure
    a = np.where(solution.half_length > 0.0, solution.half_length, 1.0)
    peak = 2.0 * solution.line_load / (np.pi * a)
    elliptic: FloatArray = peak * np.sqrt(np.maximum(0.0, 1.0 - (fields.x / a) ** 2))
    return elliptic


def _draw_arrows(
    axes: Axes, y: FloatArray, x: FloatArray, across: FloatArray, along: FloatArray
) -> None:
    """Draw the traction vectors on a coarse grid, in the scales of both axes."""
    pick = np.ix_(_spread_out(y.shape[0], 8), _spread_out(y.shape[1], 12))
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
    percent = 100.0 * solution.adhesion_fraction
    handles = [
        Patch(color=STICK, label=f"adhesion, {percent:.1f} % of the area"),
        Patch(color=SLIDE, label=f"slip, {100.0 - percent:.1f} %"),
    ]
    axes.legend(handles=handles, loc="lower center", ncols=2)
    name_axes(axes, "Adhesion and slip", "", X_LABEL)


def _spread_out(length: int, wanted: int) -> IntArray:
    """Return evenly spaced indices, about as many as wanted, that keep away from both ends."""
    step = max(length // wanted, 1)
    return np.arange((length - 1) % step // 2 + step // 2, length, step)


def _draw_outlines(axes: Axes, solution: ContactSolution, background: str) -> None:
    """Draw the outline of each patch and fill it, up to the edges beyond the centres of strips."""
    for strips in patches(solution.half_length):
        y, a = solution.y[strips], solution.half_length[strips]
        patch = np.zeros_like(solution.half_length)
        patch[strips] = a
        edges = patch_edges(solution.y, patch)
        assert edges is not None
        part = np.linspace(0.0, 1.0, 12)
        left, right = edges[0] + (y[0] - edges[0]) * part, y[-1] + (edges[1] - y[-1]) * part
        across = np.concatenate([left, y, right]) * MM
        ends = np.sqrt(part)  # the square of the half-length is linear there
        height = np.concatenate([a[0] * ends, a, a[-1] * ends[::-1]]) * MM
        outline = np.concatenate([across, across[::-1]]), np.concatenate([height, -height[::-1]])
        axes.fill(*outline, color=background, lw=0, zorder=0)
        axes.plot(*outline, "k", lw=0.8)
    greatest = float(solution.half_length.max()) * MM
    axes.set_ylim(-1.35 * greatest, 1.2 * greatest)
    axes.grid(visible=False)


def _draw_strips(panels: dict[str, Axes], solution: ContactSolution) -> None:
    """Draw line load and dissipated power per length."""
    touching = np.flatnonzero(solution.half_length > 0.0)
    inside = slice(max(int(touching[0]) - 1, 0), int(touching[-1]) + 2)
    y = solution.y[inside] * MM
    for name, value, colour, title, label in (
        ("line load", solution.line_load * N_MM, BLUE, "Line load [N/mm]", "q(y)"),
        (
            "dissipation", solution.dissipation * W_MM, ORANGE,
            "Dissipated power per length [W/mm]", r"$P_l$(y)",
        ),
    ):  # fmt: skip
        panels[name].plot(y, value[inside], color=colour)
        name_axes(panels[name], title, Y_LABEL, label)
        panels[name].set_ylim(bottom=0.0)
