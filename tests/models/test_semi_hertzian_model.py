"""The contact model `semi-hertzian`: against exact theory, and in a whole wear test."""

import numpy as np
import pytest
from scipy.integrate import trapezoid

from tests.materials import STEEL
from tests.studies.study_examples import short
from wearsim.errors import ContactError
from wearsim.models.contact.strip_model import SPEC, SemiHertzianOptions
from wearsim.studies.run import run as replay
from wearsim.types import Creepage, Grid, OperatingPoint

MATERIALS = (STEEL, STEEL)
RIG = 90.0
VARIANTS = ("kik-piotrowski", "ayasse-chollet", "analyn")
# upper limits of the L1 error of the line load on the profiles of `WORN`, in their order [%]
LINE_LOAD = {
    "kik-piotrowski": (18.0, 12.0, 14.5, 11.5, 12.0),
    "ayasse-chollet": (0.1, 7.5, 5.0, 5.0, 10.5),
    "analyn": (0.1, 6.5, 4.0, 3.5, 10.5),
}


def contact(variant="analyn", grid=None, gap=None, creepage=None, curvature=RIG, **options):
    chosen = SemiHertzianOptions(variant=variant, **options)
    if grid is None:
        grid = SPEC.suggest_grid(chosen, 2.0, curvature, 300.0, MATERIALS)
    model = SPEC.factory(chosen, grid, MATERIALS)
    gap = grid.y**2 if gap is None else gap(grid.y)
    creepage = dict(creepage or {"longitudinal": 1e-3})
    torque = creepage.pop("bearing_torque", None)
    radius = np.full(grid.strips, 0.02) if torque is not None else None
    point = OperatingPoint(300.0, 2.6, Creepage(**creepage), 0.1, torque, radius)
    return model, gap, point, model.solve_one(gap, curvature, point)


def carried_on(exact, y):
    """Return a worn profile, extrapolated by the parabola through the ends of its data."""
    gap = np.interp(y, exact["y"], exact["w"])
    for beyond, end in (
        (y < exact["y"][0], slice(0, 12)),
        (y > exact["y"][-1], slice(-12, None)),
    ):
        parabola = np.polynomial.Polynomial.fit(exact["y"][end], exact["w"][end], 2)
        gap[beyond] = parabola(y[beyond])
    return gap


def difference(exact, solution, name, attribute, power=1):
    found = np.interp(exact["y"], solution.y, getattr(solution, attribute))
    missed = np.abs(found - exact[name]) ** power
    return (missed.sum() / (exact[name] ** power).sum()) ** (1.0 / power)


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("tangential", ["strip", "fastrip", "fastsim"])
def test_power_is_the_work_of_the_rigid_slip(variant, tangential):
    creepage = {"longitudinal": -3e-4, "lateral": 2e-4, "spin": 0.4}
    *_, solution = contact(variant, creepage=creepage, tangential=tangential)
    work = -2.6 * (
        creepage["longitudinal"] * solution.force_x
        + creepage["lateral"] * solution.force_y
        + creepage["spin"] * solution.spin_moment
    )
    assert solution.power == pytest.approx(work, rel=1e-12)
    assert solution.power > 0.0


@pytest.mark.parametrize("variant", VARIANTS)
def test_fields_integrate_to_the_strips(variant):
    model, gap, point, solution = contact(variant, creepage={"longitudinal": 2e-4})
    fields = model.fields(solution, gap, RIG, point, points_along=2001)
    spacing = np.diff(solution.y)[0]

    def total(values):
        return trapezoid(values, fields.x, axis=0).sum() * spacing

    assert total(fields.pressure) == pytest.approx(300.0, rel=1e-4)
    assert fields.pressure.max() == pytest.approx(solution.peak_pressure, rel=1e-6)
    assert total(fields.traction_x) == pytest.approx(solution.force_x, rel=1e-3)
    assert total(fields.power_density) == pytest.approx(solution.power, rel=2e-3)


@pytest.mark.parametrize("variant", VARIANTS)
def test_free_roller_balances_its_bearing_torque(variant):
    *_, solution = contact(variant, creepage={"longitudinal": 0.0, "bearing_torque": 0.3})
    assert -0.02 * solution.force_x == pytest.approx(0.3, rel=1e-9)


def test_variants_have_their_capabilities():
    model, gap, point, hard = contact()
    assert SPEC.capabilities == model.capabilities
    assert model.capabilities.wear_compliance
    assert not model.capabilities.coupled
    soft = model.solve_one(gap, RIG, point, np.full(len(gap), 2e-12))
    assert soft.peak_pressure < hard.peak_pressure
    assert soft.line_load.sum() == pytest.approx(hard.line_load.sum(), rel=1e-12)


@pytest.mark.parametrize("variant", VARIANTS)
def test_solution_is_independent_of_the_initial_guess(variant):
    model, gap, point, solution = contact(variant)
    _, _, _, other = contact(variant, gap=lambda y: 0.7 * y**2)
    again = model.solve_one(gap, RIG, point, None, other)
    np.testing.assert_array_equal(again.line_load, solution.line_load)


def test_contact_at_the_edge_of_its_strips_is_an_error():
    with pytest.raises(
        ContactError, match=r"raise contact\.width or move contact\.centre"
    ) as caught:
        contact(grid=Grid.spanning(-1e-3, 1e-3, 51))
    assert set(caught.value.state) >= {"gap", "line_load", "approach"}


def test_too_narrow_strips_are_an_error():
    with pytest.raises(ContactError, match=r"lower contact\.strips"):
        contact(grid=Grid.spanning(-1.8e-5, 1.8e-5, 51))


def test_input_that_is_not_finite_is_an_error():
    with pytest.raises(ContactError, match="not finite"):
        contact(gap=lambda y: np.where(y > 0.0, np.nan, y**2))


@pytest.mark.parametrize("variant", VARIANTS)
def test_implicit_wear_test_reaches_the_slender_depth(variant):
    depth = {}
    for model in ("semi-hertzian", "slender"):
        own = {"contact__variant": variant} if model == "semi-hertzian" else {}
        scenario = short(
            contact__model=model,
            contact__width="10 mm",
            operation__passes=200_000,
            evolution__tolerance=0.005,
            evolution__stepper="implicit",
            **own,
        )
        ending = replay.run(scenario)
        assert ending.finished
        depth[model] = float(ending.depth[-1])
    assert depth["semi-hertzian"] == pytest.approx(depth["slender"], rel=0.02)
