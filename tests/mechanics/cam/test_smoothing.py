"""Smoothing splines of closed tables: noise, standard errors and dwells."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from wearsim.mechanics.cam.smoothing import (
    SmoothedCurve,
    estimated_noise,
    scatter_through_points,
    smoothed,
)

NOISE = 2e-6
ANGLE = np.sort(math.tau * (np.arange(90) + 0.3 * np.sin(np.arange(90.0))) / 90.0)


def lift(angle: np.ndarray) -> np.ndarray:
    return 4e-3 * (1.0 - np.cos(angle)) + 3e-4 * np.sin(2.0 * angle)


def table(seed: int, noise: float = NOISE) -> np.ndarray:
    return lift(ANGLE) + noise * np.random.default_rng(seed).standard_normal(len(ANGLE))


def test_noise_of_a_table_is_that_of_its_points() -> None:
    found = [estimated_noise(ANGLE, table(seed)) for seed in range(20)]
    assert np.mean(found) == pytest.approx(NOISE, rel=0.12)
    values, found = table(2), []
    values[30:40] = values[30]  # rounded: differences of zero do not count
    for order in (4, 6, 8):
        differences = []
        for first in range(90):
            rows = np.arange(first, first + order + 1)
            x = ANGLE[rows % 90] + math.tau * (rows >= 90)
            # the divided difference, for errors of unit size
            gaps = x[:, None] - x + np.eye(order + 1)
            weight = 1.0 / np.prod(gaps, axis=1)
            near = values[rows % 90] - values[first]
            differences.append(abs(weight @ near) / np.linalg.norm(weight))
        known = np.array(differences)
        found.append(np.median(known[known > 0.0]) / 0.6745)
    assert estimated_noise(ANGLE, values) == pytest.approx(min(found), rel=1e-6, abs=0.0)
    scaled = estimated_noise(ANGLE, 3.0 * table(1))
    assert scaled == pytest.approx(3.0 * estimated_noise(ANGLE, table(1)), rel=1e-9, abs=0.0)
    assert estimated_noise(ANGLE, np.zeros(90)) == 0.0


def test_spline_is_within_its_standard_errors() -> None:
    places = np.linspace(0.0, math.tau, 200)
    second = 4e-3 * np.cos(places) - 1.2e-3 * np.sin(2.0 * places)
    away, stated, noises, values = [], [], [], []
    for seed in range(4):
        curve = smoothed(ANGLE, table(seed), dwells=False)
        found = curve(places)
        values.append(found[0] - lift(places))
        away.append(found[2] - second)
        stated.append(curve.second_error)
        noises.append(curve.noise)
    assert np.sqrt(np.mean(np.square(values))) < 0.7 * NOISE
    assert np.mean(noises) == pytest.approx(NOISE, rel=0.15)
    ratio = np.sqrt(np.mean(np.square(away))) / np.mean(stated)
    assert 0.5 < ratio < 1.6


def test_drawn_coefficients_scatter_by_the_standard_error() -> None:
    curve = smoothed(ANGLE, table(5), dwells=False)
    places = np.linspace(0.0, math.tau, 60, endpoint=False)
    drawn = [curve(places, curve.drawn(seed))[2] - curve(places)[2] for seed in range(60)]
    scatter = np.sqrt(np.mean(np.square(drawn)))
    assert scatter == pytest.approx(curve.second_error, rel=0.15)


def test_spline_through_points_scatters_with_the_square_of_their_number() -> None:
    once, twice = (scatter_through_points(np.zeros(n), NOISE) for n in (90, 180))
    assert twice == pytest.approx(4.0 * once)
    # white noise up to the frequency pi/h of points at a distance h: the integral of w^4 h/(2 pi)
    spacing = math.tau / 90.0
    expected = NOISE * math.sqrt(math.pi**4 / (5.0 * spacing**4))
    assert once == pytest.approx(expected, rel=1e-12)


def with_dwells(height=5e-3, noise=1e-7, seed=3, uneven=1.0) -> np.ndarray:
    """Return a lift that rests outside of the angles 2 to 4 and 5 to 6.2, there with more noise."""
    rise = np.clip((ANGLE - 2.0) / 2.0, 0.0, 1.0)
    fall = np.clip((ANGLE - 5.0) / 1.2, 0.0, 1.0)

    def smooth(part: np.ndarray) -> np.ndarray:
        return part - np.sin(math.tau * part) / math.tau

    values = height * (smooth(rise) - smooth(fall))
    sizes = noise * np.where((ANGLE > 4.0) & (ANGLE < 5.0), uneven, 1.0)
    return values + sizes * np.random.default_rng(seed).standard_normal(len(ANGLE))


def basis(curve: SmoothedCurve, angle: np.ndarray) -> np.ndarray:
    """Return all splines of a curve and two derivatives, shape (3, points, splines)."""
    return np.stack([curve(angle, one) for one in np.eye(len(curve.knots))], axis=-1)


def matrices(curve: SmoothedCurve, angle: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return free splines at angles, their second derivatives over a turn, and the penalty."""
    count = len(curve.knots)
    tied = np.eye(count)
    for start, stop in curve.dwells:  # of a dwell the coefficients are equal
        used = basis(curve, np.array([0.5 * (start + stop)]))[0, 0] > 0.0
        tied[:, used] = 0.0
        tied[used, np.flatnonzero(used)[0]] = 1.0
    tied = tied[:, tied.any(axis=0)]
    edges = np.unique(np.append(curve.knots, curve.knots[0] + math.tau))
    penalty = np.zeros((count, count))
    for low, high in itertools.pairwise(edges):
        # the second derivative is cubic, its own second derivative linear
        x = np.linspace(0.0, 1.0, 4)
        inside = low + (1e-9 + (1.0 - 2e-9) * x) * (high - low)
        cubics = np.linalg.solve(np.vander(x, 4), basis(curve, inside)[2])
        ends = np.array([2.0 * cubics[1], 6.0 * cubics[0] + 2.0 * cubics[1]]) / (high - low) ** 2
        mass = np.array([[2.0, 1.0], [1.0, 2.0]]) * (high - low) / 6.0
        penalty += ends.T @ mass @ ends
    around = np.linspace(0.0, math.tau, 1440, endpoint=False)
    rows = basis(curve, angle)[0], basis(curve, around)[2]
    return rows[0] @ tied, rows[1] @ tied, tied.T @ penalty @ tied, tied


