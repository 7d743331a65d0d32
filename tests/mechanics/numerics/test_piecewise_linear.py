"""Integrals of a quantity that is linear between samples."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from wearsim.mechanics.numerics.piecewise_linear import Paths, PiecewiseLinear


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.0, 5.0), st.floats(0.0, 5.0))
def test_mean_and_deviation_are_exact_integrals(seed, one, other):
    random = np.random.default_rng(seed)
    inner = np.array([0.0, 0.2, 1.9, 2.6, 4.5, 5.0])
    path = PiecewiseLinear(inner, random.uniform(-2.0, 3.0, 6))
    start, stop = min(one, other), max(one, other) + 1e-3
    stop = min(stop, 5.0)
    # the samples are nodes, so that the trapezoidal rule and Simpson's rule are exact
    nodes = np.unique([start, stop, *inner[(inner > start) & (inner < stop)]])
    if len(nodes) < 2 or stop - start < 1e-6:
        return
    ends, middle = path.at(nodes), path.at(0.5 * (nodes[1:] + nodes[:-1]))
    width = np.diff(nodes)
    mean = np.dot(width, 0.5 * (ends[1:] + ends[:-1])) / (stop - start)
    square = np.dot(width, (ends[1:] ** 2 + 4.0 * middle**2 + ends[:-1] ** 2) / 6.0)
    assert path.mean(start, stop) == pytest.approx(mean, abs=1e-9)
    spread = max(square / (stop - start) - mean**2, 0.0)
    assert path.deviation(start, stop) == pytest.approx(np.sqrt(spread), abs=1e-5)


def test_empty_interval_has_its_value_and_no_deviation():
    path = PiecewiseLinear(np.array([0.0, 2.0]), np.array([1.0, 5.0]))
    assert path.mean(0.5, 0.5) == 2.0
    assert path.deviation(0.5, 0.5) == 0.0
    assert path.extremes(0.5, 1.5) == (2.0, 4.0)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10**6))
def test_paths_of_realisations_are_as_those_of_single_ones(seed):
    random = np.random.default_rng(seed)
    time, value = np.array([0.0, 0.2, 1.9, 2.6, 5.0]), random.uniform(-2.0, 3.0, (4, 5))
    start = np.array([0.0, *random.uniform(0.0, 2.0, 3)])
    stop = start + np.array([0.0, 0.0, *random.uniform(0.0, 3.0, 2)])
    paths = Paths.joined([Paths.through(time, value[:1]), Paths.through(time, value[1:])])
    single = [PiecewiseLinear(time, row) for row in value]
    for name in ("mean", "deviation"):
        expected = [
            getattr(path, name)(*span) for path, *span in zip(single, start, stop, strict=True)
        ]
        np.testing.assert_allclose(getattr(paths, name)(start, stop), expected, atol=1e-7)
        chosen = np.array([2, 0, 2])
        some = getattr(paths.at(chosen), name)(start[chosen], stop[chosen])
        np.testing.assert_array_equal(some, getattr(paths, name)(start, stop)[chosen])
    np.testing.assert_array_equal(paths.at(np.array([3])).of_first(start), single[3].at(start))
