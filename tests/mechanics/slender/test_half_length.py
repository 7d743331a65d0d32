"""Interaction factors of half-lengths and their derivatives, interpreted, against matrices."""

from __future__ import annotations

import numpy as np
import pytest

from wearsim.mechanics.slender.half_length import (
    HIGHEST_FACTOR,
    LOWEST_FACTOR,
    REACH,
    SWEEPS,
    HalfLengths,
    add_around,
    add_length_slopes,
    fill_factor_growth,
    fill_half_lengths,
    fill_log_scales,
    find_factors,
    log_half_length,
    new_half_lengths,
)
from wearsim.mechanics.slender.influence import (
    HIGHEST,
    curvature_table,
    no_table,
    read_influence,
)

STRIPS, SPACING, MODULUS, CURVATURE = 24, 2e-4, 1.15e11, np.array([90.0, 60.0])
PLACES = np.arange(STRIPS)
TABLE, DISTANCE = curvature_table(STRIPS), np.abs(PLACES[:, None] - PLACES)
BAND = DISTANCE <= REACH
SPANS = {
    "one patch": slice(4, 19),
    "the whole track": slice(0, STRIPS),
    "narrower than the reach": slice(11, 14),
    "one strip": slice(9, 10),
    "first strips": slice(0, 7),
    "last strips": slice(16, STRIPS),
}


def new_lengths(spacing: float = SPACING) -> HalfLengths:
    lengths: HalfLengths = new_half_lengths(TABLE, 2)
    fill_log_scales(MODULUS, CURVATURE, spacing, lengths.log_scale)
    lengths.log_ratio[:], lengths.factor[:], lengths.work[:] = np.nan, np.nan, np.nan
    return lengths


