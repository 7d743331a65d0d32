"""Hard cases for solvers: each meets all its bounds, or ends with a specific error."""

import pytest

from wearsim_bench.hard_cases.cases import SHORT, hard_cases
from wearsim_bench.hard_cases.evaluation import evaluate
from wearsim_bench.hard_cases.friction_field import friction_field
from wearsim_bench.hard_cases.runs import Plan

CASES = {case.name: case for case in hard_cases(SHORT)}
PLAN = Plan.of(quick=True, changes={})


# these take more than a second each and compile further kernels
SLOW = {
    "2000 strips",
    "creepage through zero in time",
    "friction per pass, 50 % scatter",
    "spring unloaded to zero",
}


def test_slow_cases_exist():
    assert CASES.keys() >= SLOW


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name in SLOW)) for name in CASES]
)
def test_hard_case_meets_its_bounds(name):
    verdict = evaluate(CASES[name], PLAN)
    assert verdict.failures == ()


@pytest.mark.slow
def test_friction_field_meets_its_bounds():
    assert friction_field(doublings=2, realisations=5).failures == ()
