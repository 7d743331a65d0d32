"""Sobol indices against closed forms: Ishigami, Sobol's g, sums, products and groups."""

import math

import numpy as np
import pytest

from wearsim.uq.estimation.intervals import UNKNOWN, Interval
from wearsim.uq.sensitivity.sobol_indices import first_order, saltelli_indices, without_effect

NONE = Interval(0.0, 0.0, 0.0)


def ishigami(x):
    """Return values from uniform numbers between -pi and pi; a = 7, b = 0.1."""
    one, two, three = x.T
    return np.sin(one) + 7.0 * np.sin(two) ** 2 + 0.1 * three**4 * np.sin(one)


def ishigami_indices():
    """Return first-order and total indices."""
    alone = 0.5 * (1.0 + 0.1 * math.pi**4 / 5.0) ** 2
    second = 7.0**2 / 8.0
    both = 0.1**2 * math.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    variance = alone + second + both
    first = np.array([alone, second, 0.0]) / variance
    return first, first + np.array([both, 0.0, both]) / variance


GAINS = np.array([0.0, 1.0, 4.5, 9.0])


def sobol_g(x):
    """Return values from uniform numbers between 0 and 1."""
    return np.prod((np.abs(4.0 * x - 2.0) + GAINS) / (1.0 + GAINS), axis=1)


def sobol_g_indices():
    parts = 1.0 / (3.0 * (1.0 + GAINS) ** 2)
    variance = np.prod(1.0 + parts) - 1.0
    return parts / variance, parts * np.prod(1.0 + parts) / (1.0 + parts) / variance


SLOPES = np.array([1.0, 0.5, 0.2, 0.0])


def line(x):
    return x @ SLOPES


def line_indices():
    parts = SLOPES**2 / (SLOPES**2).sum()
    return parts, parts


def interaction(x):
    return (2.0 * x[:, 0] - 1.0) * (2.0 * x[:, 1] - 1.0)


def interaction_indices():
    return np.zeros(2), np.ones(2)


def shifted_ishigami(x):
    return ishigami(math.pi * (2.0 * x - 1.0))


CASES = {
    "ishigami": (shifted_ishigami, ishigami_indices),
    "g": (sobol_g, sobol_g_indices),
    "line": (line, line_indices),
    "interaction": (interaction, interaction_indices),
}


def by_column(x):
    return {str(k): x[:, k : k + 1] for k in range(x.shape[1])}


@pytest.mark.parametrize("case", ["ishigami", "g", "line"])
def test_first_order_indices_agree_with_closed_forms(case):
    function, indices = CASES[case]
    known = indices()[0]
    x = np.random.default_rng(1).random((4000, len(known)))
    found = first_order(function(x), by_column(x))
    for k, index in enumerate(known):
        assert found[str(k)].value == pytest.approx(index, abs=0.03)
        assert found[str(k)].half_width < 0.03


def intervals_hold(draw, repeats, seed):
    """Return the coverage of the interval of the index that `draw` returns."""
    rng, held = np.random.default_rng(seed), 0
    for _ in range(repeats):
        values, numbers, known = draw(rng)
        found = first_order(values, {"it": numbers})["it"]
        held += found.low <= known <= found.high
    return held / repeats


def second_of_line(rng):
    x = rng.standard_normal((300, 4))
    return line(x), x[:, 1:2], SLOPES[1] ** 2 / (SLOPES**2).sum()


def second_of_ishigami(rng):
    x = rng.random((300, 3))
    return shifted_ishigami(x), x[:, 1:2], ishigami_indices()[0][1]


def misalignment(rng):
    """Return a depth that decreases with the misalignment of a roller, and the two angles."""
    angles, other = rng.standard_normal((400, 2)), rng.standard_normal(400)
    share = 4 * 0.1**2 / (4 * 0.1**2 + 0.2**2)
    return 1.0 - 0.1 * (angles**2).sum(axis=1) + 0.2 * other, angles, share


def without_influence(rng):
    return rng.standard_normal(400), rng.standard_normal((400, 3)), 0.0


@pytest.mark.parametrize("draw", [second_of_line, second_of_ishigami, misalignment])
def test_first_order_intervals_have_their_coverage(draw):
    assert 0.90 <= intervals_hold(draw, 100, 2) <= 0.99


def test_missing_effect_is_rarely_significant():
    assert intervals_hold(without_influence, 100, 3) >= 0.95
    rng = np.random.default_rng(4)
    x = rng.standard_normal((2000, 3))
    found = first_order(np.exp(0.3 * x[:, 0]), by_column(x))
    assert [without_effect(found[name]) for name in "012"] == [False, True, True]


