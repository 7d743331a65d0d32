"""Rank correlations by a Gaussian copula."""

import numpy as np
import pytest
from scipy import stats

from wearsim.uq.sampling.sampler import GaussianCopula, Sampler

NAMES = ("a", "b", "c", "d")
COUNT = 20_000


def sampled(correlations, names=NAMES, plan="monte-carlo"):
    inputs = [(name, 1) for name in names]
    drawn = Sampler(8, inputs, plan, COUNT, correlations).uniforms(0, COUNT)
    return {name: array[:, 0] for name, array in drawn.items()}


@pytest.mark.parametrize(
    "wanted",
    [
        {("a", "b"): 0.5},
        {("b", "a"): -0.95},
        {("a", "b"): 0.9, ("c", "b"): -0.5, ("a", "c"): -0.3},
        {("a", "c"): 0.7, ("d", "b"): -0.2},
    ],
)
def test_rank_correlations_are_met_and_marginals_kept(wanted):
    drawn = sampled([(*pair, rank) for pair, rank in wanted.items()])
    for i, first in enumerate(NAMES):
        assert stats.kstest(drawn[first], "uniform").pvalue > 1e-4
        for second in NAMES[i + 1 :]:
            rank = wanted.get((first, second), wanted.get((second, first), 0.0))
            found = stats.spearmanr(drawn[first], drawn[second]).statistic
            assert found == pytest.approx(rank, abs=4.0 / np.sqrt(COUNT))


@pytest.mark.parametrize("plan", ["monte-carlo", "latin-hypercube", "sobol"])
def test_uncorrelated_inputs_are_unchanged(plan):
    free, correlated = sampled([], plan=plan), sampled([("d", "b", 0.4)], plan=plan)
    for name in ("a", "b", "c"):  # b precedes d by name and keeps its numbers
        np.testing.assert_array_equal(free[name], correlated[name])
    assert (free["d"] != correlated["d"]).all()


def test_correlated_groups_are_independent_of_each_other():
    alone = sampled([("a", "b", 0.4)])
    both = sampled([("c", "d", 0.7), ("a", "b", 0.4)])
    for name in ("a", "b"):
        np.testing.assert_array_equal(alone[name], both[name])


def test_correlated_numbers_stay_strictly_between_0_and_1():
    copula = GaussianCopula([("a", "b", 0.7)], {"a": 1, "b": 1})
    ends = np.array([[2.0**-53], [1.0 - 2.0**-53]])
    correlated = copula.correlate({"a": ends, "b": ends})["b"]
    assert ((correlated > 0.0) & (correlated < 1.0)).all()


@pytest.mark.parametrize(
    ("correlations", "message"),
    [
        ([("a", "z", 0.1)], 'cannot correlate "z": no such input, the inputs are a, b, c, two'),
        ([("a", "two", 0.1)], "cannot correlate two: one draw takes 2 numbers"),
        ([("a", "a", 0.1)], "cannot correlate a with itself"),
        ([("a", "b", 1.2)], "of a with b must be in -1 to 1, got 1.2"),
        ([("a", "b", float("nan"))], "must be in -1 to 1, got nan"),
        ([("a", "b", 0.1), ("b", "a", 0.1)], "of b with a is given twice"),
        ([("a", "b", 1.0)], r"not positive definite \(a with b: 1\)"),
        (
            [("a", "b", 0.9), ("b", "c", 0.9), ("a", "c", -0.9)],
            r"not positive definite \(a with b: 0.9, b with c: 0.9, a with c: -0.9\)",
        ),
    ],
)
def test_invalid_correlations_are_refused(correlations, message):
    with pytest.raises(ValueError, match=message):
        GaussianCopula(correlations, {"a": 1, "b": 1, "c": 1, "two": 2})
