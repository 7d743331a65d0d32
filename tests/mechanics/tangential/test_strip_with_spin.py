"""Adhesion zone and slip of strips with spin, interpreted, against the equations they solve."""

from __future__ import annotations

import math

import numpy as np
import pytest

from wearsim.mechanics.tangential.fastrip import turn_direction
from wearsim.mechanics.tangential.kalker_coefficients import CreepageCoefficients
from wearsim.mechanics.tangential.strip_with_spin import (
    Moduli,
    Strip,
    StripMotion,
    amended_moduli,
    beyond_strip_theory,
    slip_at,
    strip_of,
)

MODULI = Moduli(1.1e11, 0.8e11, 0.9e11, 0.7e11)
LENGTH, PEAK = np.array([2e-4, 3e-4]), np.array([5e7, 4e7])


def motion(longitudinal: float, lateral: float, spin: float) -> StripMotion:
    """Return the motion of both strips, the second one without longitudinal slip."""
    slips = np.array([longitudinal, 0.0])
    return StripMotion(slips, slips * MODULI.longitudinal, lateral, spin)


def dimensionless(j: int, given: StripMotion) -> tuple[float, float, float]:
    """Return X, Y and psi of the module's docstring."""
    rise = PEAK[j] / LENGTH[j]
    drive = given.drive[j], given.lateral * MODULI.lateral, given.spin * MODULI.spin_across
    return tuple(0.5 * one / rise for one in drive)  # type: ignore[return-value]


@pytest.mark.parametrize(
    ("longitudinal", "lateral", "spin"),
    [(3e-4, 0.0, 0.0), (2e-4, -2e-4, 1.0), (-1e-4, 3e-4, -2.0), (4e-4, 1e-4, 3.0), (0.0, 0.0, 1.0)],
)
def test_traction_at_the_onset_of_slip_is_on_the_bound(
    longitudinal: float, lateral: float, spin: float
) -> None:
    given = motion(longitudinal, lateral, spin)
    for j in range(2):
        strip, (x, y, psi) = strip_of(j, LENGTH, PEAK, given, MODULI), dimensionless(j, given)
        assert (strip.half_length, strip.rise, strip.twist) == pytest.approx(
            (LENGTH[j], PEAK[j] / LENGTH[j], psi)
        )
        if x == y == 0.0:
            assert strip.shift == 0.0
            continue
        e = x / strip.shift, y / strip.shift + psi
        assert math.hypot(*e) == pytest.approx(1.0, rel=1e-12)
        assert strip.shift < LENGTH[j]
        assert (strip.direction_x, strip.direction_y) == pytest.approx((-e[0], -e[1]))
        # slip behind the adhesion zone, which ends at 2d - a
        end = 2.0 * strip.shift - LENGTH[j]
        for place in (end, end - 1e-5, -LENGTH[j]):
            grown = math.sqrt(max((end - place) * (LENGTH[j] - place), 0.0)) / strip.shift
            known = given.longitudinal[j] * grown, lateral * grown
            assert slip_at(strip, place, 0.0, 0.0) == pytest.approx(known)


@pytest.mark.parametrize(
    ("longitudinal", "lateral", "spin"), [(5e-3, 0, 0), (4e-3, -3e-3, 5.0), (1e-3, 6e-3, -4.0)]
)
def test_traction_opposes_the_slip_at_the_edge_in_full_sliding(
    longitudinal: float, lateral: float, spin: float
) -> None:
    strip = strip_of(0, LENGTH, PEAK, motion(longitudinal, lateral, spin), MODULI)
    assert strip.shift == LENGTH[0]
    e_x, e_y = strip.direction_x, strip.direction_y
    assert math.hypot(e_x, e_y) == pytest.approx(1.0, rel=1e-12)
    w_x, w_y = slip_at(strip, LENGTH[0], e_x, e_y)
    strain = 2.0 * strip.rise * LENGTH[0]
    assert w_x == pytest.approx(longitudinal + strain * e_x / MODULI.longitudinal)
    assert w_y == pytest.approx(lateral + strain * (e_y + strip.twist) / MODULI.lateral)
    assert w_x * e_y == pytest.approx(w_y * e_x, abs=1e-12)
    assert w_x * e_x + w_y * e_y < 0.0


def test_strip_without_adhesion_has_a_twist_of_one_or_more() -> None:
    limit = 2.0 * PEAK[0] / (MODULI.spin_across * LENGTH[0])
    for spin, beyond in ((limit, True), (-1.01 * limit, True), (0.99 * limit, False)):
        assert beyond_strip_theory(0, LENGTH, PEAK, motion(0.0, 0.0, spin), MODULI) is beyond


def test_moduli_have_the_linear_limits_of_the_ellipse() -> None:
    found = amended_moduli(CreepageCoefficients(4.0, 3.0, 1.5, 0.7), 2e-4, 8e-4, 8e10)
    plane = 4.0 * 8e10 / math.pi**2
    assert (found.longitudinal, found.lateral) == pytest.approx((4.0 * plane, 3.0 * plane))
    assert found.spin_along == pytest.approx(4.0 * plane * 0.7 * 0.25)
    assert found.spin_across == pytest.approx(3.0 * 8e10 / (math.pi * 0.5) * 1.5)


@pytest.mark.parametrize("angle", [0.3, 2.0, -2.9])
def test_direction_turns_by_an_exponential_of_half_the_tangent(angle: float) -> None:
    strip = Strip(2e-4, 3e11, 2e-4, 0.0, 0.0, 0.0, 0.0, 0.0, 1.2e11, 0.8e11)
    slip, way = np.array([2e-3, 1e-3]), 0.05
    aim = math.atan2(-slip[1], -slip[0])  # against the slip
    e = np.array([math.cos(aim + angle), math.sin(aim + angle)])
    give = e[1] ** 2 / 1.2e11 + e[0] ** 2 / 0.8e11  # across the traction
    rate = np.hypot(*slip) / (2.0 * 3e11 * 2e-4 * give)
    left = 2.0 * math.atan(math.tan(0.5 * angle) * math.exp(-rate * way))
    found = turn_direction(strip, *slip, way, *e)
    assert found == pytest.approx((math.cos(aim + left), math.sin(aim + left)), abs=1e-9)
    assert turn_direction(strip, 0.0, 0.0, way, *e) == tuple(e)
