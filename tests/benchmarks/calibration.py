"""Errors of contact models against half-space solutions: calibration of `contact.model = "auto"`.

``python -m tests.benchmarks.calibration solve elliptic 1 500 -o out/elliptic-1.npz`` solves random
contacts of a kind and a seed; run again after a stop, it continues. ``fit FILE... -o
wearsim/studies/contact/calibration.json`` fits the error models. Calibrated are ``elliptic 1 500``,
``worn 1 180`` and ``wavy 1 60``; ``elliptic 2 200``, ``worn 2 20`` and ``worn 3 60`` are kept
apart, see `tests.benchmarks.model_choice`.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from multiprocessing import Pool
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from wearsim.errors import ContactError
from wearsim.mechanics.hertz.elasticity import combine
from wearsim.mechanics.hertz.ellipse import hertz
from wearsim.plugins import ContactModelSpec, registry
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.contact.estimate import indicators_of, terms_of
from wearsim.studies.preparation import software
from wearsim.studies.run.run import run
from wearsim.types import ContactSolution, Creepage, FloatArray, Grid, Material, OperatingPoint
from wearsim_bench.measure.machine import this_machine

STEEL = Material(youngs_modulus=206e9, poisson_ratio=0.3)
MODULUS = combine(STEEL, STEEL).contact_modulus
CURVATURE, LOAD = 40.0, 300.0  # 1/m along rolling and N; the errors do not depend on them
#: The reference: P_l(y) varies irregularly with the elements, and is not extrapolated over them.
FINE, COARSER = "halfspace, 280", "halfspace, 200"
#: model and options by label
MODELS: dict[str, tuple[str, dict[str, Any]]] = {
    "hertz": ("hertz", {}),
    "hertz, fastrip": ("hertz", {"tangential": "fastrip"}),
    "hertz, fastsim": ("hertz", {"tangential": "fastsim"}),
    "semi-hertzian": ("semi-hertzian", {}),
    "slender": ("slender", {}),
    "slender, fastrip": ("slender", {"tangential": "fastrip"}),
    "slender, fastsim": ("slender", {"tangential": "fastsim"}),
    "halfspace, 24": ("halfspace", {"mx": 24}),
    "halfspace, 50": ("halfspace", {"mx": 50}),
    "halfspace, 100": ("halfspace", {"mx": 100}),
    "halfspace, 200": ("halfspace", {"mx": 200}),
}
RIDGE, FOLDS, COVERED = 1.0, 10, 0.95
SAVED = 20  # contacts between two writings


@dataclass(frozen=True, eq=False)
class Contact:
    """A random contact: strips, gap [m], curvature along rolling [1/m], operating point."""

    y: FloatArray
    gap: FloatArray
    curvature: float
    point: OperatingPoint

    def solve(self, model: str, options: dict[str, Any]) -> ContactSolution:
        """Solve it with a model."""
        spec = registry().get(ContactModelSpec, model)
        grid = Grid(self.y, float(self.y[1] - self.y[0]))
        built = spec.factory(spec.options.model_validate(options), grid, (STEEL, STEEL))
        return built.solve_one(self.gap, self.curvature, self.point)


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _crown(ratio: float) -> float:
    """Return the curvature across rolling of an ellipse with b/a = `ratio` [1/m]."""
    low, high = -6.0, 6.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        patch = hertz(0.5 * CURVATURE, 0.5 * CURVATURE * 10.0**middle, LOAD, MODULUS)
        low, high = (middle, high) if patch.b / patch.a > ratio else (low, middle)
    return CURVATURE * 10.0**middle


def _direction(rng: np.random.Generator) -> FloatArray:
    """Return a unit vector: longitudinal and lateral creepage, spin times sqrt(a b)."""
    kind = rng.uniform()
    vector = rng.normal(size=3)
    vector /= np.linalg.norm(vector)
    if kind < 0.1:
        return np.array([1.0, 0.0, 0.0])
    if kind < 0.25:
        vector[2 if kind < 0.2 else 0] = 0.0
        vector /= np.linalg.norm(vector)
    return vector


def _point(
    rng: np.random.Generator, a: float, b: float, curvature: float, load: float
) -> OperatingPoint:
    """Return random friction, and creepage and spin from a tenth to five times full slip."""
    friction, size = _log_uniform(rng, 0.01, 0.6), _log_uniform(rng, 0.1, 5.0)
    along, across, spin = (size * friction * a * curvature * _direction(rng)).tolist()
    return OperatingPoint(
        load, 1.0, Creepage(along, across, spin / float(np.sqrt(a * b))), friction
    )


def elliptic(rng: np.random.Generator) -> Contact:
    """Return an elliptic contact with b/a from 0.1 to 30."""
    crown = _crown(_log_uniform(rng, 0.1, 30.0))
    patch = hertz(0.5 * CURVATURE, 0.5 * crown, LOAD, MODULUS)
    point = _point(rng, patch.a, patch.b, CURVATURE, LOAD)
    y = Grid.spanning(-1.15 * patch.b, 1.15 * patch.b, 48).y
    return Contact(y, 0.5 * crown * y**2, CURVATURE, point)


def wavy(rng: np.random.Generator) -> Contact:
    """Return a contact with b/a from 1 to 30, waves of the profile and sometimes a flat."""
    crown = _crown(_log_uniform(rng, 1.0, 30.0))
    patch = hertz(0.5 * CURVATURE, 0.5 * crown, LOAD, MODULUS)
    y = np.linspace(-2.5 * patch.b, 2.5 * patch.b, 301)
    gap, depth = 0.5 * crown * y**2, 0.5 * CURVATURE * patch.a**2
    if rng.uniform() < 0.4:
        flat = rng.uniform(0.1, 1.0) * patch.b
        gap = np.maximum(gap - 0.5 * crown * flat**2, 0.0)
    for _ in range(rng.integers(1, 4)):
        length = _log_uniform(rng, 0.4, 3.0) * patch.b
        height = depth * _log_uniform(rng, 0.01, 0.4)
        gap = gap + height * np.cos(2.0 * np.pi * y / length + rng.uniform(0.0, 6.3))
    return _within(rng, y, gap, CURVATURE, LOAD)


def worn(rng: np.random.Generator) -> Contact:
    """Return a contact on a groove worn by one to three rollers of random crown, load, offset."""
    crown, load = _log_uniform(rng, 40.0, 1500.0), _log_uniform(rng, 50.0, 1000.0)
    rollers, curvature = int(rng.integers(1, 4)), 1 / 0.02 + 1 / 0.025
    patch = hertz(0.5 * curvature, 0.5 / (crown * 1e-3), load, MODULUS)
    depth = _log_uniform(rng, 0.1, 20.0) * 0.5 * curvature * patch.a**2
    changes: dict[str, object] = {
        "roller.crown_radius": f"{crown} mm",
        "load.normal_force": f"{load} N",
        "operation.rollers": rollers,
        "evolution.tolerance": 1e-2,
        "contact.strips": 161,
    }
    if rollers > 1:
        offsets = rng.uniform(-0.6, 0.6, rollers)
        changes["roller.offset"] = [f"{1e3 * patch.b * value} mm" for value in offsets]
    result = run(shipped_scenario("rig-450min", changes), until=f"depth {depth * 1e6} um")
    nominal = result.raw.static["nominal_gap"].reshape(-1, len(result.y))[0]
    return _within(rng, result.y, nominal + result.profiles[-1].ravel(), curvature, load)


def _within(
    rng: np.random.Generator, y: FloatArray, gap: FloatArray, curvature: float, load: float
) -> Contact:
    """Return the contact on 64 strips over its width, with a random operating point."""
    from scipy.interpolate import CubicSpline

    anything = OperatingPoint(load, 1.0, Creepage(1e-3, 0.0, 0.0), 0.1)
    spacing = float(y[1] - y[0])
    solution = Contact(y, gap, curvature, anything).solve("slender", {})
    touching = np.flatnonzero(solution.line_load > 0.0)
    low, high = float(y[touching[0]]), float(y[touching[-1]])
    half, middle = 0.56 * (high - low) + 0.5 * spacing, 0.5 * (low + high)
    longest = float(solution.half_length.max())
    point = _point(rng, longest, 0.5 * (high - low), curvature, load)
    strips = Grid.spanning(middle - half, middle + half, 64).y
    return Contact(strips - middle, CubicSpline(y, gap)(strips), curvature, point)


KINDS = {"elliptic": elliptic, "wavy": wavy, "worn": worn}


def solved(task: tuple[str, int, int]) -> dict[str, FloatArray] | None:
    """Return P_l(y) of all models and of the reference, and indicators, of one random contact."""
    kind, seed, number = task
    contact = KINDS[kind](np.random.default_rng([seed, number]))
    found = {}
    for label, (model, options) in {**MODELS, FINE: ("halfspace", {"mx": 280})}.items():
        try:
            solution = contact.solve(model, options)
        except ContactError:
            continue
        found[label] = solution.dissipation
        if label in {"slender", "hertz"}:
            found["indicators"] = indicators_of(solution, contact.curvature, contact.point)
    return found if "indicators" in found else None


def errors(found: dict[str, FloatArray]) -> tuple[FloatArray, float] | None:
    """Return the errors of `MODELS`, infinite where one fails, and that of the reference.

    The latter is the change from coarser elements: an upper estimate, since the error decreases
    with the square of their length.
    """
    if FINE not in found or COARSER not in found:
        return None
    exact = found[FINE]
    size = float(np.linalg.norm(exact))
    each = [
        float(np.linalg.norm(found[label] - exact)) / size if label in found else np.inf
        for label in MODELS
    ]
    return np.array(each), float(np.linalg.norm(found[COARSER] - exact)) / size


def solve(kind: str, seed: int, count: int, processes: int, output: Path) -> None:
    """Write indicators and errors of random contacts; contacts already in the file are kept."""
    rows: list[dict[str, Any]] = []
    if output.exists():
        known = dict(np.load(output))
        rows = [{key: known[key][k] for key in known} for k in range(len(known["number"]))]
    done = {int(row["number"]) for row in rows}
    tasks = [(kind, seed, number) for number in range(count) if number not in done]

    def save() -> None:
        part = output.with_suffix(".part.npz")
        ordered = sorted(rows, key=lambda row: int(row["number"]))
        np.savez(part, **{key: np.array([row[key] for row in ordered]) for key in ordered[0]})
        part.replace(output)

    with Pool(processes) as pool:
        for task, found in zip(tasks, pool.imap(solved, tasks), strict=True):
            measured = errors(found) if found is not None else None
            if found is None or measured is None:
                continue
            row = {"kind": kind, "seed": seed, "number": task[2], "own": measured[1]}
            rows.append(row | {"indicators": found["indicators"], "errors": measured[0]})
            if len(rows) % SAVED == 0:
                save()
    save()
    sys.stdout.write(f"{output}: {len(rows)} of {count}\n")


def read(files: Sequence[Path]) -> dict[str, FloatArray]:
    """Return the contacts of several files."""
    data = [dict(np.load(file)) for file in files]
    return {name: np.concatenate([one[name] for one in data]) for name in data[0]}


def costs(repetitions: int = 5) -> dict[str, float]:
    """Return the time of one contact of each model over that of the cheapest, a median."""
    times: dict[str, list[float]] = {label: [] for label in MODELS}
    for number in range(16):
        contact = elliptic(np.random.default_rng([1, number]))
        for label, (model, options) in MODELS.items():
            try:
                contact.solve(model, options)
            except ContactError:
                continue
            lapses = []
            for _ in range(repetitions):
                start = perf_counter()
                contact.solve(model, options)
                lapses.append(perf_counter() - start)
            times[label].append(min(lapses))
    medians = {label: float(np.median(lapses)) for label, lapses in times.items()}
    return {label: lapse / min(medians.values()) for label, lapse in medians.items()}


def _coefficients(terms: FloatArray, logs: FloatArray) -> FloatArray:
    """Return the polynomial for ln(error) of the contacts that a model solves."""
    part, known = terms[np.isfinite(logs)], logs[np.isfinite(logs)]
    penalty = RIDGE * np.eye(terms.shape[1])
    return np.linalg.solve(part.T @ part + penalty, part.T @ known)


def _fitted(data: dict[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return the terms of the polynomial and ln(error), one row per contact."""
    indicators = data["indicators"]
    terms = terms_of((indicators - indicators.mean(axis=0)) / indicators.std(axis=0))
    return terms, np.log(data["errors"])


