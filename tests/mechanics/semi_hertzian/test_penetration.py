"""Minima of gaps, first contact points and displacements, interpreted, by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from wearsim.mechanics.semi_hertzian.penetration import (
    contact_levels,
    contact_places,
    displacement_at,
    first_contacts,
)
from wearsim.mechanics.slender.influence import HIGHEST, influence_table, read_value


@pytest.mark.parametrize(
    ("gap", "minima"),
    [
        ([3, 1, 1, 1, 2, 0, 5, 4], [(2, 2), (5, 5), (7, 7)]),
        ([1, 1, 2, 2, 1, 1], [(0, 1), (4, 5)]),
        ([2, 2, 2, 2], [(1, 2)]),
        ([0, 1, 0], [(0, 0), (2, 2)]),
        ([5, 4, 4, 3, 6], [(3, 3)]),
    ],
)
def test_minima_have_one_or_two_strips_in_their_middle(gap: list, minima: list) -> None:
    places = np.full((len(gap), 2), -1)
    count = first_contacts(np.array(gap, float), places)
    assert [tuple(pair) for pair in places[:count].tolist()] == minima


def test_first_contact_point_is_the_mean_by_the_depth_below_the_level() -> None:
    gap = np.array([9.0, 2.0, 1.0, 3.0, 9.0, 1.0, 9.0, 5.0])
    places, points = np.zeros((8, 2), np.int64), np.zeros(8)
    count = first_contacts(gap, places)
    assert count == 3
    found = contact_places(gap, places, count, 4.0, points)
    # shares 3/4, 1 and 1/2 of the strips 1 to 3 about the first one; 5 alone; 7 is higher
    assert found == 2
    mean = (0.75 * 1 + 1.0 * 2 + 0.5 * 3) / 2.25
    assert points[:2] == pytest.approx([mean, 5.0])
    flat = np.array([4.0, 1.0, 1.0, 4.0])
    count = first_contacts(flat, places)
    assert contact_places(flat, places, count, 2.0, points) == 1
    assert points[0] == pytest.approx(1.5)


def test_displacement_is_linear_between_the_strips() -> None:
    depth, spacing, curvature = np.array([0.0, 2e-6, 3e-6, 0.0, 1e-6]), 3e-4, 100.0
    table = influence_table(5)

    def at(strip: int) -> float:
        total = 0.0
        for i in (1, 2, 4):
            tau = min(math.log(math.sqrt(2.0 * depth[i] / curvature) / spacing), HIGHEST)
            total += depth[i] * read_value(table, tau, abs(i - strip))
        return total

    for strip in range(5):
        found = displacement_at(float(strip), depth, spacing, curvature, table)
        assert found == pytest.approx(at(strip), rel=1e-12, abs=0.0)
    found = displacement_at(2.3, depth, spacing, curvature, table)
    assert found == pytest.approx(0.7 * at(2) + 0.3 * at(3), rel=1e-12, abs=0.0)


@pytest.mark.parametrize("local", [False, True])
def test_level_is_the_lowest_of_all_first_contacts_beyond_their_ridges(local: bool) -> None:
    gap = np.array([4.0, 1.0, 1.0, 3.0, 2.5, 6.0, 2.0, 4.8, 7.0])
    reach, rigid = np.linspace(0.3, 0.7, 9), 5.0
    places, (level, slope) = np.zeros((9, 2), np.int64), np.zeros((2, 9))
    count = first_contacts(gap, places)
    contact_levels(gap, places, count, reach, local, rigid, level, slope)
    for i in range(9):
        known, change = rigid, 1.0
        for first, last in places[:count]:
            bottom = gap[first]
            # the ridge up to the strip, from the nearer side of the minimum
            between = gap[last:i] if i >= last else gap[i + 1 : first + 1]
            if first < i < last or bottom >= rigid or max(between, default=0.0) >= rigid:
                continue
            here = reach[i] if local else 0.5 * (reach[first] + reach[last])
            low, ridge = bottom + here * (rigid - bottom), max(between, default=bottom)
            if max(low, ridge) < known:
                known, change = max(low, ridge), here if low >= ridge else 0.0
        assert (level[i], slope[i]) == pytest.approx((known, change)), i
