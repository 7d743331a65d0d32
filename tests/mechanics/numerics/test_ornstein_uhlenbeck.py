"""The first-order recursion."""

import numpy as np

from wearsim.mechanics.numerics.ornstein_uhlenbeck import filter_noise


def test_that_it_answers_a_unit_of_noise_with_a_geometric_fall():
    memory = 0.8
    noise = np.eye(6)
    answers = np.array([filter_noise(row.copy(), memory) for row in noise])
    steps = np.arange(6)
    np.testing.assert_allclose(answers[0], memory**steps, rtol=1e-14)
    for k in range(1, 6):
        expected = np.where(steps < k, 0.0, 0.6 * memory ** (steps - k))
        np.testing.assert_allclose(answers[k], expected, rtol=1e-14)
    # what independent noise of unit variance makes of it
    np.testing.assert_allclose(np.sum(answers**2, axis=0), 1.0, rtol=1e-14)


def test_that_a_longer_path_begins_with_the_shorter_one():
    noise = np.random.default_rng(1).normal(size=500)
    np.testing.assert_array_equal(filter_noise(noise[:123].copy(), 0.97), filter_noise(noise, 0.97)[:123])
