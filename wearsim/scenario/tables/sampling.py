"""Table [sampling]: sampling design of the random inputs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field

from wearsim.scenario.parse.mistakes import Mistakes, Table, nearest
from wearsim.scenario.random.model import RandomInput
from wearsim.units import shown
from wearsim.uq.sampling.gaussian_copula import GaussianCopula

Correlation = Annotated[float, Field(ge=-1.0, le=1.0)]


class SamplingTable(Table):
    """Sampling design of the random inputs."""

    plan: Literal["monte-carlo", "latin-hypercube", "sobol"] = Field(
        default="monte-carlo", description="Sampling design: independent or evenly spread draws."
    )
    realisation: int = Field(
        default=0, ge=0, description="Number of the realisation that a single run uses."
    )
    correlation: tuple[tuple[str, str, Correlation], ...] = Field(
        default=(),
        description="Rank correlations, each with the names of two random inputs and a number.",
    )


def check_correlation(table: SamplingTable | None, mistakes: Mistakes) -> None:
    """Add the mistakes of the correlations; all random inputs must have been read."""
    known = {item.name: item for item in mistakes.random_inputs}
    rows = table.correlation if table else ()
    valid = [
        _is_valid((first, second), f"correlation (entry {count})", known, mistakes)
        for count, (first, second, _) in enumerate(rows, start=1)
    ]
    if rows and all(valid):
        try:
            GaussianCopula(rows, {item.name: item.dimension for item in mistakes.random_inputs})
        except ValueError as error:
            mistakes.add("sampling", "correlation", str(error))


def _is_valid(
    pair: tuple[str, str], key: str, known: Mapping[str, RandomInput], mistakes: Mistakes
) -> bool:
    """Check one pair of random inputs; an input that has mistakes itself adds none here."""
    for name in pair:
        if name not in mistakes.random:
            hint = nearest(name, known) or f" (known: {', '.join(sorted(known)) or 'none'})"
            mistakes.add("sampling", key, f"'{name}' is not a random input{hint}")
    if not known.keys() >= set(pair):
        return False
    first, second = known[pair[0]], known[pair[1]]
    unfit = [item for item in (first, second) if item.role != "scalar"]
    for item in unfit:
        what = f"'{item.name}' is a {item.role}, and only single numbers can be correlated"
        mistakes.add("sampling", key, what, shown(item.kind))
    same = first.persistence == second.persistence
    if not same:
        what = "needs two random inputs of the same persistence"
        mistakes.add("sampling", key, what, f"{first.persistence} and {second.persistence}")
    return same and not unfit
