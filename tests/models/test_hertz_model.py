"""The contact model `hertz`: Hertz's patch on any grid, with each tangential theory."""

import numpy as np
import pytest
from scipy.integrate import trapezoid

from tests.materials import STEEL
from wearsim.contact_batch import ContactBatch
from wearsim.errors import CapabilityError, ContactError
from wearsim.mechanics.hertz.elasticity import combine
from wearsim.mechanics.hertz.ellipse import hertz
from wearsim.models.contact.hertz import SPEC, HertzModel, Patch, strips_over_patch
from wearsim.models.contact.hertz_fastsim import HertzFastsim, HertzFastsimOptions
from wearsim.models.contact.strip_model import tangential_theory
from wearsim.models.tangential.base import EllipseStrips
from wearsim.types import Creepage, Grid, OperatingPoint

MATERIALS = (STEEL, STEEL)
PAIR = combine(*MATERIALS)
RIG = (90.0, 2.0)  # relative curvatures along and across
THEORIES = ("strip", "fastrip", "fastsim")


def contact(grid=None, creepage=(1e-3, 0.0, 0.0), load=300.0, mu=0.1, shape=None, **options):
    """Solve the rig's contact; `options` as in a scenario."""
    chosen = SPEC.options(**options)
    if grid is None:
        grid = SPEC.suggest_grid(chosen, RIG[1], RIG[0], load, MATERIALS)
    model = SPEC.factory(chosen, grid, MATERIALS)
    gap = grid.y**2 if shape is None else shape(grid.y)
    point = OperatingPoint(load, 2.618, Creepage(*creepage), mu)
    return model, gap, point, model.solve_one(gap, RIG[0], point)


def test_patch_is_that_of_hertz():
    *_, solution = contact()
    patch = hertz(45.0, 1.0, 300.0, PAIR.contact_modulus)
    assert solution.peak_pressure == pytest.approx(patch.peak_pressure, rel=1e-9)
    assert solution.approach == pytest.approx(patch.approach, rel=1e-9)
    assert solution.half_length == pytest.approx(patch.half_length(solution.y), rel=1e-9)
    assert solution.line_load.sum() * (solution.y[1] - solution.y[0]) == pytest.approx(300.0)


@pytest.mark.parametrize("creepage", [(5e-4, 2e-4, 0.0), (5e-4, 2e-4, 0.3)])
@pytest.mark.parametrize("bound", ["parabolic", "elliptic"])
def test_with_fastsim_it_equals_hertz_fastsim(bound, creepage):
    *_, found = contact(creepage=creepage, tangential="fastsim", bound=bound)
    options = HertzFastsimOptions(bound=bound)
    grid = strips_over_patch(options, RIG[1], RIG[0], 300.0, MATERIALS)
    model = HertzFastsim(options, grid, MATERIALS)
    point = OperatingPoint(300.0, 2.618, Creepage(*creepage), 0.1)
    expected = model.solve_one(grid.y**2, RIG[0], point)
    greatest = expected.dissipation.max()
    assert found.dissipation == pytest.approx(expected.dissipation, rel=0.0, abs=1e-13 * greatest)


@pytest.mark.parametrize("tangential", THEORIES)
def test_power_is_smooth_with_partly_covered_strips(tangential):
    chosen = {"tangential": tangential, "creepage": (6e-4, 3e-4, 0.05)}
    exact = contact(my=1000, **chosen)[-1]
    for half in np.linspace(3.0e-3, 3.2e-3, 9):
        found = contact(Grid.spanning(-half, half, 81), **chosen)[-1]
        assert found.power == pytest.approx(exact.power, rel=2e-3)
        assert found.force_x == pytest.approx(exact.force_x, rel=2e-3)


@pytest.mark.parametrize("tangential", THEORIES)
def test_strips_may_end_anywhere_near_the_patch_edge(tangential):
    rng, b = np.random.default_rng(5), 1.5e-3
    patch = Patch(a="0.14 mm", b="1.5 mm")
    theory = tangential_theory(SPEC.options(tangential=tangential))
    point = OperatingPoint(300.0, 2.618, Creepage(6e-4, 3e-4, 0.05), 0.1)

    def power(grid):
        model = HertzModel(theory, grid, MATERIALS, patch)
        return model.solve_one(grid.y**2, RIG[0], point).power

    exact = power(Grid.spanning(-b, b, 2000))
    for _ in range(150):
        strips, beyond = int(rng.integers(60, 90)), int(rng.integers(1, 4))
        off = rng.choice((-1.0, 1.0)) * 10.0 ** rng.uniform(-18.0, -6.0)
        half = b * (1.0 + off) * strips / (strips - 2 * beyond)  # an edge is at b (1 + off)
        assert power(Grid.spanning(-half, half, strips)) == pytest.approx(exact, rel=3e-3)


def test_loaded_strips_have_a_positive_squared_half_length():
    ellipse = hertz(45.0, 1.0, 300.0, PAIR.contact_modulus)
    for covered in 10.0 ** np.arange(-30.0, 0.0):
        for load, half_length in ((1e-30, 1e-12), (0.0, 1e-12), (1e-30, 0.0)):
            part, one = np.array([1.0, covered]), np.ones(2)
            strips = EllipseStrips(
                y=one,
                half_length=np.array([1e-4, half_length]),
                line_load=np.array([1e5, load]),
                spacing=1e-4,
                longitudinal_curvature=90.0,
                approach=1e-6,
                peak_pressure=1e9,
                iterations=0,
                ellipse=ellipse,
                from_centre=one,
                coverage=part,
            ).whole()
            assert (strips.half_length[1] > 0.0) == (strips.line_load[1] > 0.0)
            assert np.isfinite(strips.line_load[1] ** 2 / max(strips.half_length[1] ** 2, 1e-60))
            assert strips.line_load[0] == 1e5


