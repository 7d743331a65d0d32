"""Coupled half-lengths of `slender` against exact theory."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.materials import STEEL
from tests.reference import half_space
from wearsim.contact_batch import ContactBatch
from wearsim.mechanics.hertz.elasticity import combine
from wearsim.mechanics.hertz.ellipse import hertz
from wearsim.models.contact.slender import SPEC, SlenderOptions
from wearsim.types import Creepage, Grid, OperatingPoint

MATERIALS = (STEEL, STEEL)
MODULUS = combine(*MATERIALS).contact_modulus
RIG, LOAD = 90.0, 300.0
POINT = OperatingPoint(LOAD, 2.618, Creepage(longitudinal=1e-3), 0.1, None, None)
STRIPS = 80
FAR = 1e-3  # a gap that does not close: beyond the end of the roller


def solved(gap, wide, strips, curvature=RIG, **options):
    """Return the solution of a gap profile on strips that span -wide to wide."""
    grid = Grid.spanning(-wide, wide, strips)
    model = SPEC.factory(SlenderOptions(**options), grid, MATERIALS)
    return model.solve_one(gap(grid.y), curvature, POINT)


@cache
def exact_of(gap, wide):
    """Return the solution of exact theory for a gap profile."""
    grid = Grid.spanning(-wide, wide, 3 * STRIPS)
    return half_space.solve(gap(grid.y), grid.y, RIG, LOAD, MODULUS, 0.28e-3, 48)


def missed(gap, wide, **options):
    """Return the errors of q and a (L1), approach and p0 against exact theory."""
    exact = exact_of(gap, wide)
    found = solved(gap, wide, STRIPS, **options)

    def by(ours, theirs):
        coarse = theirs.reshape(STRIPS, -1).mean(axis=1)
        return np.abs(ours - coarse).sum() / coarse.sum()

    return (
        by(found.line_load, exact.line_load),
        by(found.half_length, exact.half_length),
        abs(found.approach / exact.approach - 1.0),
        abs(found.peak_pressure / exact.peak_pressure - 1.0),
    )


@pytest.mark.parametrize(
    ("across", "ratio", "bounds"),
    [
        (45.0, 1.0, (2e-3, 5e-3, 1e-3, 2e-3)),
        (15.83, 2.0, (1e-3, 4e-3, 3e-4, 5e-4)),
        (8.495, 3.0, (1e-3, 4e-3, 2e-4, 3e-4)),
        (3.805, 5.0, (1e-3, 4e-3, 2e-4, 3e-4)),
        (1.2317, 10.0, (1e-3, 4e-3, 2e-4, 3e-4)),
    ],
)
def test_ellipse_of_any_axis_ratio_is_hertzian(across, ratio, bounds):
    patch = hertz(0.5 * RIG, across, LOAD, MODULUS)
    assert patch.b / patch.a == pytest.approx(ratio, rel=1e-3)
    found = solved(lambda y: across * y**2, 1.2 * patch.b, 81)
    q, a = patch.line_load(found.y), patch.half_length(found.y)
    errors = (
        np.abs(found.line_load - q).sum() / q.sum(),
        np.abs(found.half_length - a).sum() / a.sum(),
        abs(found.approach / patch.approach - 1.0),
        abs(found.peak_pressure / patch.peak_pressure - 1.0),
    )
    assert (np.array(errors) < bounds).all(), errors


GROOVE = 8e-6


def offset(groove):
    """Return the gap of a roller with an offset of 1 mm from its groove."""
    return lambda y: (y - 1e-3) ** 2 + groove(y)


PROFILES = {
    "ends within the contact": (lambda y: np.where(y > 0.5e-3, FAR, y**2), 2e-3),
    "ends on both sides": (lambda y: np.where(np.abs(y) > 0.8e-3, FAR, y**2), 1e-3),
    "no crown": (lambda y: np.where(np.abs(y) > 1e-3, FAR, 0.0), 1.25e-3),
    "short": (lambda y: np.where(y > 0.2e-3, FAR, 8.495 * y**2), 1e-3),
    "ledge of a micrometre": (lambda y: y**2 + 1e-6 * (y > 0.5e-3), 2e-3),
    "groove with an edge": (offset(lambda y: np.maximum(0.0, GROOVE - y**2)), 5e-3),
    "groove without an edge": (
        offset(lambda y: GROOVE * np.maximum(0.0, 1.0 - (y / 3.4e-3) ** 2) ** 2),
        5e-3,
    ),
    "about to part": (lambda y: y**2 + 2e-6 * np.exp(-((y / 0.4e-3) ** 2)), 2.4e-3),
    "just parted": (lambda y: y**2 + 3e-6 * np.exp(-((y / 0.4e-3) ** 2)), 2.4e-3),
    "two patches": (lambda y: y**2 + 10e-6 * np.exp(-((y / 0.4e-3) ** 2)), 2.4e-3),
    "two short patches": (lambda y: 8.5 * (np.abs(y) - 0.5e-3) ** 2, 1.2e-3),
}
# of q and a (L1), approach and p0; at an edge the exact pressure is singular and p0 is infinite
BOUNDS = {
    "ends within the contact": (0.015, 0.01, 4e-3, np.inf),
    "ends on both sides": (0.02, 0.015, 4e-3, np.inf),
    "no crown": (0.02, 0.015, 5e-3, np.inf),
    "short": (0.04, 0.03, 5e-3, np.inf),
    "ledge of a micrometre": (0.012, 0.012, 2e-3, np.inf),
    "groove with an edge": (0.018, 0.015, 1e-3, np.inf),
    "groove without an edge": (0.006, 0.01, 2e-4, 2e-3),
    "about to part": (0.004, 0.008, 2e-4, 2e-3),
    "just parted": (0.005, 0.012, 2e-4, 2e-3),
    "two patches": (0.009, 0.011, 4e-4, 3e-3),
    "two short patches": (0.003, 0.006, 3e-4, 1e-3),
}


@pytest.mark.parametrize("name", PROFILES)
def test_edges_offsets_and_patches_are_near_exact_theory(name):
    errors = missed(*PROFILES[name])
    assert (np.array(errors) < BOUNDS[name]).all(), errors


@pytest.mark.parametrize("name", PROFILES)
def test_coupled_lengths_are_more_accurate_than_local_ones(name):
    coupled, local = missed(*PROFILES[name]), missed(*PROFILES[name], half_length="local")
    # the remaining error of the line load is mostly that of the strip width
    assert (np.array(coupled) < np.array([0.65, 0.65, 0.5, 1.0]) * local).all()


@pytest.mark.parametrize("strips", [81, 82])
def test_mirrored_profile_has_mirrored_half_lengths(strips):
    gap = PROFILES["groove with an edge"][0]
    one = solved(gap, 5e-3, strips)
    other = solved(lambda y: gap(-y), 5e-3, strips)
    for values, mirrored in (
        (one.half_length, other.half_length),
        (one.line_load, other.line_load),
    ):
        np.testing.assert_allclose(mirrored[::-1], values, rtol=1e-10)


def test_local_half_lengths_depend_on_own_line_load_only():
    found = solved(lambda y: 8.5 * y**2, 0.8e-3, 81, half_length="local")
    expected = np.sqrt(4.0 * found.line_load / (np.pi * MODULUS * RIG))
    np.testing.assert_allclose(found.half_length, expected, rtol=1e-12)
    assert found.peak_pressure == pytest.approx(0.5 * MODULUS * RIG * expected.max(), rel=1e-12)


def test_strips_wider_than_long_are_independent():
    wide = solved(lambda y: 1e-3 * y**2, 50e-3, 40)
    single = solved(lambda y: 1e-3 * y**2, 50e-3, 40, half_length="local")
    np.testing.assert_allclose(wide.half_length, single.half_length, rtol=1e-3)


def test_all_solve_methods_give_equal_half_lengths():
    grid = Grid.spanning(-1e-3, 1e-3, 61)
    model = SPEC.factory(SlenderOptions(), grid, MATERIALS)
    gap = 8.5 * grid.y**2
    single = model.solve_one(gap, RIG, POINT)
    batch = model.solve(ContactBatch.of(np.stack([gap, gap]), RIG, [POINT, POINT]))
    driven = replace(POINT, bearing_torque=0.1, rolling_radius=np.full(61, 0.02))
    for other in (*batch, model.solve_one(gap, RIG, driven)):
        np.testing.assert_array_equal(other.half_length, single.half_length)
        assert other.peak_pressure == pytest.approx(single.peak_pressure, rel=1e-14)
    fields = model.fields(single, gap, RIG, POINT)
    np.testing.assert_allclose(fields.x[-1], single.half_length, rtol=1e-14)
    assert fields.pressure.max() == pytest.approx(single.peak_pressure, rel=1e-3)
