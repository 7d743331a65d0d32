"""Optimisation against a closed form, bisection and grids, as Markdown tables.

``python -m tests.benchmarks.optimisation -o out/optimisation.json --grid out/cam-grid.json`` runs
the 400 lives of a grid, which are kept in its file: the same command continues a stopped one.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import wearsim
from tests.benchmarks.table import save_tables
from wearsim.atomic_write import save_text
from wearsim_bench.figures.table import markdown_table
from wearsim_optimise.api import optimise

SCENARIOS = Path(__file__).parents[2] / "scenarios"
RIG = {
    "operation.rollers": 1,
    "wear.cylinder.k_over_h": {
        "distribution": "lognormal",
        "median": "1.1e-11 1/Pa",
        "factor": 1.5,
    },
    "limit.depth": "50 um",
}
DEPTH, WIDTH, EVALUATIONS = 50e-6, 14e-3, 25
CAM_REALISATIONS = 8
#: fewer strips do not resolve the pressure at the end of a roller with a small drop
FINE, STRIPS = 485, (125, 245, 485, 965)
FORM = "roller.axial_profile"
ROLLER = [f"{FORM}.k1=0.5:4.0", f"{FORM}.k2=0.2:1.0", f"{FORM}.drop=3um:60um"]
TILTS = ("0 mrad", "0.5 mrad")
CLOSED = "Life of a groove of limited width: crown radius of the roller"
GRID = "A cam of two variables against a grid"
PROFILES = "Logarithmic rollers against a grid"


def closed_form(scenario: wearsim.Scenario) -> float:
    """Return the crown radius at which depth and width reach their limits together [m].

    In full slip the groove of rigid bodies is a parabola of the crown radius R, whose width at the
    threshold d_thr is 2 sqrt(2 R (d - d_thr)).
    """
    return WIDTH**2 / (8.0 * (DEPTH - scenario.outputs.width_threshold))


def bisected(scenario: wearsim.Scenario, low: float, high: float, halvings: int = 24) -> float:
    """Return the crown radius at which the simulated groove has the limited width [m]."""
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        tried = scenario.changed({"roller.crown_radius": f"{middle!r} m"})
        lives = wearsim.life(tried, 1, scheduler="serial")
        low, high = (middle, high) if lives.at_end("width").item() < WIDTH else (low, middle)
    return 0.5 * (low + high)


def crowns() -> list[list[str]]:
    """Return the rows of the closed form: width as a constraint, and as a limit of the life."""
    scenario = wearsim.load_scenario(SCENARIOS / "rig-450min.toml", RIG)
    closed, crossing = closed_form(scenario), bisected(scenario, 0.4, 0.6)
    options: dict[str, Any] = {"maximise": "life.b10", "realisations": 1, "confirm": False}
    options |= {"evaluations": EVALUATIONS, "scheduler": "serial"}
    vary = ["roller.crown_radius=200mm:2000mm"]
    constraint = optimise(scenario, vary, subject_to=["life.width < 14 mm"], **options)
    limit = optimise(scenario.changed({"limit.width": "14 mm"}), vary, **options)
    rows = []
    for name, found in (("constraint", constraint), ("limit of the life", limit)):
        radius = 1e-3 * found.best.numbers[0]
        runs = sum(design.purpose in {"start", "search"} for design in found.designs)
        cells = [f"{1e3 * value:.3f}" for value in (radius, crossing, closed)]
        parts = [f"{100.0 * (radius / value - 1.0):+.3f} %" for value in (crossing, closed)]
        rows.append([name, str(runs), *cells, *parts])
    return rows


def cam_scenario(changes: dict[str, Any] | None = None) -> wearsim.Scenario:
    """Return the cam of the example, without variables of another search."""
    return wearsim.load_scenario(SCENARIOS / "cam-optimise.toml", changes or {})


def cam_grid(points: int, realisations: int, kept: Path | None = None) -> list[dict[str, float]]:
    """Return the designs of a grid of the cam with their B10 and limited quantities in SI.

    Every design is run, also those beyond a limit. What is known of a grid is kept in a file, with
    which a stopped measurement continues.
    """
    scenario = cam_scenario()
    tables = tomllib.loads(scenario.text)
    del tables["optimise"]  # of the search, not of the designs
    about = {"scenario": tables, "points": points, "realisations": realisations}
    rows: list[dict[str, float]] = []
    if kept is not None and kept.exists():
        read = json.loads(kept.read_text(encoding="utf-8"))
        rows = read["rows"] if read["about"] == about else []
    bases = np.linspace(25.0, 50.0, points).tolist()
    crowns_mm = np.geomspace(200.0, 2000.0, points).tolist()
    for base, crown in list(itertools.product(bases, crowns_mm))[len(rows) :]:
        values = {"cam.base_radius": f"{base!r} mm", "roller.crown_radius": f"{crown!r} mm"}
        tried = scenario.changed(values)
        before = wearsim.study_cam(tried).view.answers()
        after = wearsim.life(tried, realisations, scheduler="serial").view.answers()
        found = {name: before[name].value for name in ("outer_radius", "peak_pressure")}
        found |= {name: after[name].value for name in ("width", "b10")}
        rows.append({"base": base, "crown": crown, **found})
        if kept is not None:
            save_text(json.dumps({"about": about, "rows": rows}) + "\n", kept)
    return rows


def best_of_grid(rows: Sequence[dict[str, float]]) -> tuple[dict[str, float], int]:
    """Return the design with the greatest B10 within the limits, and how many are within them."""
    limits = {"outer_radius": 50e-3, "peak_pressure": 700e6, "width": 22e-3}
    within = [row for row in rows if all(row[name] <= value for name, value in limits.items())]
    return max(within, key=lambda row: row["b10"]), len(within)


def cams(
    points: int, kept: Path | None = None, realisations: int = CAM_REALISATIONS
) -> list[list[str]]:
    """Return the row of the cam: the best of grid and search, and runs until 0.998 of it."""
    best, within = best_of_grid(cam_grid(points, realisations, kept))
    found = optimise(
        cam_scenario(),
        realisations=realisations,
        evaluations=points**2 // 10,
        confirm=False,
        scheduler="serial",
    )
    used, reached = 0, 0
    for design in found.designs:
        used += design.purpose in {"start", "search"} and design.is_evaluated
        good = design.is_feasible and design.values["life.b10"] >= 0.998 * best["b10"]
        reached = reached or (used if good else 0)
    at_best = f"{best['base']:.1f} mm, {best['crown']:.0f} mm"
    chosen = ", ".join(
        variable.shown(number)
        for variable, number in zip(found.design_variables, found.best.numbers, strict=True)
    )
    value = found.best.values["life.b10"]
    cells = [f"{points} x {points}", str(within), at_best, f"{best['b10']:,.0f}", chosen]
    return [[*cells, str(used), f"{value:,.0f}", f"{value / best['b10']:.4f}", str(reached)]]


def roller(tilt: str, strips: int) -> wearsim.Scenario:
    """Return the logarithmic roller."""
    changes = {"creepage.tilt": tilt, "contact.strips": strips}
    return wearsim.load_scenario(SCENARIOS / "roller-logarithmic.toml", changes)


def profile_grid(tilt: str, strips: int, points: int) -> float:
    """Return the least peak pressure of a grid over K1, K2 and the drop [Pa]."""
    scenario, peaks = roller(tilt, strips), []
    axes = (np.geomspace(0.5, 4.0, points), np.linspace(0.2, 1.0, points))
    for k1, k2, drop in itertools.product(*axes, np.geomspace(3.0, 60.0, points)):
        values = {"k1": float(k1), "k2": float(k2), "drop": f"{float(drop)!r} um"}
        tried = scenario.changed({f"{FORM}.{key}": value for key, value in values.items()})
        peaks.append(wearsim.solve_contact(tried).peak_pressure)
    return float(min(peaks))


def profiles(
    points: int, fine: int = FINE, strips: Sequence[int] = STRIPS, tilts: Sequence[str] = TILTS
) -> list[list[str]]:
    """Return the rows of the rollers: least pressure of grid and search, and by the strips."""
    rows = []
    for tilt in tilts:
        options: dict[str, Any] = {"minimise": "peak_pressure", "scheduler": "serial", "starts": 6}
        found = optimise(roller(tilt, fine), ROLLER, evaluations=80, **options)
        grid = profile_grid(tilt, fine, points)
        least = found.best.values["peak_pressure"]
        converged = [
            wearsim.solve_contact(roller(tilt, count).changed(found.best_values)).peak_pressure
            for count in strips
        ]
        values = [f"{number:.3g}" for number in found.best.numbers]
        runs = sum(design.purpose in {"start", "search"} for design in found.designs)
        cells = [f"{1e-6 * value:.1f}" for value in (grid, least)]
        part = f"{100.0 * (least / grid - 1.0):+.2f} %"
        rows.append(
            [tilt, *values, *cells, part, str(runs), *(f"{1e-6 * p:.1f}" for p in converged)]
        )
    return rows


def report(
    kept: Path | None = None, cam_points: int = 20, roller_points: int = 12
) -> dict[str, str]:
    """Return the tables by their titles; the grid of the cam is kept in a file."""
    heads = ["width as", "designs", "found [mm]", "bisection [mm]", "closed form [mm]"]
    heads += ["from bisection", "from the closed form"]
    tables = {CLOSED: f"{markdown_table(heads, crowns())}\n"}
    heads = ["tilt", "K1", "K2", "drop [um]", "grid [MPa]", "found [MPa]", "difference", "designs"]
    heads += [f"{count} strips [MPa]" for count in STRIPS]
    about = f"The grid has {roller_points} values of each, {FINE} strips."
    tables[PROFILES] = f"{markdown_table(heads, profiles(roller_points))}\n\n{about}\n"
    heads = ["grid", "within the limits", "best of the grid", "B10 [turns]", "found"]
    heads += ["runs", "B10 found [turns]", "over the grid", "runs until 0.998"]
    about = f"All designs of the grid are run, with {CAM_REALISATIONS} realisations as the search."
    tables[GRID] = f"{markdown_table(heads, cams(cam_points, kept))}\n\n{about}\n"
    return tables


def main(arguments: list[str] | None = None) -> None:
    """Print the tables, and write them to a file if one is named."""
    parser = argparse.ArgumentParser(prog="tests.benchmarks.optimisation", description=__doc__)
    parser.add_argument("-o", "--output", type=Path, metavar="FILE.json")
    parser.add_argument("--grid", type=Path, metavar="FILE.json", help="keeps the grid of the cam")
    given = parser.parse_args(arguments)
    output, tables = given.output, report(given.grid)
    sys.stdout.write("\n".join(f"{title}\n\n{table}" for title, table in tables.items()))
    if output is not None:
        save_tables(output, "python -m tests.benchmarks.optimisation", tables)


if __name__ == "__main__":
    main()
