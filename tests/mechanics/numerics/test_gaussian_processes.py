"""Smoothing of lattice noise against the plain sum, its correlation, and the recursion in time."""

import numpy as np
import pytest

from wearsim.mechanics.numerics.gaussian_processes import (
    CELLS,
    REACH,
    filter_noise,
    smooth,
    squared_residuals,
)

LENGTH = 50e-6
SPACING = LENGTH / 2.0


def weights(x, y, rows, columns):
    """Return the normalised weights of all nodes at one point by the plain formula."""
    node_y, node_x = SPACING * rows[:, None], SPACING * columns
    weight = np.exp(-2.0 * ((x - node_x) ** 2 + (y - node_y) ** 2) / LENGTH**2)
    for nodes, place, axis in ((rows, y, 0), (columns, x, 1)):
        low = np.floor(place / SPACING) - REACH + 1
        inside = (nodes >= low) & (nodes < low + CELLS)
        weight = weight * np.expand_dims(inside, 1 - axis)
    return weight / np.sqrt(np.sum(weight**2))


@pytest.fixture
def lattice():
    """Return rows and columns of a lattice on both sides of the origin."""
    return np.arange(-12, 16), np.arange(-14, 13)


def test_field_is_the_normalised_sum_over_cells_in_reach(lattice):
    rows, columns = lattice
    random = np.random.default_rng(1)
    noise = random.normal(size=(len(rows), len(columns)))
    y = SPACING * random.uniform(-7.0, 9.0, size=5)
    x = SPACING * random.uniform(-9.0, 7.0, size=(4, 5))
    y[0], x[0, 0] = 0.0, -3.0 * SPACING  # on a node
    field = smooth(x, y, noise, rows[0], columns[0], SPACING)
    expected = [
        [np.sum(weights(x[p, i], y[i], rows, columns) * noise) for i in range(5)] for p in range(4)
    ]
    np.testing.assert_allclose(field, expected, rtol=0.0, atol=1e-12)


def responses(x, y, lattice):
    """Return the field for a unit of noise in each cell, shape (points, cells)."""
    rows, columns = lattice
    made = []
    for cell in range(len(rows) * len(columns)):
        noise = np.zeros(len(rows) * len(columns))
        noise[cell] = 1.0
        grid = noise.reshape(len(rows), len(columns))
        made.append(np.diag(smooth(x, y, grid, rows[0], columns[0], SPACING)))
    return np.array(made).T


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.0, 1.0), (0.6, 0.8)])
def test_field_has_unit_variance_and_gaussian_correlation(lattice, direction):
    distance = LENGTH * np.array([0.0, 0.25, 0.5, 1.0, 1.5, 2.0])
    for start in (0.0, 0.17, 0.5):
        # strip i holds point i, so that the diagonal walks along the direction
        y = LENGTH * start - 0.5 * LENGTH + direction[1] * distance
        x = np.tile((LENGTH * start - LENGTH + direction[0] * distance)[:, None], (1, 6))
        response = responses(x, y, lattice)
        np.testing.assert_allclose(np.sum(response**2, axis=1), 1.0, rtol=1e-12)
        np.testing.assert_allclose(
            response @ response[0], np.exp(-((distance / LENGTH) ** 2)), atol=3e-4
        )


def test_field_value_does_not_depend_on_the_grid(lattice):
    rows, columns = lattice
    noise = np.random.default_rng(2).normal(size=(len(rows), len(columns)))
    y = SPACING * np.linspace(-5.0, 5.0, 7)
    x = SPACING * np.repeat(np.linspace(-8.0, 6.0, 9)[:, None], 7, axis=1)
    whole = smooth(x, y, noise, rows[0], columns[0], SPACING)
    fewer = smooth(
        np.ascontiguousarray(x[::3, 2:5]), y[2:5].copy(), noise, rows[0], columns[0], SPACING
    )
    np.testing.assert_array_equal(fewer, whole[::3, 2:5])
    # the position of the rectangle of noise does not matter either
    cut = smooth(x, y, np.ascontiguousarray(noise[2:, 1:]), rows[2], columns[1], SPACING)
    np.testing.assert_array_equal(cut, whole)


def test_impulse_response_of_the_process_is_geometric():
    memory = 0.8
    noise = np.eye(6)
    answers = np.array([filter_noise(row.copy(), memory) for row in noise])
    steps = np.arange(6)
    np.testing.assert_allclose(answers[0], memory**steps, rtol=1e-14)
    for k in range(1, 6):
        expected = np.where(steps < k, 0.0, 0.6 * memory ** (steps - k))
        np.testing.assert_allclose(answers[k], expected, rtol=1e-14)
    # variance for independent noise of unit variance
    np.testing.assert_allclose(np.sum(answers**2, axis=0), 1.0, rtol=1e-14)


def test_longer_path_begins_with_the_shorter_one():
    noise = np.random.default_rng(1).normal(size=500)
    np.testing.assert_array_equal(
        filter_noise(noise[:123].copy(), 0.97), filter_noise(noise, 0.97)[:123]
    )


def test_squared_residuals_are_those_of_whitened_columns_without_their_lines():
    rng, points, models = np.random.default_rng(5), 7, 2
    columns = rng.standard_normal((3, points))
    decay, gain, scale = rng.random((3, points, models)) + 0.2
    lines = np.stack(
        [np.linalg.qr(rng.standard_normal((points, 2)))[0].T for _ in range(models)], axis=2
    )
    found = squared_residuals(columns, decay, gain, scale, lines)
    for m in range(models):
        for c, column in enumerate(columns):
            mean, white = 0.0, []
            for j, value in enumerate(column):
                error = value - mean
                white.append(scale[j, m] * error)
                mean = decay[j, m] * (mean + gain[j, m] * error)
            left = np.array(white) - lines[:, :, m].T @ (lines[:, :, m] @ white)
            assert found[m, c] == pytest.approx(left @ left, rel=1e-12)
