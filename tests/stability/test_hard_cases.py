"""Scenes that break careless solvers: each holds all its bounds, or ends with a named cause."""

import pytest

from wearsim.bench.hard_cases import SHORT, hard_cases
from wearsim.bench.hard_field import friction_field
from wearsim.bench.hard_judging import judged
from wearsim.bench.hard_runs import Plan

CASES = {case.name: case for case in hard_cases(SHORT)}
PLAN = Plan.of(quick=True, changes={})


@pytest.mark.parametrize("name", list(CASES))
def test_that_a_hard_case_holds(name):
    verdict = judged(CASES[name], PLAN)
    assert verdict.failures == ()


def test_that_a_field_of_friction_holds():
    assert friction_field(doublings=2, realisations=5).failures == ()
