"""Hard cases and their verdicts: balances, smoothness, convergence, symmetry; or a named cause."""

from __future__ import annotations

from wearsim_bench.hard_cases.cases import hard_cases
from wearsim_bench.hard_cases.friction_field import NAME as FIELD
from wearsim_bench.hard_cases.friction_field import friction_field
from wearsim_bench.hard_cases.judgement import judged
from wearsim_bench.hard_cases.runs import Plan
from wearsim_bench.hard_cases.verdict import Verdict
from wearsim_bench.measure.measurement import Effort, Tell

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
    every = hard_cases(plan.passes)
    cases = [case for case in every if effort.plugin is None or not case.of_default_model]
    found = []
    for number, case in enumerate(cases):
        tell(case.name, number / (len(cases) + 1))
        found.append(judged(case, plan))
    if effort.plugin is None:
        tell(FIELD, len(cases) / (len(cases) + 1))
        found.append(friction_field(plan.doublings, _REALISATIONS[effort.quick]))
    tell("", 1.0)
    return tuple(found)