def crossed(data: dict[str, FloatArray]) -> FloatArray:
    """Return ln(error) of contacts and models, fitted to other contacts; infinite if unsolved."""
    terms, logs = _fitted(data)
    found = np.full(logs.shape, np.inf)
    fold = np.random.default_rng(0).permutation(len(terms)) % FOLDS
    for column in range(len(MODELS)):
        for number in range(FOLDS):
            left = fold == number
            coefficients = _coefficients(terms[~left], logs[~left, column])
            left &= np.isfinite(logs[:, column])
            found[left, column] = terms[left] @ coefficients
    return found


def fit(data: dict[str, FloatArray], relative: dict[str, float]) -> dict[str, Any]:
    """Return the calibration: a quadratic polynomial for ln(error) of each model."""
    indicators = data["indicators"]
    (terms, logs), predicted = _fitted(data), crossed(data)
    models = []
    for column, (label, (model, options)) in enumerate(MODELS.items()):
        solved_ = np.isfinite(logs[:, column])
        missed = logs[solved_, column] - predicted[solved_, column]
        models.append(
            {
                "model": model,
                "options": options,
                "cost": float(f"{relative[label]:.3g}"),
                "coefficients": [float(f"{c:.5g}") for c in _coefficients(terms, logs[:, column])],
                "factor": float(f"{np.exp(np.quantile(missed, COVERED)):.4g}"),
            }
        )
        spread = f"{label}: {solved_.sum()} contacts, deviation {np.std(missed):.2f}"
        sys.stdout.write(f"{spread} of ln(error)\n")
    sets = {}
    for kind in np.unique(data["kind"]).tolist():
        own = data["kind"] == kind
        seeds = np.unique(data["seed"][own]).tolist()
        numbers = f"0 to {data['number'][own].max()}"
        sets[kind] = {"seeds": seeds, "numbers": numbers, "solved": int(own.sum())}
    own_errors = {f"{part:.0%} below": np.quantile(data["own"], part) for part in (0.5, 0.9, 1.0)}
    return {
        "provenance": {
            "date": datetime.now(UTC).date().isoformat(),
            "command": "python -m tests.benchmarks.calibration solve KIND SEED COUNT, and fit",
            "contacts": sets,
            "machine": str(this_machine()),
            "software": {**software(), "wearsim-halfspace": version("wearsim-halfspace")},
            "reference": f"'{FINE}' elements along rolling",
            f"its error, the change from '{COARSER}'": {
                key: float(f"{error:.2g}") for key, error in own_errors.items()
            },
            "strips": "48 over 1.15 times the patch, worn and wavy 64 over 1.12 times the patch",
            "covered": COVERED,
        },
        "mean": indicators.mean(axis=0).tolist(),
        "scale": indicators.std(axis=0).tolist(),
        "least": indicators.min(axis=0).tolist(),
        "greatest": indicators.max(axis=0).tolist(),
        "models": models,
    }


def main() -> None:
    """Run one of the commands."""
    parser = argparse.ArgumentParser(description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("solve")
    one.add_argument("kind", choices=KINDS)
    one.add_argument("seed", type=int)
    one.add_argument("count", type=int)
    one.add_argument("-p", "--processes", type=int, default=2)
    commands.add_parser("fit").add_argument("files", nargs="+", type=Path)
    for command in commands.choices.values():
        command.add_argument("-o", "--output", type=Path)
    given = parser.parse_args()
    if given.command == "solve":
        solve(given.kind, given.seed, given.count, given.processes, given.output)
    else:
        found = fit(read(given.files), costs())
        given.output.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
