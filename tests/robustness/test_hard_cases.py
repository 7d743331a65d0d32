"""Scenes that break careless solvers: each holds all its bounds, or ends with a named cause."""

import pytest

from wearsim_bench.hard_cases.cases import SHORT, hard_cases
from wearsim_bench.hard_cases.friction_field import friction_field
from wearsim_bench.hard_cases.judgement import judged
from wearsim_bench.hard_cases.runs import Plan

pytestmark = pytest.mark.bench

CASES = {case.name: case for case in hard_cases(SHORT)}
PLAN = Plan.of(quick=True, changes={})


# a second each, and more of the bench's kernels to compile
SLOW = {
    "2000 strips",
    "creepage through zero in time",
    "friction per pass, 50 % scatter",
    "spring unloaded to nothing",
}


def test_slow_cases_are_cases():
    assert CASES.keys() >= SLOW


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name in SLOW)) for name in CASES]
)
def test_that_a_hard_case_holds(name):
    verdict = judged(CASES[name], PLAN)
    assert verdict.failures == ()


@pytest.mark.slow
def test_that_a_field_of_friction_holds():
    assert friction_field(doublings=2, realisations=5).failures == ()