def influences(log_ratio: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return weighted C of all strips, by column, and the derivative by ln q of the column."""
    value, slope = np.zeros((2, STRIPS, STRIPS))
    for j in np.flatnonzero(weight):
        one, tangent = np.empty((2, STRIPS))
        read_influence(TABLE, float(log_ratio[j]), STRIPS, one, tangent)
        value[:, j] = weight[j] * one[DISTANCE[:, j]]
        slope[:, j] = weight[j] * (tangent - one)[DISTANCE[:, j]]
    return value, slope


def factors(line_load: np.ndarray, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return s, ln(a/dy) and the derivative of ln s by ln q, 0 beyond the reach."""
    loaded, s, derivative = line_load > 0.0, np.ones(STRIPS), np.zeros((STRIPS, STRIPS))
    alone = np.log(4.0 / (np.pi * MODULUS * CURVATURE[k])) + np.log(
        np.where(loaded, line_load, 1.0)
    )
    log_ratio = np.where(loaded, 0.5 * alone - np.log(SPACING), 0.0)
    for _ in range(2):
        weight = np.where(loaded, 0.25 / s, 0.0)
        value, slope = influences(log_ratio, weight)
        total, near = value.sum(axis=1), slope * BAND
        # through the half-lengths and 1/s of the neighbours, which depend on their s
        growth = near + (near - value * BAND) @ derivative
        derivative = derivative + growth * BAND / total[:, None]
        s = np.where(loaded, np.clip(s * total, LOWEST_FACTOR, HIGHEST_FACTOR), 1.0)
        log_ratio = np.where(loaded, 0.5 * (alone + np.log(s)) - np.log(SPACING), 0.0)
    return s, log_ratio, derivative


def loads_of(span: slice) -> np.ndarray:
    """Return line loads in a span, with a strip without load inside [N/m]."""
    line_load = np.zeros((2, STRIPS))
    line_load[:, span] = 2e4 * (1.0 + np.random.default_rng(3).random((2, STRIPS))[:, span])
    if (line_load[0] > 0.0).sum() > 8:
        line_load[:, (span.start + span.stop) // 2 + 1] = 0.0
        line_load[:, [span.start, span.stop - 1]] = 0.4  # far less than others
    return line_load


@pytest.mark.parametrize("span", SPANS.values(), ids=SPANS)
@pytest.mark.parametrize("k", [0, 1])
def test_factors_and_their_slopes_are_those_of_two_sweeps(span: slice, k: int) -> None:
    line_load, lengths = loads_of(span), new_lengths()
    # a wider and a narrower contact before it leave nothing
    for other in ("the whole track", "narrower than the reach", "first strips"):
        find_factors(k, loads_of(SPANS[other]), True, SWEEPS, lengths)
    widest = find_factors(k, line_load, True, SWEEPS, lengths)
    loaded = line_load[k] > 0.0
    s, log_ratio, derivative = factors(line_load[k], k)
    np.testing.assert_allclose(lengths.factor[k], s, rtol=1e-12)
    np.testing.assert_allclose(lengths.log_ratio[k, loaded], log_ratio[loaded], rtol=1e-12)
    alone = lengths.log_scale[k] + 0.5 * np.log(line_load[k].max())
    assert widest == pytest.approx(max(log_ratio[loaded].max(), alone), rel=1e-3)
    assert widest >= max(log_ratio[loaded].max(), alone)
    for j in np.flatnonzero(loaded).tolist():
        assert log_half_length(k, j, line_load, lengths) == pytest.approx(log_ratio[j], rel=1e-12)
    found = np.zeros((STRIPS, STRIPS))
    for i in range(STRIPS):
        for c in range(max(0, i - REACH), min(STRIPS, i + REACH + 1)):
            found[i, c] = lengths.slope[k, REACH + c - i, i + 2 * REACH]
    size = np.abs(derivative).max()
    np.testing.assert_allclose(found[loaded], derivative[loaded], atol=1e-12 * size)
    first, last = PLACES[loaded][[0, -1]].tolist()
    assert not found[max(first - REACH, 0) : first].any()
    assert not found[last + 1 : last + 1 + REACH].any()
    # growth of ln s by that of ln q
    growth, result = np.zeros(STRIPS + 4 * REACH), np.full(STRIPS, np.nan)
    growth[2 * REACH : -2 * REACH] = np.where(loaded, 1e-2 * np.cos(PLACES), 0.0)
    fill_factor_growth(k, first, last, growth, lengths, result)
    expected = derivative @ growth[2 * REACH : -2 * REACH]
    np.testing.assert_allclose(result[loaded], expected[loaded], atol=1e-14 * size)
    # derivatives of displacements that depend on q through s
    lengths.near[:] = 0.0
    near = np.random.default_rng(4).random((REACH + 1, STRIPS)) * loaded
    lengths.near[: REACH + 1, 2 * REACH : -2 * REACH] = near
    across = np.where(BAND, near[np.minimum(DISTANCE, REACH), PLACES], 0.0)
    index = np.full((2, STRIPS), -1)
    index[k, loaded] = np.arange(loaded.sum())
    matrix = np.ones((STRIPS, STRIPS))
    add_length_slopes(k, line_load, index, lengths, matrix)
    reference = (across @ np.where(loaded[:, None], derivative, 0.0))[loaded][:, loaded]
    reference = 1.0 + (reference / line_load[k, loaded]).T
    count = loaded.sum()
    np.testing.assert_allclose(matrix[:count, :count], reference, rtol=1e-12)
    assert (matrix[count:] == 1.0).all()


def test_factors_are_the_same_without_slopes() -> None:
    line_load, lengths = loads_of(SPANS["one patch"]), new_lengths()
    widest, factor = find_factors(1, line_load, True, SWEEPS, lengths), lengths.factor[1].copy()
    lengths.slope[:] = 7.0
    assert find_factors(1, line_load, False, SWEEPS, lengths) == widest
    np.testing.assert_array_equal(lengths.factor[1], factor)
    assert (lengths.slope == 7.0).all()


def test_strips_that_are_too_narrow_have_no_factors() -> None:
    line_load, lengths = loads_of(SPANS["one patch"]), new_lengths(SPACING / 1000.0)
    widest = find_factors(0, line_load, True, SWEEPS, lengths)
    assert widest == pytest.approx(lengths.log_scale[0] + 0.5 * np.log(line_load[0].max()))
    assert widest > HIGHEST
    assert (lengths.factor[0] == 1.0).all()
    none = find_factors(1, np.zeros((2, STRIPS)), True, SWEEPS, lengths)
    assert none == -np.inf


def test_local_half_lengths_have_no_factors() -> None:
    line_load, lengths = loads_of(SPANS["one patch"]), new_half_lengths(no_table(STRIPS), 2)
    fill_log_scales(MODULUS, CURVATURE, SPACING, lengths.log_scale)
    for k in range(2):
        find_factors(k, line_load, True, SWEEPS, lengths)
    half_length = np.full((2, STRIPS), np.nan)
    fill_half_lengths(SPACING, line_load, lengths, half_length)
    expected = np.sqrt(4.0 * line_load / (np.pi * MODULUS * CURVATURE[:, None]))
    np.testing.assert_allclose(half_length, expected, rtol=1e-12)
    lengths.factor[:] = 0.25
    fill_half_lengths(SPACING, line_load, lengths, half_length)
    np.testing.assert_allclose(half_length, 0.5 * expected, rtol=1e-12)


@pytest.mark.parametrize(("j", "first", "last"), [(5, 2, 11), (0, 0, 7), (23, 20, 23), (6, 6, 6)])
def test_influence_is_added_on_both_sides(j: int, first: int, last: int) -> None:
    value, total = 1.0 + np.random.default_rng(5).random(STRIPS), np.ones(STRIPS)
    add_around(j, first, last, 3.0, value, total)
    inside = (first <= PLACES) & (last >= PLACES)
    np.testing.assert_allclose(total, 1.0 + 3.0 * inside * value[DISTANCE[j]], rtol=1e-14)
