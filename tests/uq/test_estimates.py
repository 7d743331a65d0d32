"""Estimates by sampling design: identities, closed forms and insufficient samples."""

import math

import numpy as np
import pytest
from scipy import stats

from wearsim.uq.estimation.estimates import DESIGNS, estimate
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.estimation.moments import summarise
from wearsim.uq.estimation.standard_errors import Control, Controlled, Independent, Replicated

PROBABILITIES = (0.025, 0.5, 0.95)


def values_of(count, seed=1):
    return np.exp(0.2 * np.random.default_rng(seed).standard_normal(count))


def given(values, plan):
    """Return the arguments that a design needs in addition to the values."""
    if plan == "sobol":
        return {"plan": plan, "replicate": np.arange(len(values)) % 8}
    if plan == "control-variate":
        # correlated with the values, but not fully
        control_values = np.arange(len(values)) % 7 + 3.0 * values
        return {"plan": plan, "control": Control(control_values, 3.0)}
    return {"plan": plan}


def ends(found):
    return [found.mean, found.std, *(interval for _, interval in found.quantiles)]


@pytest.mark.parametrize("plan", ["monte-carlo", "latin-hypercube", "saltelli"])
def test_independent_realisations_give_textbook_estimates(plan):
    values = values_of(300)
    found, known = estimate(values, PROBABILITIES, plan), summarise(values)
    low, high = stats.t.interval(0.95, 299, values.mean(), stats.sem(values))
    assert found.mean.value == pytest.approx(known.mean, rel=1e-13)
    assert [found.mean.low, found.mean.high] == pytest.approx([low, high], rel=1e-12)
    assert found.std.value == pytest.approx(known.std, rel=1e-12)
    for probability in PROBABILITIES:
        known_one = np.quantile(values, probability)
        assert found.quantile(probability).value == pytest.approx(known_one, rel=1e-12)
    assert (found.count, found.least, found.greatest) == (300, values.min(), values.max())
    assert found.variance_saved is None


def test_std_interval_converges_to_that_of_the_fourth_moment():
    values = values_of(100_000)
    found, known = estimate(values), summarise(values)
    assert found.std.half_width == pytest.approx(1.96 * known.std_error, rel=0.01)


@pytest.mark.parametrize("plan", DESIGNS)
@pytest.mark.parametrize("same", [0.1, 0.0, -3e-7])
def test_constant_values_have_intervals_of_zero_width(plan, same):
    values = np.full(30, same)
    found = estimate(values, PROBABILITIES, **given(values, plan))
    assert ends(found) == [Interval(same, same, same), Interval(0.0, 0.0, 0.0)] + 3 * [
        Interval(same, same, same)
    ]
    assert found.variance_saved is None


@pytest.mark.parametrize("plan", DESIGNS)
def test_one_value_has_no_std_and_infinite_intervals(plan):
    values = np.array([0.07])
    found = estimate(values, PROBABILITIES, **given(values, plan))
    assert found.mean == Interval(0.07, -math.inf, math.inf)
    assert math.isnan(found.std.value)
    assert (found.std.low, found.std.high) == (0.0, math.inf)
    assert [interval for _, interval in found.quantiles] == 3 * [found.mean]


@pytest.mark.parametrize("plan", DESIGNS)
def test_no_values_give_unknown_estimates(plan):
    found = estimate(np.array([]), PROBABILITIES, **given(np.array([]), plan))
    assert found.count == 0
    assert np.isnan([interval.value for interval in ends(found)]).all()
    assert np.isinf([interval.half_width for interval in ends(found)]).all()


@pytest.mark.parametrize("plan", DESIGNS)
@pytest.mark.parametrize("count", [2, 3, 4, 5, 9, 10, 33, 400])
def test_interval_contains_its_estimate(plan, count):
    values = values_of(count)
    found = estimate(values, PROBABILITIES, **given(values, plan))
    for interval in ends(found):
        assert interval.low <= interval.value <= interval.high
        assert interval.low < interval.high
    assert math.isinf(found.std.high) == (count < 5)


