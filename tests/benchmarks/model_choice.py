"""How often `contact.model = "auto"` meets its tolerance on contacts kept apart from calibration.

``python -m tests.benchmarks.model_choice FILE...`` with the files of `tests.benchmarks.calibration`
(``solve elliptic 2 200``, ``solve worn 2 20``), by default the stored ones, prints the verdicts as
a Markdown table: errors are relative to half-space solutions.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.benchmarks.calibration import MODELS, read
from wearsim.studies.contact.estimate import Calibration, calibration
from wearsim.types import FloatArray

STORED = Path(__file__).parents[1] / "reference" / "contacts_kept_apart.npz"
TOLERANCES = (0.003, 0.01, 0.03, 0.1)


@dataclass(frozen=True)
class Verified:
    """Choices over contacts at one tolerance.

    Parameters
    ----------
    tolerance : float
    met : float
        Share of the contacts whose choice is within the tolerance; where no model is estimated to
        be, the exact theory is taken and counts as within.
    measured : float
        The same with the discretisation error of the exact theory on its finest elements.
    cheap, exact : float
        Shares of contacts with another model than `halfspace`, and with none estimated to suffice.
    met_alone : float
        Share within the tolerance of the contacts for which a model is taken without `halfspace`
        installed; the others are refused.
    refused : float
        Share of the latter.
    cost : float
        Mean cost of the choices.
    constant, constant_met : str, float
        The constant model of at most this cost with the greatest share within the tolerance.
    """

    tolerance: float
    met: float
    measured: float
    cheap: float
    exact: float
    met_alone: float
    refused: float
    cost: float
    constant: str
    constant_met: float


def verified(
    data: dict[str, FloatArray], table: Calibration, tolerance: float
) -> tuple[Verified, list[str]]:
    """Return the verdict on the choices at a tolerance, and the choice for each contact."""
    labels = list(MODELS)
    chosen, met, measured, alone, cost = [], [], [], [], []
    columns = [
        next(k for k, (name, options) in enumerate(MODELS.values()) if (name, options) == pair)
        for pair in ((item.model, item.options) for item in table.models)
    ]
    finest = columns[-1]
    for indicators, errors_ in zip(data["indicators"], data["errors"], strict=True):
        scaled, inside = table.scaled(indicators), not table.outside(indicators)
        able = [
            column
            for item, column in zip(table.models, columns, strict=True)
            if inside and np.isfinite(errors_[column]) and item.error(scaled) <= tolerance
        ]
        column = able[0] if able else finest
        chosen.append(labels[column] if able else "exact theory")
        met.append(not able or errors_[column] <= tolerance)
        measured.append(errors_[column] <= tolerance)
        cost.append(table.models[columns.index(column)].cost)
        if able and not labels[column].startswith("halfspace"):
            alone.append(measured[-1])
    mean_cost = float(np.mean(cost))
    constants = {
        labels[column]: float(np.mean(data["errors"][:, column] <= tolerance))
        for item, column in zip(table.models, columns, strict=True)
        if item.cost <= mean_cost
    }
    constant = max(constants, key=lambda label: constants[label])
    cheap, count = len(alone), len(met)
    verdict = Verified(
        tolerance,
        float(np.mean(met)),
        float(np.mean(measured)),
        cheap / count,
        chosen.count("exact theory") / count,
        float(np.mean(alone)) if alone else 1.0,
        1.0 - cheap / count,
        mean_cost,
        constant,
        constants[constant],
    )
    return verdict, chosen


def verify(data: dict[str, FloatArray]) -> str:
    """Return the verdicts on contacts that are kept apart, as a Markdown table."""
    head = (
        "contacts | tolerance | met | with its elements' error | cheap model | exact theory"
        " | without `halfspace`: met, refused | mean cost | best constant model of this cost"
    )
    lines = [f"| {head} |", "|" + "---|" * (head.count("|") + 1)]
    kinds = {kind: data["kind"] == kind for kind in np.unique(data["kind"]).tolist()}
    for kind, chosen in {**kinds, "in all": np.ones(len(data["own"]), dtype=bool)}.items():
        part = {name: values[chosen] for name, values in data.items()}
        for tolerance in TOLERANCES:
            found, _ = verified(part, calibration(), tolerance)
            lines.append(
                f"| {len(part['own'])} {kind} | {100 * tolerance:g} % | {found.met:.1%}"
                f" | {found.measured:.1%} | {found.cheap:.1%} | {found.exact:.1%}"
                f" | {found.met_alone:.1%}, {found.refused:.1%} | {found.cost:.0f}"
                f" | {found.constant}, {found.constant_met:.1%} |"
            )
    own = data["own"]
    lines += ["", f"Error of the reference: median {np.median(own):.2%},"]
    lines[-1] += f" 90 % below {np.quantile(own, 0.9):.2%}."
    return "\n".join(lines)


if __name__ == "__main__":
    sys.stdout.write(verify(read([Path(name) for name in sys.argv[1:]] or [STORED])) + "\n")