@pytest.mark.parametrize("noise", [None, 3e-7])
@pytest.mark.parametrize("dwells", [False, True])
def test_spline_has_the_greatest_restricted_likelihood(noise: float | None, dwells: bool) -> None:
    values = with_dwells() if dwells else table(8)
    curve = smoothed(ANGLE, values, noise, dwells=dwells)
    assert bool(curve.dwells) == dwells
    design, second, penalty, tied = matrices(curve, ANGLE)
    free = np.linalg.lstsq(tied, curve.coefficients, rcond=None)[0]
    assert tied @ free == pytest.approx(curve.coefficients, rel=1e-12)
    assert curve.residual == pytest.approx(values - design @ free, abs=1e-12)
    # least squares with a penalty
    pull, bent = design.T @ curve.residual, penalty @ free
    weight = (pull @ bent) / (bent @ bent)
    np.testing.assert_allclose(pull, weight * bent, atol=1e-5 * np.abs(pull).max())

    def score(weight: float) -> float:
        matrix = design.T @ design + weight * penalty
        best = np.linalg.solve(matrix, design.T @ values)
        left = values - design @ best
        squares = left @ left + weight * best @ penalty @ best
        determinants = np.linalg.slogdet(matrix)[1] - (len(free) - 1) * math.log(weight)
        if noise is None:
            return (len(values) - 1) * math.log(squares) + determinants
        return squares / noise**2 + determinants

    assert score(weight) < min(score(0.67 * weight), score(1.49 * weight))
    inverse = np.linalg.inv(design.T @ design + weight * penalty)
    freedom = np.trace(inverse @ design.T @ design)
    sigma = math.sqrt(curve.residual @ curve.residual / (90.0 - freedom))
    assert curve.noise == pytest.approx(sigma, rel=1e-4, abs=0.0)
    covariance = sigma**2 * tied @ inverse @ tied.T
    found = curve.factor @ curve.factor.T
    np.testing.assert_allclose(found, covariance, atol=1e-3 * np.abs(covariance).max())
    variance = np.einsum("ij,jk,ik->i", second, inverse, second)
    expected = sigma * math.sqrt(variance.mean())
    assert curve.second_error == pytest.approx(expected, rel=1e-3, abs=0.0)


