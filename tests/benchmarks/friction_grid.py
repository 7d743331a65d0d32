"""Random friction fields and the grid: convergence with and without a correlation length.

``python -m tests.benchmarks.friction_grid -o docs/friction-grid.png``
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

import wearsim

MEAN_CONTACT = Path(__file__).parents[2] / "scenarios" / "mean-contact.toml"
FRICTION = {"distribution": "maxent", "support": [0, "inf"], "mean": 0.1, "std": 0.02}
STRIPS = 64
FIELDS: dict[str, dict[str, Any]] = {
    "gaussian-field, 100 um, in the contact": {
        "distribution": "gaussian-field",
        "correlation_length": "100 um",
    },
    "white, rolling through with a body": {"distribution": "white", "frame": "cylinder"},
    "white, in the contact": {"distribution": "white"},
}
POINTS = (25, 50, 100, 200, 400, 800)
MAX_CARRIED = 100  # points along a strip above which carried friction takes too long


def mean_power(field: str, points: int, realisations: int) -> tuple[float, float]:
    """Return mean power and its standard error [W] for a number of points along each strip."""
    changes = {
        "friction.coefficient": {**FIELDS[field], "marginal": FRICTION},
        "contact.mx": points,
        "contact.my": STRIPS,
    }
    scenario = wearsim.load_scenario(MEAN_CONTACT, changes)
    found = wearsim.dissipation(scenario, realisations).summaries["power"]
    return float(found.mean), float(found.mean_error)


def draw(path: Path, realisations: int) -> None:
    """Plot the mean power of every field against the number of points along a strip."""
    from wearsim.report.figures import figure_style, name_axes, save_figure
    from wearsim.report.panels import BLUE, GREEN, ORANGE

    uniform = wearsim.solve_contact(wearsim.load_scenario(MEAN_CONTACT)).power
    with figure_style():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(6.4, 4.0), layout="constrained")
        axes = figure.add_subplot()
        for field, colour in zip(FIELDS, (BLUE, GREEN, ORANGE), strict=True):
            points = [p for p in POINTS if "rolling" not in field or p <= MAX_CARRIED]
            means = np.array([mean_power(field, p, realisations) for p in points])
            bars = 2.0 * means[:, 1]
            axes.errorbar(points, means[:, 0], bars, color=colour, marker="o", ms=4, label=field)
        axes.axhline(uniform, color="k", ls="--", lw=0.9, label="friction the same everywhere")
        axes.set_xscale("log", base=2)
        axes.set_xticks(POINTS, [str(p) for p in POINTS])
        axes.set_ylim(0.04, 0.08)
        title = f"Mean power of {realisations} contacts, friction 0.1 +- 0.02 at every point"
        name_axes(axes, title, "points along each strip", r"mean of $P_d$ [W]")
        axes.legend(loc="lower left")
        save_figure(figure, path)


def main() -> None:
    """Write the figure."""
    parser = argparse.ArgumentParser(prog="tests.benchmarks.friction_grid", description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/friction-grid.png"))
    parser.add_argument("-n", "--realisations", type=int, default=200)
    options = parser.parse_args()
    draw(options.output, options.realisations)


if __name__ == "__main__":
    main()
