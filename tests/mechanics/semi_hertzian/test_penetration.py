"""Minima of gaps, first contact points and displacements, interpreted, by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from wearsim.mechanics.semi_hertzian.penetration import (
    CONVERGED,
    OVERLAP,
    TOO_FINE,
    contact_levels,
    contact_places,
    displacement_at,
    even_depth,
    first_contacts,
    solve_foundation,
    solve_virtual_penetration,
)
from wearsim.mechanics.semi_hertzian.solver import patch_curvature, smoothed_curvature
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


Y, SPACING, MODULUS, CURVATURE = 0.15e-3 * np.arange(-12, 13), 0.15e-3, 1.1e11, 90.0
GAPS = {
    "fresh": Y**2,
    "two": Y**2 + 3e-6 * np.exp(-((Y / 0.4e-3) ** 2)) + 2e-6,
    "skew": 0.7 * np.abs(Y - 0.2e-3) ** 1.5 * (1.0 + 100.0 * Y) * 0.03,
}


@pytest.mark.parametrize("amount", [1e-3, 0.7, 3.0, 40.0])
def test_depths_below_an_even_level_have_the_given_sum(amount: float) -> None:
    gap = np.array([5.0, 2.0, 2.5, 7.0, 2.2, 3.0])
    depth = even_depth(gap, amount)
    assert np.maximum(depth - (gap - 2.0), 0.0).sum() == pytest.approx(amount, rel=1e-13)


@pytest.mark.parametrize("local", [False, True])
@pytest.mark.parametrize("name", GAPS)
def test_springs_below_their_levels_carry_the_load(name: str, local: bool) -> None:
    gap = GAPS[name]
    compliance, stiffness = 1e-12 * (1.0 + 50.0 * Y), 5e10 * (1.0 - 60.0 * Y)
    opened, reach = gap + compliance * 1e5 * np.exp(-((Y / 5e-4) ** 2)), 0.6 + 30.0 * Y
    places, (level, slope, line_load) = np.zeros((25, 2), np.int64), np.zeros((3, 25))
    contact = reach, local, places, first_contacts(opened, places)
    for load in (1e4, 3e6):
        found = []
        for start in (gap.min() + 1e-9, gap.min() + 1e-5, gap.min() + 1e-3):
            arguments = gap, opened, compliance, stiffness, *contact, load, start
            found.append(solve_foundation(*arguments, level, slope, line_load))
            assert line_load.sum() == pytest.approx(load, rel=1e-13)
            contact_levels(opened, places, contact[3], reach, local, found[-1], level, slope)
            known = np.maximum(level - gap, 0.0) / (1.0 / stiffness + compliance)
            np.testing.assert_allclose(line_load, known, rtol=1e-9, atol=1e-9 * load)
        assert found == pytest.approx([found[0]] * 3, rel=1e-9, abs=0.0)


@pytest.mark.parametrize("name", GAPS)
def test_virtual_penetration_displaces_the_bodies_by_their_approach(name: str) -> None:
    gap, table, load = GAPS[name], influence_table(25), 2e6
    places, (reach, level, slope, depth, points) = np.zeros((25, 2), np.int64), np.zeros((5, 25))
    count = first_contacts(gap, places)
    contact, rows = (gap, places, count, load), (reach, level, slope, depth)
    constants, found = (SPACING, MODULUS, CURVATURE, table), []
    for start in (0.0, 1e-7, 1e-4):
        status, approach, stiffness = solve_virtual_penetration(*contact, start, *constants, *rows)
        assert status == CONVERGED
        assert stiffness * depth.sum() == pytest.approx(load, rel=1e-12)
        contact_levels(gap, places, count, np.full(25, OVERLAP), False, gap.min() + approach,
                       level, slope)  # fmt: skip
        np.testing.assert_allclose(depth, np.maximum(level - gap, 0.0), rtol=1e-12, atol=1e-18)
        mean = even_depth(gap, load / (0.5 * MODULUS))
        number = contact_places(gap, places, count, 0.05 * mean, points)
        pressed = [displacement_at(at, depth, *constants[::2], table) for at in points[:number]]
        displacement = stiffness / (math.pi * MODULUS) * np.mean(pressed)
        assert displacement == pytest.approx(approach, rel=1e-12, abs=0.0)
        found.append(approach)
    assert found == pytest.approx([found[0]] * 3, rel=1e-11, abs=0.0)
    # half-lengths beyond the table
    for spacing, expected in ((8e-7, CONVERGED), (5e-7, TOO_FINE)):
        narrow = (spacing, *constants[1:])
        status = solve_virtual_penetration(*contact, 0.0, *narrow, *rows)[0]
        longest = math.sqrt(2.0 * depth.max() / CURVATURE)
        assert (longest > spacing * math.exp(HIGHEST)) == (expected == TOO_FINE)
        assert status == expected


@pytest.mark.parametrize("name", GAPS)
def test_smoothed_curvature_is_that_of_weighted_least_squares(name: str) -> None:
    gap, approach = GAPS[name], 1.2e-6
    bottom, depth = gap.min(), np.maximum(0.5 * approach - (gap - gap.min()), 0.0)
    found = np.zeros(25)
    smoothed_curvature(gap, depth, approach, SPACING, found)
    width = 0.6 * SPACING * depth.sum() ** 2 / (depth**2).sum()
    typical = depth.max() / width**2
    assert patch_curvature(depth, SPACING) == pytest.approx((width, typical), rel=1e-12)
    fitted = 0
    for i in range(25):
        # the highest gap between strip i and another one, below the limit
        ridge = np.array([gap[min(i, j) : max(i, j) + 1].max() for j in range(25)]) - bottom
        t = (Y - Y[i]) / width
        weight = np.where(np.abs(t) < 1.0, (1.0 - t * t) * np.maximum(1.5 * approach - ridge, 0), 0)
        used = weight > 0.0
        expected = typical
        if np.count_nonzero(used) > 2:
            expected = np.polyfit(t[used], gap[used], 2, w=np.sqrt(weight[used]))[0] / width**2
            fitted += 1
        expected = min(max(expected, 0.125 * typical), 100.0 * typical)
        assert found[i] == pytest.approx(expected, rel=1e-7), i
    assert fitted > 5
