"""Hard cases for solvers: each meets all its bounds, or ends with a specific error."""

from dataclasses import dataclass, field

import pytest

from wearsim.studies.run.result import Result
from wearsim_bench.hard_cases.cases import SHORT, hard_cases
from wearsim_bench.hard_cases.evaluation import evaluate
from wearsim_bench.hard_cases.friction_field import friction_field
from wearsim_bench.hard_cases.runs import Plan

CASES = {case.name: case for case in hard_cases(SHORT)}


@dataclass(frozen=True)
class FewerRuns(Plan):
    """Plan by which the run with the coarsest steps and strips is done once for every case.

    The mirrored run has no error due to its strips, which no bound depends on.
    """

    done: dict[tuple[object, ...], Result] = field(default_factory=dict)

    def run(self, case, **further):
        step, strips = further.get("evolution__step"), further.get("contact__strips", case.strips)
        if step is None:
            return super().run(case, **further)
        if (step, strips) not in self.done:
            self.done[step, strips] = super().run(case, **further)
        return self.done[step, strips]

    def scenario(self, case, **further):
        if further.keys() == {"evolution__step"}:  # of the mirrored run
            further["evolution__strip_error"] = False
        return super().scenario(case, **further)


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
    verdict = evaluate(CASES[name], FewerRuns.of(quick=True, changes={}))
    assert verdict.failures == ()


@pytest.mark.slow
def test_friction_field_meets_its_bounds():
    assert friction_field(doublings=2, realisations=5).failures == ()