def test_symmetric_effect_without_correlation_is_detected():
    angles = np.random.default_rng(5).standard_normal((500, 1))
    values = 1.0 - 0.05 * angles[:, 0] ** 2
    assert abs(np.corrcoef(angles[:, 0], values)[0, 1]) < 0.1
    assert first_order(values, {"yaw": angles})["yaw"].value > 0.98


def test_interaction_within_a_group_is_detected():
    x = np.random.default_rng(6).standard_normal((1000, 2))
    found = first_order(x[:, 0] * x[:, 1], {"one": x[:, :1], "both": x})
    assert found["both"].value > 0.97
    # the mean of a product does not depend on one factor, only its variance does
    assert found["one"].low == 0.0


def test_group_of_six_numbers_needs_few_realisations():
    x = np.random.default_rng(7).standard_normal((600, 6))
    other = np.random.default_rng(8).standard_normal(600)
    values = (x**2).sum(axis=1) + math.sqrt(12.0) * other
    found = first_order(values, {"rollers": x})["rollers"]
    assert found.low <= 0.5 <= found.high
    assert found.half_width < 0.1


def test_constant_numbers_have_no_effect():
    x = np.random.default_rng(9).random((100, 1))
    constant = np.full((100, 2), 0.3)
    assert first_order(x[:, 0], {"constant": constant})["constant"] == NONE
    assert first_order(np.full(100, 0.1), {"x": x, "constant": constant}) == {
        "x": NONE,
        "constant": NONE,
    }
    # a constant or repeated column does not change the index
    alone = first_order(x[:, 0], {"x": x})["x"]
    assert first_order(x[:, 0], {"x": np.hstack([constant, x, x])})["x"] == alone


def test_discrete_numbers_have_the_correct_index():
    rng = np.random.default_rng(10)
    kind = rng.integers(0, 2, (2000, 1)).astype(float)
    values = kind[:, 0] + 0.5 * rng.standard_normal(2000)
    found = first_order(values, {"kind": kind})["kind"]
    assert found.low <= 0.5 <= found.high


@pytest.mark.parametrize("count", [0, 1, 2, 23])
def test_too_few_realisations_are_unknown(count):
    x = np.random.default_rng(11).random((count, 1))
    assert first_order(x[:, 0], {"x": x})["x"] == UNKNOWN


def test_non_finite_realisations_are_refused():
    x = np.random.default_rng(12).random((50, 1))
    wrong = np.where(x > 0.5, np.nan, x)
    with pytest.raises(ValueError, match="leave out failed realisations"):
        first_order(wrong[:, 0], {"x": x})
    with pytest.raises(ValueError, match="some of x are not"):
        first_order(x[:, 0], {"x": wrong})


def saltelli_blocks(function, groups, bases, rng):
    base, other = rng.random((2, bases, groups))
    values = [function(base), function(other)]
    for k in range(groups):
        mixed = base.copy()
        mixed[:, k] = other[:, k]
        values.append(function(mixed))
    return np.stack(values, axis=1)


@pytest.mark.parametrize("case", list(CASES))
def test_saltelli_indices_agree_with_closed_forms(case):
    function, indices = CASES[case]
    known = np.stack(indices(), axis=1)
    names = [str(k) for k in range(len(known))]
    rng, held = np.random.default_rng(13), np.zeros(known.shape)
    for _ in range(100):
        blocks = saltelli_blocks(function, len(known), 300, rng)
        found = saltelli_indices(blocks, names)
        for k, name in enumerate(names):
            held[k] += [
                part.low - 1e-12 <= exact <= part.high + 1e-12
                for part, exact in zip(found[name], known[k], strict=True)
            ]
    assert (held >= 0.89 * 100).all(), held
    large = saltelli_blocks(function, len(known), 20_000, rng)
    for name, (first, total) in zip(names, known, strict=True):
        found = saltelli_indices(large, names)[name]
        assert [part.value for part in found] == pytest.approx([first, total], abs=0.03)


def test_group_without_effect_has_zero_indices():
    blocks = saltelli_blocks(line, 4, 50, np.random.default_rng(14))
    assert saltelli_indices(blocks, "abcd")["d"] == (NONE, NONE)
    assert saltelli_indices(np.full((50, 3), 0.1), ["a"]) == {"a": (NONE, NONE)}


def test_rows_with_a_failed_value_are_left_out():
    blocks = saltelli_blocks(line, 4, 50, np.random.default_rng(15))
    failed = blocks.copy()
    failed[7, 3] = failed[20, 0] = np.nan
    whole = np.delete(blocks, [7, 20], axis=0)
    assert saltelli_indices(failed, "abcd") == saltelli_indices(whole, "abcd")
    assert saltelli_indices(blocks[:9], "abcd") == dict.fromkeys("abcd", (UNKNOWN, UNKNOWN))
