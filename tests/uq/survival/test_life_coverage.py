"""Coverage of the intervals of lives with known distributions; see docs/life.md."""

import pytest

from tests.uq.survival import coverage_study

BOUNDS = ("P(B > A), two specimens", "P(B > A), same machine")


@pytest.mark.coverage
@pytest.mark.parametrize("censored", [False, True])
def test_intervals_of_36_lives_hold_the_truth(censored):
    for (what, method), case in coverage_study.study(36, censored).items():
        assert case.coverage >= (0.933 if method in {"mixture", "likelihood"} else 0.935), what
        if method in {"mixture", "likelihood"} and not (censored and what in BOUNDS):
            assert case.coverage <= 0.967, what
        if not (censored and what in BOUNDS):
            assert case.width <= 1.3, (what, method)


def test_one_sided_bound_of_29_lives_holds_the_truth():
    assert coverage_study.one_sided_coverage(29, 500) >= 0.93
