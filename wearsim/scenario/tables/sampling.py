"""The table [sampling]: how realisations of the random inputs are drawn."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field

from wearsim.scenario.parse.mistakes import Report, Table
from wearsim.scenario.parse.validate import validate
from wearsim.scenario.random.model import RandomInput
from wearsim.units import shown
from wearsim.uq.sampling.gaussian_copula import GaussianCopula

Correlation = Annotated[float, Field(ge=-1.0, le=1.0)]


class SamplingTable(Table):
    """How realisations of the random inputs are drawn."""

    plan: Literal["monte-carlo", "latin-hypercube", "sobol"] = Field(
        default="monte-carlo", description="Where the draws lie: at random, or spread evenly."
    )
    realisation: int = Field(
        default=0, ge=0, description="Number of the realisation that a single run takes."
    )
    correlation: tuple[tuple[str, str, Correlation], ...] = Field(
        default=(),
        description="Rank correlations, each the names of two random inputs and a number.",
    )


def read_sampling(raw: Mapping[str, object], report: Report) -> SamplingTable | None:
    """Return the table [sampling], or None after noting its mistakes."""
    return validate(report, SamplingTable, raw, "sampling")


def check_correlation(table: SamplingTable | None, report: Report) -> None:
    """Note what is wrong with the correlations, once all random inputs are read."""
    known = {item.name: item for item in report.random}
    rows = table.correlation if table else ()
    sound = [
        _is_sound((first, second), f"correlation (entry {count})", known, report)
        for count, (first, second, _) in enumerate(rows, start=1)
    ]
    if rows and all(sound):
        try:
            GaussianCopula(rows, {item.name: item.dimension for item in report.random})
        except ValueError as error:
            report.add("sampling", "correlation", str(error))


def _is_sound(
    pair: tuple[str, str], key: str, known: Mapping[str, RandomInput], report: Report
) -> bool:
    """Check one pair; inputs that have mistakes of their own are passed over."""
    for name in pair:
        if name not in report.tried:
            there = f" (known: {', '.join(sorted(known)) or 'none'})"
            hint = report.names.near(name, known) or there
            report.add("sampling", key, f"'{name}' is not a random input{hint}")
    if not known.keys() >= set(pair):
        return False
    first, second = known[pair[0]], known[pair[1]]
    unfit = [item for item in (first, second) if item.role != "scalar"]
    for item in unfit:
        what = f"'{item.name}' is a {item.role}, and only single numbers can be correlated"
        report.add("sampling", key, what, shown(item.kind))
    if first.persistence != second.persistence:
        what = "needs two random inputs of the same persistence"
        report.add("sampling", key, what, f"{first.persistence} and {second.persistence}")
        return False
    return not unfit
