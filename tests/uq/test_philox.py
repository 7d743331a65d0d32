"""Addressed random numbers."""

import itertools

import numpy as np
import pytest
from scipy import stats

from wearsim.uq.sampling.sobol import Stream


@pytest.mark.parametrize("cuts", [[1, 2, 3, 5, 8, 13, 21, 40], [4, 8, 40], [39]])
def test_words_are_independent_of_the_batch_size(cuts):
    stream = Stream(7, "load.normal_force")
    whole = stream.words(3, 40, realisation=2, block=1)
    edges = [0, *(cut for cut in cuts if cut < 40), 40]
    parts = [
        stream.words(3 + start, stop - start, realisation=2, block=1)
        for start, stop in itertools.pairwise(edges)
    ]
    np.testing.assert_array_equal(np.concatenate(parts), whole)


def test_every_part_of_the_address_changes_the_words():
    at = {"first": 0, "count": 8, "realisation": 0, "block": 0}
    draws = [
        Stream(1, "a").words(**at),
        Stream(2, "a").words(**at),
        Stream(1, "b").words(**at),
        Stream(1, "a", "pass").words(**at),
        Stream(1, "a").words(**{**at, "realisation": 1}),
        Stream(1, "a").words(**{**at, "block": 1}),
        Stream(1, "a").words(**{**at, "first": 8}),
        Stream(1, "a").words(**{**at, "first": 2**62}),
    ]
    assert len(np.unique(np.concatenate(draws))) == 8 * len(draws)


@pytest.mark.parametrize("word", [0, 2**64 - 1])
def test_extreme_words_give_numbers_strictly_between_0_and_1(monkeypatch, word):
    monkeypatch.setattr(Stream, "words", lambda *_: np.array([word], dtype=np.uint64))
    uniform = Stream(1, "a").uniforms(0, 1)[0]
    assert 0.0 < uniform < 1.0
    assert min(uniform, 1.0 - uniform) == 2.0**-53


def test_numbers_are_uniform_and_uncorrelated():
    stream = Stream(3, "friction.coefficient")
    grid = np.array([stream.uniforms(0, 100, realisation=k) for k in range(100)])
    assert stats.kstest(grid.ravel(), "uniform").pvalue > 1e-4
    centred = (grid - 0.5) * np.sqrt(12.0)
    for neighbours in (centred[1:] * centred[:-1], centred[:, 1:] * centred[:, :-1]):
        assert abs(neighbours.mean()) < 4.0 / np.sqrt(neighbours.size)
