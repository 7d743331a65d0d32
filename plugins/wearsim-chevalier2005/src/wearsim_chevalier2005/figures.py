"""Figures of the paper, drawn from the computed results with the printed numbers marked.

This module draws the mean problem and the contact with white friction.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from wearsim.report.figures import figure_style, name_axes
from wearsim.report.panels import BLUE, GREEN, GREY, ORANGE, PRESSURE, RED
from wearsim.report.text import PER_SI, count, shown
from wearsim.studies.contact.view import SLIDE, STICK
from wearsim.types import FloatArray
from wearsim_chevalier2005 import figure_panels as spread, paper

if TYPE_CHECKING:
    from wearsim.studies.contact.single import ContactStudy
    from wearsim_chevalier2005.study import Reproduction

MM, MPA, W_MM, W_MM2 = (PER_SI[unit] for unit in ("mm", "MPa", "W/mm", "W/mm^2"))
SIZE = (16.0, 20.0)
PANELS: list[Any] = [
    ["7a", "7b", "7c", "8a"],
    ["8b", "9a", "9b", "11a"],
    ["11b", "12a", "12b", "13"],
    ["14 mean", "14 std", "15a", "15b"],
    ["16", "17a", "17b", "notes"],
]
_X, _Y = "x along rolling [mm]", "y across [mm]"


def reproduction_figure(results: Reproduction) -> Figure:
    """Return figures 7 to 9 and 11 to 17 of the paper, with a panel for each part of a figure."""
    with figure_style():
        layout = ConstrainedLayoutEngine(hspace=0.035, wspace=0.03)
        figure = Figure(figsize=SIZE, layout=layout)
        panels = figure.subplot_mosaic(PANELS)
        _draw_mean_problem(panels, results.mean)
        _draw_white_friction(panels, results.mean, results.white_friction)
        spread.draw_inputs(panels, results)
        spread.draw_convergence(panels, results)
        spread.draw_powers(panels, results)
        spread.draw_rows(panels, results)
        _write_notes(panels["notes"], results)
        figure.suptitle("Figures of the paper, computed here", fontsize=14.0)
        figure.supxlabel(paper.REFERENCE, fontsize=9.0, color=GREY)
    return figure


def _draw_mean_problem(panels: dict[str, Axes], study: ContactStudy) -> None:
    fields = study.fields
    assert fields is not None
    _draw_areas(panels["7a"], study)
    name_axes(panels["7a"], "Fig. 7a: elements in adhesion and slip", "y/b", "x/a")
    _draw_map(panels["7b"], study, -fields.traction_x * MPA)
    name_axes(panels["7b"], r"Fig. 7b: traction $\tau_x$ on the roller [MPa]", _Y, _X)
    _draw_map(panels["7c"], study, fields.slip_x * study.point.rolling_speed * MM)
    name_axes(panels["7c"], "Fig. 7c: slip $w_x$ [mm/s]", _Y, _X)
    _draw_map(panels["8a"], study, fields.power_density * W_MM2)
    name_axes(panels["8a"], r"Fig. 8a: dissipated power [W/mm$^2$]", _Y, _X)
    for name in ("7b", "7c", "8a"):
        _draw_printed_ellipse(panels[name])
    _draw_strips(panels["8b"], study, BLUE, f"{shown(study.solution.power, 'W')} in total")
    panels["8b"].legend(loc="lower center")
    name_axes(panels["8b"], r"Fig. 8b: power per axial length $P_l$(y)", _Y, r"$P_l$ [W/mm]")


def _draw_areas(axes: Axes, study: ContactStudy) -> None:
    """Draw the elements in adhesion and slip, on axes scaled to a circle."""
    fields, a, b = study.fields, *_half_axes(study)
    assert fields is not None
    y, x = np.broadcast_to(fields.y / b, fields.x.shape), fields.x / a
    colours = ListedColormap([SLIDE, STICK])
    axes.pcolormesh(y, x, fields.adhesion, shading="nearest", cmap=colours, rasterized=True)
    sticking = 100.0 * float(fields.adhesion[:-1].mean())  # the last row starts the first elements
    handles = [
        Patch(color=STICK, label=f"adhesion, {sticking:.1f} % of the elements"),
        Patch(color=SLIDE, label=f"slip (saturated), {100.0 - sticking:.1f} %"),
    ]
    axes.grid(visible=False)
    axes.set_aspect("equal")
    axes.set_ylim(-1.05, 1.55)
    axes.legend(handles=handles, loc="upper center")


def _half_axes(study: ContactStudy) -> tuple[float, float]:
    """Return half the length and half the width of the contact."""
    return float(study.solution.half_length.max()), 0.5 * study.grid.spacing * study.grid.strips


def _draw_map(axes: Axes, study: ContactStudy, value: FloatArray) -> None:
    """Draw a field element by element, without interpolation."""
    fields = study.fields
    assert fields is not None
    y = np.broadcast_to(fields.y, fields.x.shape)
    mesh = axes.pcolormesh(y * MM, fields.x * MM, value, shading="nearest", cmap=PRESSURE, vmin=0.0)
    mesh.set_rasterized(True)
    axes.figure.colorbar(mesh, ax=axes, pad=0.02, aspect=24)
    axes.grid(visible=False)


def _draw_printed_ellipse(axes: Axes) -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    y = 0.5 * paper.CONTACT_WIDTH.value * np.cos(angle)
    x = 0.5 * paper.CONTACT_LENGTH.value * np.sin(angle)
    axes.plot(y * MM, x * MM, color=RED, ls="--", lw=1.1)


def _draw_strips(axes: Axes, study: ContactStudy, colour: str, label: str) -> None:
    solution = study.solution
    axes.plot(solution.y * MM, solution.dissipation * W_MM, color=colour, label=label)
    axes.set_ylim(bottom=0.0)
    axes.margins(x=0.0)


def _draw_white_friction(
    panels: dict[str, Axes], mean: ContactStudy, white_friction: ContactStudy
) -> None:
    fields = white_friction.fields
    assert fields is not None
    _draw_map(panels["12a"], white_friction, -fields.traction_x * MPA)
    name_axes(panels["12a"], r"Fig. 12a: $\tau_x$ [MPa], white friction", _Y, _X)
    _draw_map(
        panels["12b"], white_friction, fields.slip_x * white_friction.point.rolling_speed * MM
    )
    name_axes(panels["12b"], "Fig. 12b: slip $w_x$ [mm/s], white friction", _Y, _X)
    axes = panels["13"]
    smooth, rough = (shown(study.solution.power, "W") for study in (mean, white_friction))
    _draw_strips(axes, mean, BLUE, f"uniform friction, {smooth}")
    _draw_strips(axes, white_friction, ORANGE, f"white friction, {rough}")
    axes.legend(loc="lower center")
    name_axes(axes, r"Fig. 13: $P_l$(y), all other inputs at their mean", _Y, r"$P_l$ [W/mm]")


def _write_notes(axes: Axes, results: Reproduction) -> None:
    """Write the legend and the numbers common to all panels."""
    axes.axis("off")
    handles = [
        Line2D([], [], color=RED, ls="--", label="printed in the paper"),
        Line2D([], [], color=BLUE, label="computed here"),
        Line2D([], [], color="black", label="computed mean"),
        Line2D([], [], color=GREEN, label="bound $\\mu N V$|creepage|"),
    ]
    axes.legend(handles=handles, loc="upper left", fontsize=10.0)
    means = {
        "all inputs": results.all_inputs.summaries["power"],
        "without misalignment": results.aligned.summaries["power"],
    }
    lines = [
        f"{count(results.all_inputs.count)} realisations, seed {results.scenario.seed};",
        "one friction coefficient per contact,",
        "except for the white friction of Fig. 12 and 13",
        "",
        *(
            f"{name}: {shown(power.mean, 'W')} ± {shown(power.mean_error, 'W', 2)}"
            for name, power in means.items()
        ),
        "",
        "No input is fitted to the printed results.",
    ]
    text = axes.text(0.02, 0.68, "\n".join(lines), transform=axes.transAxes, va="top")
    text.set(linespacing=1.5, fontsize=10.0, in_layout=False)  # must not widen its column
