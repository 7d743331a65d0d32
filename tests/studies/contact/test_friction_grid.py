"""Grid dependence of random friction, as in the figure of the documentation."""

import itertools

import pytest

from tests.benchmarks.friction_grid import FIELDS, draw, mean_power

GAUSSIAN, CARRIED, WHITE = FIELDS
# points along a strip and the mean power of white friction there, from an independent program
FALLING = {25: 0.0689, 50: 0.0653, 100: 0.0614, 200: 0.0569, 400: 0.0527, 800: 0.0487}


@pytest.mark.parametrize(("points", "expected"), FALLING.items())
def test_white_friction_power_decreases_with_refinement(points, expected):
    mean, _ = mean_power(WHITE, points, 30)
    assert mean == pytest.approx(expected, rel=0.012)


def test_gaussian_field_converges_with_the_grid():
    means = [mean_power(GAUSSIAN, points, 30)[0] for points in (25, 50, 100, 200)]
    changes = [abs(after - before) for before, after in itertools.pairwise(means)]
    assert changes[0] < 0.003 * means[-1]
    # second order: the change is a quarter after every doubling
    assert changes[1] < 0.4 * changes[0]
    assert changes[2] < 0.4 * changes[1]


def test_white_friction_fixed_to_a_body_converges():
    coarse, fine = (mean_power(CARRIED, points, 10)[0] for points in (25, 100))
    assert coarse == pytest.approx(fine, rel=3e-3)
    assert fine > 0.98 * mean_power(GAUSSIAN, 50, 30)[0]


def test_figure_is_drawn(tmp_path, monkeypatch):
    monkeypatch.setattr("tests.benchmarks.friction_grid.POINTS", (25, 50))
    draw(tmp_path / "fields.png", 3)
    assert (tmp_path / "fields.png").stat().st_size > 10_000
