"""Sphinx extension that draws the line load in a worn groove, from two runs of the rig's test."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

import wearsim
from wearsim.report.figures import save_figure

if TYPE_CHECKING:
    from sphinx.application import Sphinx

RIG = Path(__file__).parents[2] / "scenarios" / "rig-450min.toml"
FIGURE = "_build/figures/groove-pressure.svg"  # of the documentation
FINE = {
    "contact.strips": 301,
    "contact.width": "20 mm",
    "evolution.tolerance": 1e-4,
    "evolution.strip_error": False,
}
LAYER = 0.6  # shown next to the edge [mm]


def groove_pressure() -> Figure:
    """Return the line load of the rig's test at its end, over the groove and next to its edge."""
    runs = {
        "automatic strips": wearsim.run(wearsim.load_scenario(RIG)),
        "strips of half the width": wearsim.run(wearsim.load_scenario(RIG, overrides=FINE)),
    }
    fine = runs["strips of half the width"]
    crown_radius = fine.scenario.roller.crown_radius
    half_width = float(np.sqrt(2.0 * crown_radius * fine.depth[-1])) * 1e3
    rigid = float(fine.normal_force[-1].max()) / (2.0 * half_width)
    figure = Figure(figsize=(9.0, 3.2), layout="constrained")
    whole, edge = figure.subplots(1, 2)
    for name, result in runs.items():
        y, load = result.y * 1e3, result.line_load[-1].ravel() / 1e3
        ends = np.append(y, 2.0 * y[-1] - y[-2]) - 0.5 * (y[1] - y[0])
        for axes in (whole, edge):
            axes.stairs(load, ends, label=name)
    for axes in (whole, edge):
        axes.plot(
            [-half_width, -half_width, half_width, half_width],
            [0.0, rigid, rigid, 0.0],
            "k--",
            linewidth=1.0,
            label="rigid bodies",
        )
        axes.set_xlabel("y [mm]")
    whole.set_ylabel("line load [N/mm]")
    whole.set_xlim(-half_width - 0.5, half_width + 0.5)
    edge.set_xlim(half_width - LAYER, half_width + 0.1)
    edge.legend(loc="lower left")
    return figure


def draw(app: Sphinx) -> None:
    """Draw the figure if it is older than the steppers and the scenario."""
    path = Path(app.srcdir) / FIGURE
    folder = Path(wearsim.__file__).parent / "evolution" / "steppers"
    sources = *folder.glob("*.py"), RIG, Path(__file__)
    newest = max(source.stat().st_mtime for source in sources)
    if not path.exists() or path.stat().st_mtime < newest:
        path.parent.mkdir(parents=True, exist_ok=True)
        save_figure(groove_pressure(), path)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the extension."""
    app.connect("builder-inited", draw)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
