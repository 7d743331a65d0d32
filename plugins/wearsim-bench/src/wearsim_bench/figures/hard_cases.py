"""The verdicts on hard cases as Markdown."""

from __future__ import annotations

from collections.abc import Sequence

from wearsim_bench.figures.table import markdown_table
from wearsim_bench.hard_cases.verdict import CHECKS, Check, Verdict


def hard_markdown(verdicts: Sequence[Verdict]) -> str:
    """Return the verdicts as Markdown: what ran with its numbers, and what was refused.

    Parameters
    ----------
    verdicts : sequence of Verdict
    """
    ran = [_row(verdict) for verdict in verdicts if not verdict.said]
    refused = [_refused_row(verdict) for verdict in verdicts if verdict.said]
    legend = "".join(f"- **{name}**: {text}\n" for name, text in CHECKS.items())
    table = markdown_table(["case", "steps taken", *CHECKS, "verdict"], ran)
    errors = markdown_table(["case", "it says", "verdict"], refused)
    good = sum(verdict.holds for verdict in verdicts)
    return (
        f"{good} of {len(verdicts)} hold.\n\n## Run to their end\n\n{legend}\n{table}\n\n"
        f"## Refused, or stopped with a cause\n\n{errors}\n"
    )


def _row(verdict: Verdict) -> list[str]:
    steps = verdict.figures.get("steps")
    checks = [_cell(verdict.check(name)) for name in CHECKS]
    return [verdict.case, "" if steps is None else f"{steps:.0f}", *checks, _word(verdict)]


def _cell(check: Check | None) -> str:
    if check is None:
        return ""
    text = f"{check.value:.1e}"
    return text if check.order is None else f"{text} (order {check.order:.1f})"


def _refused_row(verdict: Verdict) -> list[str]:
    said = verdict.said.splitlines()[0].removeprefix(f"{verdict.case}.toml: ")
    return [verdict.case, said, _word(verdict)]


def _word(verdict: Verdict) -> str:
    return "holds" if verdict.holds else "**does not hold**: " + "; ".join(verdict.failures)
