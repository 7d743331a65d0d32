"""Hard cases and their verdicts."""

from __future__ import annotations

from wearsim_bench.hard_cases.cases import hard_cases
from wearsim_bench.hard_cases.evaluation import evaluate
from wearsim_bench.hard_cases.friction_field import NAME as FIELD, friction_field
from wearsim_bench.hard_cases.runs import Plan
from wearsim_bench.hard_cases.verdict import Verdict
from wearsim_bench.measure.measurement import Effort, OnProgress

_REALISATIONS = {True: 5, False: 40}


def hard(effort: Effort, on_progress: OnProgress) -> tuple[Verdict, ...]:
    """Run all hard cases and return the verdicts.

    Parameters
    ----------
    effort : Effort
        With `quick`, short tests on few strips; with `plugin`, all cases use this contact model.
    on_progress : callable
        Called with the name of the case and the completed fraction.
    """
    changes = {} if effort.plugin is None else {"contact.model": effort.plugin}
    plan = Plan.of(effort.quick, changes)
    cases = [
        case
        for case in hard_cases(plan.passes)
        if effort.plugin is None or not case.of_default_model
    ]
    verdicts = []
    for number, case in enumerate(cases):
        on_progress(case.name, number / (len(cases) + 1))
        verdicts.append(evaluate(case, plan))
    if effort.plugin is None:
        on_progress(FIELD, len(cases) / (len(cases) + 1))
        verdicts.append(friction_field(plan.doublings, _REALISATIONS[effort.quick]))
    on_progress("", 1.0)
    return tuple(verdicts)
