"""`wearsim maxent`: maximum-entropy distribution for a given support and moments."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wearsim.cli.shared import (
    Figure,
    Force,
    Json,
    check_figure,
    note,
    write_json,
    write_notes,
    write_table,
)

if TYPE_CHECKING:
    from pathlib import Path

    from wearsim.uq.distributions.base import MaxentDistribution

PROBABILITIES = (0.025, 0.05, 0.25, 0.5, 0.75, 0.95, 0.975)
_COLUMNS, _ROWS = 60, 8
_BLOCKS = " ▁▂▃▄▅▆▇█"

Support = Annotated[
    tuple[str, str],
    typer.Option(
        "--support",
        metavar="LOW HIGH",
        help="Least and greatest possible value: 0 inf.",
        show_default=False,
    ),
]
Mean = Annotated[float | None, typer.Option("--mean", help="Mean.", show_default=False)]
Std = Annotated[float | None, typer.Option("--std", help="Standard deviation.", show_default=False)]
MeanLog = Annotated[
    float | None,
    typer.Option(
        "--mean-log",
        help="Mean of the natural logarithm, instead of --std: a gamma distribution.",
        show_default=False,
    ),
]


def maxent(
    support: Support,
    mean: Mean = None,
    std: Std = None,
    mean_log: MeanLog = None,
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
    if figure is not None:
        from wearsim.report.figures.contact import maxent_figure
        from wearsim.report.parts import save_figure

        save_figure(maxent_figure(distribution), figure)
    if json:
        write_json(_data(distribution, figure))
        return
    write_table("maximum-entropy distribution", _rows(distribution))
    typer.echo("\n".join(_plot(distribution)))
    write_notes((), distribution.warnings)
    if figure is not None:
        note(f"figure: {figure}")


def _limit(text: str) -> float:
    """Return an end of the support, which may be infinite."""
    try:
        return float(text)
    except ValueError as error:
        raise typer.BadParameter(
            f"'{text}' is not a number, expected one such as 0, -2.5 or inf", param_hint="--support"
        ) from error


def _rows(distribution: MaxentDistribution) -> list[tuple[str, str]]:
    from wearsim.report.maxent import multipliers, parent, without_rounding

    found = parent(distribution)
    return [
        ("family", distribution.family),
        ("support", " to ".join(f"{end:g}" for end in distribution.support)),
        ("density", f"exp(-l0 - l1 x - l2 {distribution.third})"),
        *((f"l{number}", f"{item:.7g}") for number, item in enumerate(multipliers(distribution))),
        (
            "parent normal distribution",
            f"mean {found[0]:.7g}, standard deviation {found[1]:.7g}" if found else "none",
        ),
        ("mean", f"{without_rounding(distribution, distribution.mean):.7g}"),
        ("standard deviation", f"{distribution.std:.7g}"),
        *(
            (f"{100.0 * probability:g} % quantile", f"{item:.7g}")
            for probability, item in _quantiles(distribution).items()
        ),
    ]


def _quantiles(distribution: MaxentDistribution) -> dict[float, float]:
    import numpy as np

    from wearsim.report.maxent import without_rounding

    values = distribution.quantile(np.array(PROBABILITIES)).tolist()
    return {
        p: without_rounding(distribution, item)
        for p, item in zip(PROBABILITIES, values, strict=True)
    }


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


def _data(distribution: MaxentDistribution, figure: Path | None) -> dict[str, Any]:
    """Return the distribution in the units of the given moments."""
    from wearsim.report.maxent import multipliers, parent, without_rounding

    found = parent(distribution)
    return {
        "family": distribution.family,
        "support": distribution.support,
        "multipliers": dict(zip(("l0", "l1", "l2"), multipliers(distribution), strict=True)),
        "l2_multiplies": distribution.third,
        "parent": found and {"mean": found[0], "std": found[1]},
        "mean": without_rounding(distribution, distribution.mean),
        "std": distribution.std,
        "quantiles": _quantiles(distribution),
        "warnings": list(distribution.warnings),
        "figure": figure,
    }
