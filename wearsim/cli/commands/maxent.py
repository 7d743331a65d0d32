"""`wearsim maxent`: the law of maximum entropy that agrees with what is known of a value."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wearsim.cli.arguments import Figure, Force, Json, check_figure
from wearsim.cli.output import note, refuse_existing, write_json, write_table

if TYPE_CHECKING:
    from pathlib import Path

    from wearsim.uq.distributions.base import Law

PROBABILITIES = (0.025, 0.05, 0.25, 0.5, 0.75, 0.95, 0.975)
_COLUMNS, _ROWS = 60, 8
_BLOCKS = " ▁▂▃▄▅▆▇█"

Support = Annotated[
    tuple[str, str],
    typer.Option(
        "--support",
        metavar="LOW HIGH",
        help="Least and greatest value possible: 0 inf.",
        show_default=False,
    ),
]
Mean = Annotated[float | None, typer.Option("--mean", help="Mean.", show_default=False)]
Std = Annotated[float | None, typer.Option("--std", help="Standard deviation.", show_default=False)]
MeanLog = Annotated[
    float | None,
    typer.Option(
        "--mean-log",
        help="Mean of the natural logarithm, in place of --std: a gamma law.",
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
    """Find the law of maximum entropy from what is known."""
    if figure is not None:
        check_figure(figure)
        refuse_existing(figure, force)
    law = _law((_limit(support[0]), _limit(support[1])), mean, std, mean_log)
    if figure is not None:
        from wearsim.report.figures.maxent import maxent_figure
        from wearsim.report.parts.saving import save_figure

        save_figure(maxent_figure(law), figure)
    if json:
        write_json(_data(law, figure))
        return
    write_table("law of maximum entropy", _rows(law))
    typer.echo("\n".join(_plot(law)))
    for text in law.warnings:
        note(f"warning: {text}")
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


def _law(
    support: tuple[float, float], mean: float | None, std: float | None, mean_log: float | None
) -> Law:
    """Return the law, or raise with the options as they are typed."""
    from wearsim.uq.distributions.maxent import Infeasible, maximum_entropy

    try:
        return maximum_entropy(support, mean, std, mean_log)
    except Infeasible as error:
        raise Infeasible(_as_typed(str(error))) from error


def _as_typed(text: str) -> str:
    """Return a message in which knowledge is named as the options are."""
    return re.sub(r"\bmean_log\b", "--mean-log", text)


def _rows(law: Law) -> list[tuple[str, str]]:
    from wearsim.report.text import maxent_numbers

    l0, l1, l2 = (f"{value:.7g}" for value in maxent_numbers.multipliers(law))
    parent = maxent_numbers.parent(law)
    return [
        ("family", law.family),
        ("support", " to ".join(f"{end:g}" for end in law.support)),
        ("density", f"exp(-l0 - l1 x - l2 {law.third})"),
        ("l0", l0),
        ("l1", l1),
        ("l2", l2),
        ("parent normal law", _parent(parent) if parent else "none"),
        ("mean", f"{maxent_numbers.value(law, law.mean):.7g}"),
        ("standard deviation", f"{law.std:.7g}"),
        *(
            (f"{100.0 * probability:g} % quantile", f"{value:.7g}")
            for probability, value in _quantiles(law).items()
        ),
    ]


def _parent(parent: tuple[float, float]) -> str:
    return f"mean {parent[0]:.7g}, standard deviation {parent[1]:.7g}"


def _quantiles(law: Law) -> dict[float, float]:
    import numpy as np

    from wearsim.report.text.maxent_numbers import value

    values = law.quantile(np.array(PROBABILITIES)).tolist()
    return {part: value(law, found) for part, found in zip(PROBABILITIES, values, strict=True)}


def _plot(law: Law) -> list[str]:
    """Return lines that draw the density in blocks, and where it begins and ends."""
    import numpy as np

    low, high = law.bulk
    edges = np.linspace(low, high, _COLUMNS + 1)
    density = law.density(0.5 * (edges[1:] + edges[:-1]))
    eighths = np.rint(density / density.max() * 8 * _ROWS).astype(int)
    lines = [
        "  " + "".join(_BLOCKS[min(max(height - 8 * row, 0), 8)] for height in eighths).rstrip()
        for row in reversed(range(_ROWS))
    ]
    left, right = f"{low:.4g}", f"{high:.4g}"
    return [*lines, f"  {'▔' * _COLUMNS}", f"  {left}{right:>{_COLUMNS - len(left)}}"]


def _data(law: Law, figure: Path | None) -> dict[str, Any]:
    """Return the law in the unit of what was given."""
    from wearsim.report.text import maxent_numbers

    parent = maxent_numbers.parent(law)
    multipliers = maxent_numbers.multipliers(law)
    return {
        "family": law.family,
        "support": law.support,
        "multipliers": dict(zip(("l0", "l1", "l2"), multipliers, strict=True)),
        "l2_multiplies": law.third,
        "parent": parent and {"mean": parent[0], "std": parent[1]},
        "mean": maxent_numbers.value(law, law.mean),
        "std": law.std,
        "quantiles": _quantiles(law),
        "warnings": list(law.warnings),
        "figure": figure,
    }