@pytest.mark.parametrize(
    ("options", "count"),
    [
        ({}, 2),
        ({"noise": 1e-6, "seed": 0}, 2),
        ({"height": 2e-5, "noise": 1e-6, "seed": 0}, 1),  # the other one is too short
        ({"noise": 5e-6, "seed": 2, "uneven": 2.0}, 1),  # the other one scatters
    ],
)
def test_dwells_are_runs_of_samples_without_significant_motion(options: dict, count: int) -> None:
    values, around = with_dwells(**options), np.arange(1440) * math.tau / 1440
    first = smoothed(ANGLE, values, dwells=False)
    rows = basis(first, around)[1:] @ first.factor
    still = np.all(np.abs(first(around)[1:]) < 3.5 * np.linalg.norm(rows, axis=2), axis=0)
    length = math.tau / (90.0 - first.residual @ first.residual / first.noise**2)
    known = []
    for place in np.flatnonzero(still & ~np.roll(still, 1)):
        last = place + int(np.argmin(np.roll(still, -place))) - 1  # of the run
        # half a resolved length is left out at either end
        low, high = place * around[1] + 0.5 * length, last * around[1] - 0.5 * length
        inside = values[np.mod(ANGLE - low, math.tau) <= high - low]
        most = first.noise**2 * (1.0 + 4.0 * math.sqrt(2.0 / max(len(inside), 1)))
        if high - low >= 2.0 * length and len(inside) > 4 and inside.var(ddof=1) < most:
            known.append((low % math.tau, high - low // math.tau * math.tau))
    assert len(known) == count
    curve = smoothed(ANGLE, values)
    assert np.array(curve.dwells) == pytest.approx(np.array(sorted(known)), abs=1e-9)
    # knots are triple at the ends of dwells, and equally spaced between them
    for start, stop in curve.arcs:
        edges = np.mod([start, stop], math.tau)
        assert [np.isclose(curve.knots, edge).sum() for edge in edges] == [3, 3]
        between = np.mod(curve.knots - start, math.tau)
        inner = np.unique(between[(between > 1e-9) & (between < stop - start - 1e-9)])
        number = round((stop - start) * 45.0 / math.tau)
        assert inner == pytest.approx((stop - start) * np.arange(1, number) / number)
    assert smoothed(ANGLE, table(0)).dwells == ()
    assert smoothed(ANGLE, 1e-3 + 1e-3 * (table(0) - lift(ANGLE))).dwells == ()


def test_dwells_are_found_and_constant() -> None:
    curve = smoothed(ANGLE, with_dwells())
    known = (6.2 - math.tau, 2.0), (4.0, 5.0)
    for (start, stop), (low, high) in zip(curve.dwells, known, strict=True):
        assert low < start < low + 0.4
        assert high - 0.4 < stop < high
        inside = np.linspace(start, stop, 20)
        assert np.ptp(curve(inside)[0]) < 1e-12
    assert len(curve.arcs) == len(curve.dwells)
    for (_, stop), (start, _) in zip(curve.dwells, curve.arcs, strict=True):
        assert start == stop


def test_arcs_are_between_the_dwells():
    none = np.zeros(0)
    options = none, none, 0.0, none, none, 0.0
    dwells = (0.5, 1.0), (3.0, 4.0)
    curve = SmoothedCurve(*options, dwells, np.zeros((0, 0)))
    assert curve.arcs == [(1.0, 3.0), (4.0, 0.5 + 2.0 * np.pi)]
    assert SmoothedCurve(*options, (), np.zeros((0, 0))).arcs == []
