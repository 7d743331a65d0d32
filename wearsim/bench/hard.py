"""Hard cases and their verdicts: balances, smoothness, convergence, symmetry; or a named cause."""

from __future__ import annotations

from wearsim.bench.hard_cases import hard_cases
from wearsim.bench.hard_field import NAME as FIELD
from wearsim.bench.hard_field import friction_field
from wearsim.bench.hard_judging import judged
from wearsim.bench.hard_runs import Plan
from wearsim.bench.hard_verdict import CHECKS, Check, Verdict
from wearsim.bench.measured import Effort, Tell

_REALISATIONS = {True: 5, False: 40}


def hard(effort: Effort, tell: Tell) -> tuple[Verdict, ...]:
    """Run every hard case and return the verdicts.

    Parameters
    ----------
    effort : Effort
        Quick: short tests on few strips; with a plugin all cases run with that contact model.
    tell : callable
        Told which case is run, and which part of them is done.
    """
    changes = {} if effort.plugin is None else {"contact.model": effort.plugin}
    plan = Plan.of(effort.quick, changes)
    cases = hard_cases(plan.passes)
    found = []
    for number, case in enumerate(cases):
        tell(case.name, number / (len(cases) + 1))
        found.append(judged(case, plan))
    if effort.plugin is None:
        tell(FIELD, len(cases) / (len(cases) + 1))
        found.append(friction_field(plan.doublings, _REALISATIONS[effort.quick]))
    tell("", 1.0)
    return tuple(found)


def hard_markdown(verdicts: tuple[Verdict, ...]) -> str:
    """Return the verdicts as Markdown: what ran with its numbers, and what was refused.

    Parameters
    ----------
    verdicts : tuple of Verdict
    """
    ran = [verdict for verdict in verdicts if not verdict.said]
    refused = [verdict for verdict in verdicts if verdict.said]
    legend = "".join(f"- **{name}**: {text}\n" for name, text in CHECKS.items())
    head = "| case | steps taken | " + " | ".join(CHECKS) + " | verdict |"
    rule = "|---" * (len(CHECKS) + 3) + "|"
    table = "\n".join([head, rule, *map(_row, ran)])
    errors = "\n".join(
        ["| case | it says | verdict |", "|---|---|---|", *map(_refused_row, refused)]
    )
    good = sum(verdict.holds for verdict in verdicts)
    return (
        f"{good} of {len(verdicts)} hold.\n\n## Run to their end\n\n{legend}\n{table}\n\n"
        f"## Refused, or stopped with a cause\n\n{errors}\n"
    )


def _row(verdict: Verdict) -> str:
    steps = verdict.figures.get("steps")
    cells = [verdict.case, "" if steps is None else f"{steps:.0f}"]
    cells += [_cell(verdict.check(name)) for name in CHECKS]
    return "| " + " | ".join([*cells, _word(verdict)]) + " |"


def _cell(check: Check | None) -> str:
    if check is None:
        return ""
    text = f"{check.value:.1e}"
    return text if check.order is None else f"{text} (order {check.order:.1f})"


def _refused_row(verdict: Verdict) -> str:
    said = verdict.said.splitlines()[0].removeprefix(f"{verdict.case}.toml: ").replace("|", "/")
    return f"| {verdict.case} | {said} | {_word(verdict)} |"


def _word(verdict: Verdict) -> str:
    return "holds" if verdict.holds else "**does not hold**: " + "; ".join(verdict.failures)