@pytest.mark.parametrize("tangential", THEORIES)
def test_gross_sliding_has_full_friction_at_any_coverage(tangential):
    grid = Grid.spanning(-2.05e-3, 2.05e-3, 23)
    *_, solution = contact(grid, (0.05, 0.0, 0.0), tangential=tangential)
    assert solution.force_x == pytest.approx(-30.0, rel=2e-2)
    touching = solution.line_load > 0.0
    assert np.any(solution.line_load[touching] < 0.5 * solution.line_load.max())
    sliding = solution.dissipation[touching] / (2.618 * 0.05 * 0.1)
    tolerance = 0.1 if tangential == "fastsim" else 0.02
    assert sliding == pytest.approx(solution.line_load[touching], rel=tolerance)


@pytest.mark.parametrize("tangential", THEORIES)
def test_power_is_the_work_of_the_rigid_slip(tangential):
    _, _, point, found = contact(
        Grid.spanning(-2.7e-3, 2.7e-3, 77), (4e-4, 5e-4, 0.2), tangential=tangential
    )
    work = 4e-4 * found.force_x + 5e-4 * found.force_y + 0.2 * found.spin_moment
    assert found.power == pytest.approx(-point.rolling_speed * work, rel=1e-12)


@pytest.mark.parametrize("tangential", THEORIES)
def test_worn_profile_is_fitted_again(tangential):
    def groove(y):
        return y**2 + 0.95 * np.maximum(17e-6 - (y - 2e-4) ** 2, 0.0)

    grid = Grid.spanning(-9e-3, 9e-3, 181)
    *_, fresh = contact(grid, tangential=tangential)
    *_, worn = contact(grid, shape=groove, tangential=tangential)
    assert worn.line_load.sum() * grid.spacing == pytest.approx(300.0, rel=1e-12)
    wide = [np.count_nonzero(found.line_load) for found in (fresh, worn)]
    assert wide[1] > 1.2 * wide[0]


@pytest.mark.parametrize("tangential", THEORIES)
def test_friction_torque_and_creepage_may_be_local(tangential):
    model, gap, _, whole = contact(tangential=tangential)
    friction = np.where(np.arange(50) < 25, 0.1, 0.05)
    half = model.solve_one(gap, RIG[0], OperatingPoint(300.0, 2.618, Creepage(1e-3), friction))
    assert half.dissipation[:20] == pytest.approx(whole.dissipation[:20], rel=2e-2)
    assert np.all(half.dissipation[25:] < whole.dissipation[25:])
    torque = OperatingPoint(
        300.0, 2.618, Creepage(0.0), 0.1, bearing_torque=0.1, rolling_radius=np.full(50, 20e-3)
    )
    assert -model.solve_one(gap, RIG[0], torque).force_x * 20e-3 == pytest.approx(0.1, rel=1e-9)
    varied = Creepage(1e-4, variation=300.0 * whole.y**2)
    assert np.isfinite(model.solve_one(gap, RIG[0], OperatingPoint(300.0, 1.0, varied, 0.1)).power)


@pytest.mark.parametrize("tangential", THEORIES)
def test_fields_integrate_to_load_and_traction(tangential):
    grid = Grid.spanning(-2.2e-3, 2.2e-3, 60)
    model, gap, point, solution = contact(grid, (6e-4, 0.0, 0.0), tangential=tangential)
    fields = model.fields(solution, gap, RIG[0], point, points_along=401)
    half = hertz(45.0, 1.0, 300.0, PAIR.contact_modulus).b
    edges = np.append(-2.2e-3, solution.y + 0.5 * grid.spacing)
    width = np.diff(np.clip(edges, -half, half))
    if tangential == "strip":  # which does not support partly covered strips
        width[width > 0.0] = grid.spacing
    load = np.dot(trapezoid(fields.pressure, fields.x, axis=0), width)
    assert load == pytest.approx(300.0, rel=5e-3)
    force = np.dot(trapezoid(fields.traction_x, fields.x, axis=0), width)
    assert force == pytest.approx(solution.force_x, rel=1e-2)


def test_batch_equals_single_solutions():
    model, gap, point, single = contact(creepage=(4e-4, 3e-4, 0.1), tangential="fastrip")
    found = model.solve(ContactBatch.of(np.array([gap, gap]), RIG[0], [point, point]))
    assert found.dissipation[1] == pytest.approx(single.dissipation, rel=1e-14)


def test_missing_capabilities_are_refused():
    model, gap, point, _ = contact()
    with pytest.raises(CapabilityError, match="HertzModel does not support wear compliance"):
        model.solve_one(gap, RIG[0], point, np.zeros_like(gap))
    field = OperatingPoint(300.0, 2.618, Creepage(1e-3), np.full((50, 50), 0.1))
    with pytest.raises(CapabilityError, match="from point to point"):
        model.solve_one(gap, RIG[0], field)
    with pytest.raises(ContactError, match="contact is lost"):
        contact(Grid.spanning(-3e-3, 3e-3, 61), load=0.0)
    for tangential in THEORIES:
        for bad in ({"mu": np.nan}, {"creepage": (np.nan, 0.0, 0.0)}):
            with pytest.raises(ContactError, match="power is not finite"):
                contact(tangential=tangential, **bad)


def test_spec_builds_its_model():
    assert SPEC.name == "hertz"
    grid = Grid.spanning(-3e-3, 3e-3, 50)
    assert isinstance(SPEC.factory(SPEC.options(), grid, MATERIALS), HertzModel)
    assert SPEC.capabilities == HertzModel.capabilities
