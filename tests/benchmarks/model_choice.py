"""How often `contact.model = "auto"` meets its tolerance on contacts kept apart from calibration.

``python -m tests.benchmarks.model_choice FILE... [-o FILE.json]`` with the files of
`tests.benchmarks.calibration` (``solve elliptic 2 200``, ``solve worn 2 20``, ``solve worn 3 60``),
by default the stored ones, prints the verdicts as a Markdown table: errors are relative to
half-space solutions.
``--crossed FILE...`` does so for the calibrated contacts by cross-validation, with safety factors
that cover several shares of them: `COVERED` is the least with which 99 % of all choices meet each
tolerance.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.benchmarks.calibration import MODELS, crossed, read
from tests.benchmarks.table import save_tables
from wearsim.studies.contact.estimate import Calibration, ErrorModel, calibration, preference
from wearsim.types import FloatArray

STORED = Path(__file__).parents[1] / "reference" / "contacts_kept_apart.npz"
TOLERANCES = (0.003, 0.01, 0.03, 0.1)
SHARES = (0.9, 0.95, 0.975, 0.99)
LABELS = list(MODELS)
TITLE = "Choices on contacts kept apart from the calibration"


@dataclass(frozen=True)
class Verified:
    """Choices over contacts at one tolerance.

    Parameters
    ----------
    tolerance : float
    met : float
        Share of the contacts whose choice is within the tolerance.
    warned : float
        Share for which no estimate is within the tolerance: exact theory on its finest elements is
        taken with a warning.
    met_unwarned : float
        Share within the tolerance of the others.
    cheap : float
        Share with another model than `halfspace`.
    met_alone : float
        Share within the tolerance of the contacts for which a model is taken without `halfspace`
        installed; the others are refused.
    cost : float
        Mean cost of the choices.
    constant, constant_met : str, float
        The constant model of at most this cost with the greatest share within the tolerance.
    """

    tolerance: float
    met: float
    warned: float
    met_unwarned: float
    cheap: float
    met_alone: float
    cost: float
    constant: str
    constant_met: float


def by_label(table: Calibration) -> list[ErrorModel]:
    """Return the error models in the order of `MODELS`."""
    pairs = list(MODELS.values())
    return sorted(table.models, key=lambda item: pairs.index((item.model, item.options)))


def estimates(data: dict[str, FloatArray], table: Calibration) -> FloatArray:
    """Return the estimated error of each contact and model; infinite where there is none."""
    found = np.full(data["errors"].shape, np.inf)
    for row, indicators in enumerate(data["indicators"]):
        if not table.outside(indicators):
            scaled = table.scaled(indicators)
            found[row] = [item.error(scaled) for item in by_label(table)]
    return np.where(np.isfinite(data["errors"]), found, np.inf)


def verified(
    errors: FloatArray, estimated: FloatArray, table: Calibration, tolerance: float
) -> tuple[Verified, list[str]]:
    """Return the verdict on the choices at a tolerance, and the choice for each contact."""
    models = by_label(table)
    finest = max(range(len(models)), key=lambda column: models[column].cost)
    taken = []
    for each in estimated:
        able = np.flatnonzero(each <= tolerance).tolist()
        ordered = sorted(able, key=lambda column: preference(each[column], models[column]))
        taken.append(ordered[0] if ordered else finest)
    chosen = np.array(taken)
    rows = np.arange(len(chosen))
    within = errors[rows, chosen] <= tolerance
    warned = estimated[rows, chosen] > tolerance
    cheap = np.array([models[column].model != "halfspace" for column in taken])
    cost = float(np.mean([models[column].cost for column in taken]))
    constants = {
        label: float(np.mean(errors[:, column] <= tolerance))
        for column, label in enumerate(LABELS)
        if models[column].cost <= cost
    }
    constant = max(constants, key=lambda label: constants[label])
    verdict = Verified(
        tolerance,
        float(np.mean(within)),
        float(np.mean(warned)),
        _share(within[~warned]),
        float(np.mean(cheap)),
        _share(within[cheap]),
        cost,
        constant,
        constants[constant],
    )
    return verdict, [LABELS[column] for column in taken]


def _share(values: FloatArray) -> float:
    return float(np.mean(values)) if len(values) else 1.0


def verify(data: dict[str, FloatArray], estimated: FloatArray, table: Calibration) -> str:
    """Return the verdicts on contacts as a Markdown table, and the reference's own error."""
    head = (
        "contacts | tolerance | within it | with a warning | without: within it"
        " | approximate model | without `halfspace`: within it, refused | mean cost"
        " | best constant model of this cost"
    )
    lines = [f"| {head} |", "|" + "---|" * (head.count("|") + 1)]
    sets = sorted(set(zip(data["kind"].tolist(), data["seed"].tolist(), strict=True)))
    parts = {
        f"{kind}, seed {seed}": (data["kind"] == kind) & (data["seed"] == seed)
        for kind, seed in sets
    }
    for kind, own in {**parts, "in all": np.ones(len(data["own"]), dtype=bool)}.items():
        for tolerance in TOLERANCES:
            found, _ = verified(data["errors"][own], estimated[own], table, tolerance)
            lines.append(
                f"| {own.sum()} {kind} | {100 * tolerance:g} % | {found.met:.1%}"
                f" | {found.warned:.1%} | {found.met_unwarned:.1%} | {found.cheap:.1%}"
                f" | {found.met_alone:.1%}, {1.0 - found.cheap:.1%} | {found.cost:.0f}"
                f" | {found.constant}, {found.constant_met:.1%} |"
            )
    error = data["own"]
    uncertain = ", ".join(f"{np.mean(error > t / 3):.0%} at {100 * t:g} %" for t in TOLERANCES)
    lines += ["", f"Error of the reference: median {np.median(error):.2%},"]
    lines[-1] += f" 90 % below {np.quantile(error, 0.9):.2%};"
    lines[-1] += f" above a third of the tolerance in {uncertain}."
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables, and write that of the contacts kept apart to a file if one is named."""
    parser = argparse.ArgumentParser(prog="tests.benchmarks.model_choice", description=__doc__)
    parser.add_argument("files", nargs="*", type=Path, default=[STORED])
    parser.add_argument("--crossed", action="store_true", help="calibrated contacts instead")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE.json")
    given = parser.parse_args(arguments)
    data, table = read(given.files), calibration()
    if given.crossed:
        predicted = crossed(data)
        missed = np.full(predicted.shape, np.nan)
        known = np.isfinite(predicted)
        missed[known] = np.log(data["errors"][known]) - predicted[known]
        for share in SHARES:
            factors = np.exp(np.nanquantile(missed, share, axis=0))
            text = verify(data, np.exp(predicted) * factors, table)
            sys.stdout.write(f"## Factors that cover {share:.1%}\n\n{text}\n\n")
        return
    text = verify(data, estimates(data, table), table)
    sys.stdout.write(f"{text}\n")
    if given.output is not None:
        save_tables(given.output, "python -m tests.benchmarks.model_choice", {TITLE: text})


if __name__ == "__main__":
    main()
