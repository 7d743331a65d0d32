"""Smoothing splines of closed tables: noise, standard errors and dwells."""

from __future__ import annotations

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


def test_dwells_are_found_and_constant() -> None:
    rise = np.clip((ANGLE - 2.0) / 2.0, 0.0, 1.0)
    fall = np.clip((ANGLE - 5.0) / 1.2, 0.0, 1.0)

    def smooth(part: np.ndarray) -> np.ndarray:
        return part - np.sin(math.tau * part) / math.tau

    values = 5e-3 * (smooth(rise) - smooth(fall))
    values += 1e-7 * np.random.default_rng(3).standard_normal(len(ANGLE))
    curve = smoothed(ANGLE, values)
    assert curve.dwells
    for start, stop in curve.dwells:
        inside = np.linspace(start, stop, 20)
        assert np.ptp(curve(inside)[0]) < 1e-12
        middle = 0.5 * (start + stop)
        on_dwell = (middle % math.tau < 2.0) or (4.0 < middle < 5.0) or middle % math.tau > 6.2
        assert on_dwell
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
