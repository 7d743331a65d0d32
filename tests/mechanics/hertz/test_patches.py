"""Hertz patches on strips: their cut into strips, their edges and the reasons of failed fits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import ellipkm1

from wearsim.mechanics.hertz.ellipse import hertz
from wearsim.mechanics.hertz.parabola_fit import (
    CONVERGED,
    LEAVES_STRIPS,
    NO_CURVATURE,
    TOO_FEW_STRIPS,
    fit_centred,
    fit_parabola,
    hertz_on_profile,
    is_parabola,
    strips_within,
)
from wearsim.mechanics.hertz.patches import (
    NO_GAP,
    NO_LOAD,
    Bodies,
    Patches,
    cut_into_strips,
    find_patches,
    fit_within,
    half_lengths,
)

Y, SPACING = np.linspace(-1.0, 1.0, 21), 0.1
MODULUS, LOAD = 1e11, 300.0


def bodies(count: int = 1, a: float = 0.0, b: float = 0.0, y: np.ndarray = Y) -> Bodies:
    return Bodies(y, y[1] - y[0], np.full(count, 45.0), MODULUS, a, b, 1e-10, 200)


def patches(given: Bodies, gaps: np.ndarray, loads: np.ndarray) -> Patches:
    count = len(loads)
    found = Patches(*np.full((6, count), math.nan), *np.zeros((2, count), dtype=np.int64))
    find_patches(given, gaps, np.arange(count), loads, found)
    return found


@pytest.mark.parametrize(
    ("centre", "b"), [(0.0, 0.42), (0.233, 0.37), (-0.7, 0.03), (0.9, 0.5), (-0.9, 0.5)]
)
def test_strips_of_a_patch_hold_the_elliptic_pressure(centre: float, b: float) -> None:
    length, load, middle, coverage = np.full((4, 21), -1.0)
    first, stop = cut_into_strips(bodies(), 0.2, b, centre, LOAD, length, load, middle, coverage)
    low = np.clip(Y - 0.05 - centre, -b, b)
    high = np.clip(Y + 0.05 - centre, -b, b)
    assert coverage == pytest.approx((high - low) / 0.1, abs=1e-12)
    covered = coverage > 1e-12
    assert middle[covered] == pytest.approx(0.5 * (low + high)[covered])
    half = 0.2 * np.sqrt(1.0 - (0.5 * (low + high) / b)[covered] ** 2)
    assert length[covered] == pytest.approx(half, abs=1e-9)
    # the line load of an ellipse is parabolic, with the integral N
    integral = (high - high**3 / (3.0 * b**2)) - (low - low**3 / (3.0 * b**2))
    assert load == pytest.approx(0.75 * LOAD / b * integral / 0.1, rel=1e-9, abs=1e-9)
    inside = np.flatnonzero(length > 0.0)
    assert (first, stop) == (inside[0], inside[-1] + 1)


def test_patch_that_is_given_may_end_at_the_edge_of_the_strips() -> None:
    gaps = np.stack([3.0 * (Y - 0.2) ** 2, 3.0 * (Y + 0.2) ** 2])
    loads = np.full(2, LOAD)
    for factor, status in ((1.0 - 1e-6, CONVERGED), (1.0 + 1e-6, LEAVES_STRIPS)):
        found = patches(bodies(2, 0.1, 0.85 * factor), gaps, loads)
        assert found.status.tolist() == [status] * 2
        assert found.centre == pytest.approx([0.2, -0.2])
        assert found.iterations.tolist() == [0, 0]
        assert found.ratio == pytest.approx([0.1 / (0.85 * factor)] * 2)
        assert found.peak_pressure == pytest.approx([1.5 * LOAD / (math.pi * 0.085 * factor)] * 2)
    assert patches(bodies(2, 0.1, 0.5), gaps, np.full(2, 0.5)).status.tolist() == [CONVERGED] * 2
    lengths = half_lengths(bodies(2, 0.1, 0.5), patches(bodies(2, 0.1, 0.5), gaps, loads), loads)
    assert lengths[0].max() == pytest.approx(0.1, rel=1e-2)
    assert lengths[0] == pytest.approx(lengths[1][::-1])


def test_contacts_without_load_or_gap_have_their_status() -> None:
    y = np.linspace(-6e-3, 6e-3, 241)
    gaps = np.stack([20.0 * y**2] * 5)
    gaps[2, 3] = math.nan
    loads = np.array([LOAD, 0.0, LOAD, math.inf, LOAD])
    found = patches(bodies(5, y=y), gaps, loads)
    assert found.status.tolist() == [CONVERGED, NO_LOAD, NO_GAP, NO_LOAD, CONVERGED]
    assert np.isnan(found.a[1:4]).all()
    curvature, half_width, centre, height, _, status = hertz_on_profile(
        y, gaps[0], 45.0, LOAD, MODULUS, 1e-10, 200
    )
    assert status == CONVERGED
    assert (curvature, centre, height) == pytest.approx((20.0, 0.0, 0.0), abs=1e-9)
    assert found.b[0] == pytest.approx(half_width)
    assert (half_lengths(bodies(5, y=y), found, loads)[1:4] == 0.0).all()


def test_fit_needs_three_strips_and_a_valley() -> None:
    y = np.array([-1.0, 0.0, 1.0])
    assert fit_parabola(y, 2.0 * y**2 + 0.5 * y, 0.0, 1.5) == pytest.approx(
        (2.0, -0.125, -0.03125, 3)
    )
    assert fit_parabola(y, y**2, 0.0, 1.0)[3] == 1  # strips at the ends have no weight
    flat = fit_parabola(y, np.full(3, 2.0), 0.0, 1.5)
    assert flat[0] == pytest.approx(0.0, abs=1e-12)
    assert math.isnan(flat[1])
    assert fit_parabola(y, y - 2.0 * y**2, 0.0, 1.5)[0] == pytest.approx(-2.0)
    assert fit_centred(y, y**2, 0.0, 1.5, 1e-9)[3] == CONVERGED
    assert fit_centred(y, -(y**2), 0.0, 1.5, 1e-9)[3] == NO_CURVATURE
    assert fit_centred(y[:2], y[:2] ** 2, -0.5, 1.5, 1e-9)[3] == TOO_FEW_STRIPS
    assert fit_within(y, -(y**2), 1.0, 1e-9)[4] == NO_CURVATURE
    assert fit_within(y[:2], y[:2] ** 2, 1.0, 1e-9)[4] == TOO_FEW_STRIPS
    assert fit_within(Y, 2.0 * (Y - 0.3) ** 2 + 0.1, SPACING, 1e-9) == pytest.approx(
        (2.0, 0.3, 0.1, 0.75, CONVERGED)
    )


def test_patch_on_a_profile_is_consistent_with_its_own_fit() -> None:
    y = np.linspace(-6e-3, 6e-3, 241)

    def gap(x: np.ndarray) -> np.ndarray:
        return 20.0 * x**2 + 3e5 * (x - 1e-4) ** 4 + 0.01 * x

    curvature, half_width, centre, height, _, status = hertz_on_profile(
        y, gap(y), 45.0, LOAD, MODULUS, 1e-10, 200
    )
    assert status == CONVERGED
    again = fit_parabola(y, gap(y), centre, half_width)
    assert (curvature, centre, height) == pytest.approx(again[:3], rel=1e-6, abs=1e-9)
    # weighted least squares with the weights 1 - t^2
    t = (y - centre) / half_width
    inside = np.abs(t) < 1.0
    design = np.vander(y[inside] - centre, 3, increasing=True)
    weight = np.sqrt(1.0 - t[inside] ** 2)
    terms = np.linalg.lstsq(design * weight[:, None], gap(y)[inside] * weight, rcond=None)[0]
    assert curvature == pytest.approx(terms[2], rel=1e-6)
    narrow = hertz_on_profile(y[100:141], gap(y)[100:141], 45.0, 30.0 * LOAD, MODULUS, 1e-10, 200)
    assert narrow[5] == LEAVES_STRIPS


def test_gap_is_a_parabola_to_round_off_of_its_greatest_height() -> None:
    gap = 0.7 + 3.0 * (Y - 0.25) ** 2  # up to 4.7 above its vertex
    assert is_parabola(Y, gap, 3.0, 0.25, 0.7)
    for i in (0, 10, 20):
        for change, expected in ((1e-14, True), (-1e-14, True), (4e-14, False), (-4e-14, False)):
            moved = gap.copy()
            moved[i] += change
            assert is_parabola(Y, moved, 3.0, 0.25, 0.7) == expected
    assert [strips_within(Y, 0.02, width) for width in (0.01, 0.03, 0.09, 0.55)] == [0, 1, 2, 11]


def test_section_of_a_prescribed_patch_is_symmetric_about_its_vertex() -> None:
    gap = 2.0 * (Y + 0.45) ** 2 + 0.3 * (Y + 0.45) ** 3
    curvature, centre, height, span, status = fit_within(Y, gap, SPACING, 1e-10)
    assert status == CONVERGED
    _, vertex, *_ = fit_parabola(Y, gap, 0.0, 1.05)
    assert span == pytest.approx(1.05 - abs(vertex), rel=1e-12)
    again = fit_parabola(Y, gap, centre, span)
    assert (curvature, centre, height) == pytest.approx(again[:3], abs=1e-9)
    found = patches(bodies(1, 0.1, 0.4), gap[None], np.array([LOAD]))
    expected = curvature, centre, height
    assert found.centre[0] == pytest.approx(expected[1], abs=1e-9)
    first = 1.5 * LOAD / (math.pi * MODULUS * 0.4) * ellipkm1(0.25**2)
    assert found.approach[0] == pytest.approx(first + height, rel=1e-9)


def test_contacts_of_a_batch_have_their_own_gap_and_curvature() -> None:
    y = np.linspace(-6e-3, 6e-3, 121)
    gaps = np.stack([1.2 * (y - 4e-4) ** 2, 1.2 * y**2, 2.5 * y**2, 2.5 * y**2 + 200.0 * y**3])
    row = np.array([0, 0, 0, 2, 2, 3, 3, 1])
    curved = np.array([45.0, 0.8, 45.0, 45.0, 0.9, 45.0, 3.0, 45.0])
    loads = LOAD * np.array([1.0, 0.2, 1.5, 1.0, 0.3, 0.7, 0.1, 90.0])
    given = Bodies(y, y[1] - y[0], curved, MODULUS, 0.0, 0.0, 1e-10, 200)
    found = Patches(*np.full((6, 8), math.nan), *np.zeros((2, 8), dtype=np.int64))
    find_patches(given, gaps, row, loads, found)
    assert found.status.tolist() == [CONVERGED] * 7 + [LEAVES_STRIPS]
    for k in range(7):
        fit = hertz_on_profile(y, gaps[row[k]], curved[k], loads[k], MODULUS, 1e-10, 200)
        patch = hertz(curved[k], fit[0], loads[k], MODULUS)
        known = patch.a, patch.b, patch.peak_pressure, patch.approach + fit[3], patch.a / patch.b
        sizes = found.a[k], found.b[k], found.peak_pressure[k], found.approach[k], found.ratio[k]
        assert sizes == pytest.approx(known, rel=1e-9, abs=0.0)
        assert found.centre[k] == pytest.approx(fit[2], abs=1e-9)
        assert found.iterations[k] == fit[4]
    assert found.ratio[0] == found.ratio[2]  # of different size
    assert len(set(found.ratio[:7])) == 6


@pytest.mark.parametrize("moved", [0.0, 0.8, -3.0])
def test_patches_move_with_the_strips(moved: float) -> None:
    gap = 2.0 * (Y - 0.1) ** 2 + 0.4 * (Y - 0.1) ** 3 + 0.3 * np.maximum(0.1 - Y**2, 0.0)
    expected = fit_within(Y, gap, SPACING, 1e-10)
    curvature, centre, *rest = fit_within(Y + moved, gap, SPACING, 1e-10)
    assert (curvature, centre - moved, *rest) == pytest.approx(expected, abs=1e-9)
    expected = hertz_on_profile(Y, gap, 45.0, 3e9, MODULUS, 1e-8, 200)
    assert expected[5] == CONVERGED
    curvature, half_width, centre, *rest = hertz_on_profile(
        Y + moved, gap, 45.0, 3e9, MODULUS, 1e-8, 200
    )
    assert (curvature, half_width, centre - moved) == pytest.approx(expected[:3], abs=1e-7)
    # a parabola is known from one fit, and has a patch up to the edges of the strips
    unit = hertz(45.0, 1.0, 1.0, MODULUS).b
    for width, status in ((1.04, CONVERGED), (1.06, LEAVES_STRIPS)):
        load = (width / unit) ** 3
        found = patches(bodies(y=Y + moved), Y[None] ** 2, np.array([load]))
        assert (found.status[0], found.iterations[0]) == (status, 1)
        single = hertz_on_profile(Y + moved, Y**2, 45.0, load, MODULUS, 1e-10, 200)
        assert single[4:] == (1, status)
