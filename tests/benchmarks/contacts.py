"""Single contacts (Hertz, mean problem, slender contact) and batches of contacts."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from tests.benchmarks.table import Effort, Row, part
from wearsim.contact_batch import ContactBatch
from wearsim.mechanics.hertz.elasticity import combine
from wearsim.mechanics.hertz.ellipse import HertzContact, hertz
from wearsim.mechanics.tangential.strip_interaction import strip_elasticity
from wearsim.mechanics.tangential.strip_theory import SUMS, strip_contacts
from wearsim.models.contact.hertz_fastsim import HertzFastsim, HertzFastsimOptions
from wearsim.plugins import ContactModelSpec, registry
from wearsim.types import ContactSolution, Creepage, Grid, Material, OperatingPoint
from wearsim_bench.contact.cases import Case, elliptic_cases
from wearsim_bench.measure.timing import best, best_short

STEEL = Material(youngs_modulus=200e9, poisson_ratio=0.3)
ALONG, CROWN, LOAD = 1 / 0.020 + 1 / 0.025, 0.5, 300.0
POINT = OperatingPoint(LOAD, 1000 / 60 * 2 * 3.141592653589793 * 0.025, Creepage(1e-3), 0.1)
PEAK_PRESSURE = 680.22e6  # Pa, of the rig
EXACT_POWER = 0.0771  # W, exact rolling theory for the mean problem
FASTSIM_POWER = 0.073873  # W, limit of FASTSIM for a long patch


class Mean:
    """The mean problem: the unworn contact of the rig, on the default or given strips."""

    def __init__(self, name: str, strips: int | None = None, **options: Any) -> None:
        spec = registry().get(ContactModelSpec, name)
        chosen = spec.options(**options)
        grid = spec.suggest_grid(chosen, 1 / CROWN, ALONG, LOAD, (STEEL, STEEL))
        if strips is not None:
            half = 0.5 * grid.strips * grid.spacing
            grid = Grid.spanning(-half, half, strips)
        self.model = spec.factory(chosen, grid, (STEEL, STEEL))
        self.gap = grid.y**2 / (2 * CROWN)

    def solve(self, warm: ContactSolution | None = None, load: float = LOAD) -> ContactSolution:
        """Solve it, with or without a warm start."""
        point = POINT if load == LOAD else replace(POINT, normal_force=load)
        return self.model.solve_one(self.gap, ALONG, point, None, warm)


def rig_hertz() -> HertzContact:
    """Return the rig's Hertzian contact."""
    return hertz(ALONG / 2, 0.5 / CROWN, LOAD, combine(STEEL, STEEL).contact_modulus)


def hertz_rows(effort: Effort) -> list[Row]:
    """Time the exact Hertz solution."""
    error = part(rig_hertz().peak_pressure / PEAK_PRESSURE - 1)
    seconds = best_short(rig_hertz, effort.repetitions)
    return [Row("Hertz, the rig", seconds, "", f"{error} in p0, of 680.22 MPa")]


VARIANTS: dict[str, dict[str, Any]] = {
    "closed form": {},
    "FASTSIM, work of the rigid slip": {"closed_form": "never"},
    "FASTSIM, element sum": {"closed_form": "never", "dissipation": "element-sum"},
}
TARGETS = {"FASTSIM, work of the rigid slip": "0.1 % in power"}


def mean_rows(effort: Effort) -> list[Row]:
    """Time the mean problem by the three variants of FASTSIM, 50 x 50 elements."""
    rows = []
    for variant, options in VARIANTS.items():
        mean = Mean("hertz-fastsim", kalker="line-limit", **options)
        error = part(mean.solve().power / FASTSIM_POWER - 1)
        seconds = best_short(mean.solve, effort.repetitions)
        what = f"mean problem, 50 x 50, {variant}"
        rows.append(
            Row(what, seconds, TARGETS.get(variant, ""), f"{error} in power, of 0.073873 W")
        )
    return rows


def draws(gap: np.ndarray) -> ContactBatch:
    """Draw load, creepage, yaw, tilt and friction of contacts similarly to the paper."""
    contacts = len(gap)
    random = np.random.default_rng(0)
    angle, size = 2 * np.pi * random.random(contacts), 2e-3 * np.sqrt(random.random(contacts))
    return ContactBatch(
        gap=gap,
        longitudinal_curvature=np.full(contacts, ALONG),
        normal_force=random.normal(307.0, 32.0, contacts),
        longitudinal=np.abs(random.normal(1e-3, 4e-4, contacts)),
        lateral=size * np.cos(angle),
        spin=size * np.sin(angle) / 0.020,
        friction=np.abs(random.normal(0.1, 0.02, contacts)),
        rolling_speed=np.full(contacts, POINT.rolling_speed),
    )