def test_single_deviating_value_leaves_the_std_interval_unknown():
    found = estimate(np.array([0.0] * 6 + [1.0]))
    assert found.std == Interval(pytest.approx(math.sqrt(1 / 7)), 0.0, math.inf)


def test_equal_replicates_have_the_error_of_their_means():
    values = np.random.default_rng(2).random((8, 20))
    errors = Replicated(np.repeat(np.arange(8), 20))
    assert errors.error(values.ravel()) == pytest.approx(stats.sem(values.mean(axis=1)))
    assert (errors.draws, errors.degrees) == (8, 7)


def test_replicates_of_size_one_equal_independent_realisations():
    values = values_of(8)
    errors = Replicated(np.arange(8)[::-1] * 10)
    assert errors.error(values) == pytest.approx(Independent(8, "").error(values))
    one, other = estimate(values, (), "sobol", np.arange(8)), estimate(values)
    for found, known in zip(ends(one), ends(other), strict=True):
        np.testing.assert_allclose(
            [found.value, found.low, found.high], [known.value, known.low, known.high], rtol=1e-12
        )


def test_single_replicate_gives_no_error():
    values = values_of(64)
    found = estimate(values, PROBABILITIES, "sobol", np.full(64, 3))
    assert found.mean.value == pytest.approx(values.mean())
    assert np.isinf([interval.half_width for interval in ends(found)]).all()


def test_weights_reproduce_the_control_mean_and_the_regression():
    rng = np.random.default_rng(3)
    control = rng.gamma(3.0, size=50)
    values = 2.0 * control + rng.standard_normal(50)
    errors = Controlled(Control(control, 3.0))
    assert errors.weights.sum() == pytest.approx(1.0)
    assert errors.weights @ control == pytest.approx(3.0)
    found = estimate(values, plan="control-variate", control=Control(control, 3.0))
    assert found.mean.value == pytest.approx(np.polyval(np.polyfit(control, values, 1), 3.0))
    assert found.variance_saved == pytest.approx(np.corrcoef(control, values)[0, 1] ** 2)


def test_fully_correlated_control_leaves_only_its_mean_error():
    control = np.random.default_rng(4).random(40)
    exact = estimate(5.0 + 2.0 * control, plan="control-variate", control=Control(control, 0.5))
    assert [exact.mean.low, exact.mean.high] == pytest.approx([6.0, 6.0])
    assert exact.variance_saved == pytest.approx(1.0)
    known = Control(control, 0.5, mean_error=0.01)
    rough = estimate(5.0 + 2.0 * control, plan="control-variate", control=known)
    assert rough.mean.half_width == pytest.approx(stats.t.ppf(0.975, 38) * 0.02)


@pytest.mark.parametrize(
    ("count", "control"), [(9, np.arange(9.0)), (30, np.full(30, 0.1))], ids=["few", "constant"]
)
def test_unusable_control_is_ignored_and_reported(count, control):
    values = values_of(count)
    found = estimate(values, PROBABILITIES, "control-variate", control=Control(control, 2.0))
    assert ends(found) == ends(estimate(values, PROBABILITIES))
    assert "too few or too similar" in found.method


@pytest.mark.parametrize(
    ("needs", "message"),
    [
        ({"plan": "sobol"}, "needs the replicate"),
        ({"plan": "sobol", "replicate": np.arange(3)}, "needs the replicate"),
        ({"plan": "control-variate"}, "needs the control"),
        ({"plan": "halton"}, 'unknown plan "halton", expected one of monte-carlo'),
    ],
)
def test_missing_data_of_a_design_are_refused(needs, message):
    with pytest.raises(ValueError, match=message):
        estimate(values_of(5), **needs)


def test_non_finite_values_are_refused():
    with pytest.raises(ValueError, match="2 of 3 values are not finite"):
        estimate(np.array([1.0, np.nan, np.inf]))
