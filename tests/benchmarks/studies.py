"""Studies of many realisations: the paper's Monte Carlo of one contact."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.benchmarks.table import Effort, Row, part
from wearsim.scenario import Scenario, load_scenario
from wearsim.studies.dissipation.monte_carlo import dissipation
from wearsim.uq.distributions.maxent import maximum_entropy
from wearsim.uq.sampling.sobol import Stream
from wearsim_bench.measure.timing import best

PAPER = Path(__file__).parents[2] / "scenarios" / "paper-monte-carlo.toml"
MEAN_POWER = 0.1058  # W, of the paper's inputs


MODELS = {
    "hertz-fastsim, 50 x 50": {},
    "hertz-fastsim, 16 x 24": {"contact.mx": 16, "contact.my": 24},
    "hertz-fastsim, closed form in 24 strips": {"contact.closed_form": "always", "contact.my": 24},
    "slender, 48 strips": {"contact": {"model": "slender", "strips": 48}},
}
DISTRIBUTIONS: dict[str, dict[str, float | tuple[float, float]]] = {
    "load": {"support": (0.0, np.inf), "mean": 307.0, "std": 32.0},
    "creepage, the hard case": {"support": (0.0, 1.0), "mean": 1e-3, "std": 9e-4},
    "bimodal": {"support": (0.0, 1.0), "mean": 0.5, "std": 0.35},
    "gamma": {"support": (0.0, np.inf), "mean": 2.0, "mean_log": 0.5},
}


def paper(**changes: object) -> Scenario:
    """Return the paper's Monte Carlo, 50 x 50; a key's dots are written as `__`."""
    overrides = {key.replace("__", "."): value for key, value in changes.items()}
    return load_scenario(PAPER, overrides)


def dissipation_rows(effort: Effort) -> list[Row]:
    """Time the paper's Monte Carlo: its contacts, and everything except writing the file."""
    scenario, count = paper(), 100 if effort.quick else 1000
    found = [dissipation(scenario, count) for _ in range(effort.repetitions)]
    power = found[0].summaries["power"]
    deviation = (power.mean - MEAN_POWER) / power.mean_error
    error = f"mean {power.mean:.4g} W, {deviation:+.1f} standard errors from {MEAN_POWER} W"
    total = best(lambda: dissipation(scenario, count), effort.repetitions)
    what = f"the paper's Monte Carlo, {count} realisations, 50 x 50 with spin"
    solving = min(result.raw.solve_seconds for result in found)
    return [
        Row(f"{what}: the contacts", solving, "0.1 s, aim 0.02 s", error),
        Row(f"{what}: draws, contacts and statistics", total, "", error),
    ]


def cheapest_rows(effort: Effort) -> list[Row]:
    """Time the same statistics with faster models, against the limit of FASTSIM."""
    count, fine = (100, 100) if effort.quick else (1000, 300)
    reference = dissipation(paper(contact__mx=fine, contact__my=fine), count).summaries["power"]
    rows = []
    for model, changes in MODELS.items():
        scenario = load_scenario(PAPER, changes)
        found = [dissipation(scenario, count) for _ in range(effort.repetitions + 1)]
        power = found[0].summaries["power"]
        mean, std = power.mean / reference.mean - 1, power.std / reference.std - 1
        error = f"mean {part(mean)}, std {part(std)}, of the same draws by FASTSIM, {fine} x {fine}"
        seconds = min(result.raw.solve_seconds for result in found[1:])
        target = "0.5 % in mean and std" if "24" in model else ""
        rows.append(Row(f"{count} contacts of the paper, {model}", seconds, target, error))
    return rows


def draw_rows(effort: Effort) -> list[Row]:
    """Time a million draws of maximum-entropy distributions."""
    count, rows = (10_000 if effort.quick else 1_000_000), []
    stream = Stream(1, "benchmark")
    for name, known in DISTRIBUTIONS.items():
        distribution = maximum_entropy(**known)

        def draw(distribution: object = distribution) -> np.ndarray:
            return distribution.quantile(stream.uniforms(0, count))  # type: ignore[attr-defined]

        values = draw()
        deviation = (values.mean() - distribution.mean) / (distribution.std / np.sqrt(count))
        target = "" if effort.quick else "0.3 s"
        error = f"mean {deviation:+.1f} standard errors off"
        rows.append(Row(f"{count} draws, {name}", best(draw, effort.repetitions), target, error))
    return rows
