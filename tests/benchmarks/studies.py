"""Studies of many realisations: the paper's Monte Carlo of one contact."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.benchmarks.table import Effort, Row, part
from wearsim.scenario import Scenario, load_scenario
from wearsim.studies.contact.monte_carlo import dissipation
from wearsim.uq.distributions.maxent import maximum_entropy
from wearsim.uq.sampling.philox import Stream
from wearsim_bench.measure.timing import best

PAPER = Path(__file__).parents[2] / "scenarios" / "paper-monte-carlo.toml"
MEAN_POWER = 0.1058  # W, of the paper's inputs


MODELS = {
    "hertz-fastsim, 50 x 50": {},
    "hertz-fastsim, 16 x 24": {"contact.mx": 16, "contact.my": 24},
    "hertz-fastsim, closed form in 24 strips": {"contact.closed_form": "always", "contact.my": 24},
    "slender, 48 strips": {"contact": {"model": "slender", "strips": 48}},
}
LAWS: dict[str, dict[str, float | tuple[float, float]]] = {
    "load": {"support": (0.0, np.inf), "mean": 307.0, "std": 32.0},
    "creepage, the hard case": {"support": (0.0, 1.0), "mean": 1e-3, "std": 9e-4},
    "two-humped": {"support": (0.0, 1.0), "mean": 0.5, "std": 0.35},
    "gamma": {"support": (0.0, np.inf), "mean": 2.0, "mean_log": 0.5},
}


def paper(**changes: object) -> Scenario:
    """Return the paper's Monte Carlo, 50 x 50; a key's dots are written as `__`."""
    overrides = {key.replace("__", "."): value for key, value in changes.items()}
    return load_scenario(PAPER, overrides)


def dissipation_rows(effort: Effort) -> list[Row]:
    """Time the paper's Monte Carlo: its contacts, and all of it but its file."""
    scenario, count = paper(), 100 if effort.quick else 1000
    found = [dissipation(scenario, count) for _ in range(effort.repetitions)]
    power = found[0].summaries["power"]
    away = (power.mean - MEAN_POWER) / power.mean_error
    error = f"mean {power.mean:.4g} W, {away:+.1f} standard errors from {MEAN_POWER} W"
    whole = best(lambda: dissipation(scenario, count), effort.repetitions)
    what = f"the paper's Monte Carlo, {count} realisations, 50 x 50 with spin"
    solving = min(result.raw.solve_seconds for result in found)
    return [
        Row(f"{what}: the contacts", solving, "0.1 s, aim 0.02 s", error),
        Row(f"{what}: draws, contacts and statistics", whole, "", error),
    ]


def cheapest_rows(effort: Effort) -> list[Row]:
    """Time the same statistics by cheaper models, against FASTSIM's own limit."""
    count, fine = (100, 100) if effort.quick else (1000, 300)
    truth = dissipation(paper(contact__mx=fine, contact__my=fine), count).summaries["power"]
    rows = []
    for model, changes in MODELS.items():
        scenario = load_scenario(PAPER, changes)
        found = [dissipation(scenario, count) for _ in range(effort.repetitions + 1)]
        power = found[0].summaries["power"]
        error = (
            f"mean {part(power.mean / truth.mean - 1)}, std {part(power.std / truth.std - 1)},"
            f" of the same draws by FASTSIM, {fine} x {fine}"
        )
        seconds = min(result.raw.solve_seconds for result in found[1:])
        asked = "0.5 % in mean and std" if "24" in model else ""
        rows.append(Row(f"{count} contacts of the paper, {model}", seconds, asked, error))
    return rows


def draw_rows(effort: Effort) -> list[Row]:
    """Time a million draws of laws of maximum entropy."""
    count, rows = (10_000 if effort.quick else 1_000_000), []
    stream = Stream(1, "benchmark")
    for name, known in LAWS.items():
        law = maximum_entropy(**known)

        def drawn(law: object = law) -> np.ndarray:
            return law.quantile(stream.uniforms(0, count))  # type: ignore[attr-defined]

        values = drawn()
        away = (values.mean() - law.mean) / (law.std / np.sqrt(count))
        asked = "" if effort.quick else "0.3 s"
        error = f"mean {away:+.1f} standard errors from its own"
        rows.append(Row(f"{count} draws, {name}", best(drawn, effort.repetitions), asked, error))
    return rows