def batch_rows(effort: Effort) -> list[Row]:
    """Time a batch of 1000 contacts with spin; errors are against the limit of FASTSIM."""
    steps = 400 if not effort.quick else 100

    def case(elements: int, strips: int, form: str) -> tuple[float, np.ndarray]:
        grid = Grid.spanning(-1.8e-3, 1.8e-3, strips)
        options = HertzFastsimOptions(mx=elements, closed_form=form)
        model = HertzFastsim(options, grid, (STEEL, STEEL))
        contacts = draws(np.broadcast_to(grid.y**2 / (2 * CROWN), (1000, strips)))
        power = model.solve(contacts).power
        return best(lambda: model.solve(contacts), effort.repetitions), power

    reference = case(steps, steps, "never")[1]
    rows = []
    for what, elements, strips, form, target in (
        ("50 x 50, FASTSIM", 50, 50, "never", "0.1 s, aim 0.02 s"),
        ("12 x 16, FASTSIM", 12, 16, "never", "10 ms, aim 2 ms; 0.2 %"),
        ("24 strips, closed form", 50, 24, "always", ""),
    ):
        seconds, power = case(elements, strips, form)
        rms = np.sqrt(np.mean((power / reference - 1) ** 2))
        error = f"{part(power.mean() / reference.mean() - 1)} in mean power, {100 * rms:.2g} % rms"
        message = f"{error}, against {steps} x {steps}"
        rows.append(Row(f"1000 contacts with spin at once, {what}", seconds, target, message))
    return rows


def tangential_rows(effort: Effort) -> list[Row]:
    """Time the kernel of strip theory in partial slip with spin, per contact of a batch."""
    rows, batch = [], 200
    for strips, target in ((64, "10 us, aim 1 us; 1.5 % rms"), (24, "")):
        errors, seconds = [], []
        for case in elliptic_cases("partial")[: 4 if effort.quick else None]:
            arrays, sums = strip_problem(case, strips, 1)
            strip_contacts(*arrays)
            errors.append(sums[SUMS.index("power"), 0] / case.exact.power - 1.0)
            copies, _ = strip_problem(case, strips, batch)
            seconds.append(best(lambda args=copies: strip_contacts(*args), effort.repetitions))
        rms = float(np.sqrt(np.mean(np.square(errors))))
        what = f"strip theory, {strips} strips, partial slip with spin, kernel"
        message = f"{100 * rms:.2g} % rms of the exact power"
        rows.append(Row(what, float(np.mean(seconds)) / batch, target, message))
    return rows


def strip_problem(case: Case, strips: int, contacts: int) -> tuple[tuple[Any, ...], np.ndarray]:
    """Return the arguments of `strip_contacts` for copies of a Hertzian contact, and the sums."""
    patch, point, elastic = case.patch, case.point, combine(STEEL, STEEL)
    grid = Grid.spanning(-patch.b, patch.b, strips)
    half = patch.a * np.sqrt(1.0 - (grid.y / patch.b) ** 2)
    load = 0.5 * np.pi * patch.peak_pressure * half**2 / patch.a
    load *= point.normal_force / (load.sum() * grid.spacing)
    creepage, dissipation = point.creepage, np.empty((contacts, strips))
    sums = np.empty((len(SUMS), contacts))

    def per_strip(values: object) -> np.ndarray:
        return np.ascontiguousarray(np.broadcast_to(values, (contacts, strips)))

    def per_contact(value: float) -> np.ndarray:
        return np.full(contacts, value)

    arguments = (
        per_strip(load),
        per_strip(half),
        grid.y,
        grid.spacing,
        strip_elasticity(elastic.contact_modulus, elastic.shear_modulus),
        per_contact(point.rolling_speed),
        per_contact(creepage.longitudinal),
        per_contact(creepage.lateral),
        per_contact(creepage.spin),
        per_strip(-creepage.spin * grid.y),
        per_strip(point.friction),
        np.empty((contacts, 0)),
        dissipation,
        sums,
        np.empty(contacts),
    )
    return arguments, sums


def slender_rows(effort: Effort) -> list[Row]:
    """Time a slender solve on 81 strips, with and without a warm start."""
    mean = Mean("slender", strips=81)
    cold = mean.solve()
    error = f"{part(cold.power / EXACT_POWER - 1)} in power, of 0.0771 W"
    peak = f"{part(cold.peak_pressure / PEAK_PRESSURE - 1)} in p0"
    near = mean.solve(load=0.99 * LOAD)

    def row(what: str, target: str, message: str, warm: ContactSolution | None) -> Row:
        seconds = best_short(lambda: mean.solve(warm), effort.repetitions)
        return Row(f"slender, 81 strips, {what}", seconds, target, message)

    count = 100
    points = [replace(POINT, normal_force=LOAD * (1.0 + 1e-4 * k)) for k in range(count)]
    batch = ContactBatch.of(np.repeat(mean.gap[None], count, axis=0), ALONG, points)
    loads = replace(batch, normal_force=0.99 * batch.normal_force)
    warm = mean.model.solve(loads)
    together = best(lambda: mean.model.solve(batch, warm=warm), effort.repetitions) / count
    return [
        row("cold", "", error, None),
        row("from a solution under 1 % less load", "", peak, near),
        Row(f"the same, each of {count} at once", together, "40 us, aim 15 us", peak),
        row("from the solution itself", "", peak, cold),
    ]
