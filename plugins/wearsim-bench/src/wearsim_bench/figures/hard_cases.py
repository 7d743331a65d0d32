"""Markdown tables of the verdicts on hard cases."""

from __future__ import annotations

from collections.abc import Sequence

from wearsim_bench.figures.table import markdown_table
from wearsim_bench.hard_cases.verdict import CRITERIA, Criterion, Verdict


def hard_markdown(verdicts: Sequence[Verdict]) -> str:
    """Return Markdown tables of completed cases with their criteria, and of refused cases."""
    completed = [_row(verdict) for verdict in verdicts if not verdict.error]
    refused = [_refused_row(verdict) for verdict in verdicts if verdict.error]
    legend = "".join(f"- **{name}**: {text}\n" for name, text in CRITERIA.items())
    table = markdown_table(["case", "steps taken", *CRITERIA, "verdict"], completed)
    errors = markdown_table(["case", "error", "verdict"], refused)
    passed = sum(verdict.holds for verdict in verdicts)
    return (
        f"{passed} of {len(verdicts)} pass.\n\n## Completed\n\n{legend}\n{table}\n\n"
        f"## Refused or stopped with an error\n\n{errors}\n"
    )


def _row(verdict: Verdict) -> list[str]:
    steps = verdict.figures.get("steps")
    cells = [_cell(verdict.criterion(name)) for name in CRITERIA]
    return [verdict.case, "" if steps is None else f"{steps:.0f}", *cells, _word(verdict)]


def _cell(criterion: Criterion | None) -> str:
    if criterion is None:
        return ""
    text = f"{criterion.value:.1e}"
    return text if criterion.order is None else f"{text} (order {criterion.order:.1f})"


def _refused_row(verdict: Verdict) -> list[str]:
    message = verdict.error.splitlines()[0].removeprefix(f"{verdict.case}.toml: ")
    return [verdict.case, message, _word(verdict)]


def _word(verdict: Verdict) -> str:
    return "passed" if verdict.holds else "**failed**: " + "; ".join(verdict.failures)
