"""Measured profiles against the computed one."""

import numpy as np
import pytest

from wearsim.errors import ScenarioError
from wearsim.levelling import ComputedProfile, Measured, levelled, rms

Y = np.linspace(-8e-3, 8e-3, 401)
GROOVE = -np.maximum(2e-5 * (1.0 - (Y / 5e-3) ** 2), 0.0)
COMPUTED = ComputedProfile(Y, GROOVE, GROOVE, GROOVE, np.zeros_like(Y))


def test_levelling_removes_offset_inclination_and_shift() -> None:
    height = GROOVE + 12e-6 + 4e-4 * Y + 3e-7 * np.random.default_rng(1).normal(size=len(Y))
    measured = Measured("trace", Y + 0.7e-3, height)
    assert rms(measured, COMPUTED) > 1e-5
    assert rms(levelled(measured, COMPUTED), COMPUTED) < 3.5e-7


def test_levelling_does_not_fit_the_depth() -> None:
    measured = levelled(Measured("trace", Y, 1.5 * GROOVE + 1e-5), COMPUTED)
    np.testing.assert_allclose(measured.height, 1.5 * GROOVE, atol=1e-8)


def test_levelling_keeps_a_worn_start() -> None:
    start = -1e-6 * np.cos(300.0 * Y)
    computed = ComputedProfile(Y, GROOVE + start, GROOVE, GROOVE, start)
    found = levelled(Measured("trace", Y, GROOVE + start + 5e-6), computed)
    np.testing.assert_allclose(found.height, GROOVE + start, atol=2e-7)


def test_profile_without_unworn_surface_is_refused() -> None:
    inside = np.abs(Y) < 4e-3
    with pytest.raises(ScenarioError, match="no unworn surface on both sides"):
        levelled(Measured("trace", Y[inside], GROOVE[inside]), COMPUTED)
