"""`wearsim maxent`: maximum-entropy distribution for a given support and moments."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated

import typer

from wearsim.cli.render import show_with_figure
from wearsim.cli.shared import (
    Figure,
    Force,
    Json,
    check_figure,
    checking,
)

if TYPE_CHECKING:
    from wearsim.uq.distributions.base import MaxentDistribution

_COLUMNS, _ROWS = 60, 8
_BLOCKS = " ▁▂▃▄▅▆▇█"


def maxent(
    support: Annotated[
        tuple[str, str],
        typer.Option(
            "--support",
            metavar="LOW HIGH",
            help="Least and greatest possible value: 0 inf.",
            show_default=False,
        ),
    ],
    mean: Annotated[float | None, typer.Option("--mean", help="Mean.", show_default=False)] = None,
    std: Annotated[
        float | None, typer.Option("--std", help="Standard deviation.", show_default=False)
    ] = None,
    mean_log: Annotated[
        float | None,
        typer.Option(
            "--mean-log",
            help="Mean of the natural logarithm, instead of --std: a gamma distribution.",
            show_default=False,
        ),
    ] = None,
    figure: Figure = None,
    json: Json = False,
    force: Force = False,
) -> None:
    """Compute a maximum-entropy distribution from moments."""
    check_figure(figure, force)
    from wearsim.uq.distributions.maxent import Infeasible, maximum_entropy

    try:
        distribution = maximum_entropy(
            (_limit(support[0]), _limit(support[1])), mean, std, mean_log
        )
    except Infeasible as error:
        raise Infeasible(re.sub(r"\bmean_log\b", "--mean-log", str(error))) from error
    from wearsim.report.maxent import MaxentView

    show_with_figure(MaxentView(distribution), figure, json=json)
    if not json:
        typer.echo("\n".join(_plot(distribution)))


def _limit(text: str) -> float:
    """Return an end of the support, which may be infinite."""
    with checking("--support", f"'{text}' is not a number, expected one such as 0, -2.5 or inf"):
        return float(text)


def _plot(distribution: MaxentDistribution) -> list[str]:
    """Return the density as a plot of block characters, line by line, with its range below."""
    import numpy as np

    low, high = distribution.bulk
    edges = np.linspace(low, high, _COLUMNS + 1)
    density = distribution.density(0.5 * (edges[1:] + edges[:-1]))
    eighths = np.rint(density / density.max() * 8 * _ROWS).astype(int)
    lines = [
        "  " + "".join(_BLOCKS[min(max(height - 8 * row, 0), 8)] for height in eighths).rstrip()
        for row in reversed(range(_ROWS))
    ]
    left, right = f"{low:.4g}", f"{high:.4g}"
    return [*lines, f"  {'▔' * _COLUMNS}", f"  {left}{right:>{_COLUMNS - len(left)}}"]
