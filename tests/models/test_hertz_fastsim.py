"""The contact model `hertz-fastsim`, and FASTSIM on the strips of other contacts."""

import math

import numpy as np
import pytest
from hertz_fastsim_examples import MATERIALS, PAIR, RIG, SPEED, balance, contact, groove
from hypothesis import given, settings, strategies as st
from pydantic import ValidationError
from scipy.integrate import trapezoid

from tests.mechanics.tangential.kalker_closed_form import closed_form_parabolic
from wearsim.errors import CapabilityError, ContactError
from wearsim.mechanics.hertz.ellipse import hertz
from wearsim.mechanics.tangential.kalker_coefficients import creepage_coefficients, flexibilities
from wearsim.models.contact.hertz_fastsim import SPEC, HertzFastsim, HertzFastsimOptions
from wearsim.models.tangential.base import Strips, complete, equivalent_ellipse
from wearsim.models.tangential.fastsim import FastsimTheory
from wearsim.types import Creepage, Grid, OperatingPoint


def test_mean_problem_power_in_closed_form_is_0_073873_watts():
    *_, solution = contact(kalker="line-limit", my=1000)
    assert solution.power == pytest.approx(0.073873, rel=1e-5)


def test_fastsim_50_by_50_is_within_a_thousandth_of_it():
    *_, solution = contact(kalker="line-limit", closed_form="never")
    assert solution.power == pytest.approx(0.073873, rel=1e-3)


def test_given_coefficients_replace_the_table():
    limit = {"c11": math.pi**2 / 2.8, "c22": math.pi**2 / 4.0, "c23": 0.471}
    given_power = contact(kalker_coefficients=limit)[-1].power
    assert given_power == pytest.approx(contact(kalker="line-limit")[-1].power, rel=1e-12)


def test_element_sum_is_too_low_and_of_first_order():
    exact = contact(kalker="line-limit", my=1000)[-1].power
    low = [
        contact(kalker="line-limit", dissipation="element-sum", mx=n, my=n)[-1].power / exact - 1.0
        for n in (25, 50, 100)
    ]
    assert low[1] == pytest.approx(-0.0325, abs=5e-4)
    assert np.log2(np.divide(low[:-1], low[1:])) == pytest.approx(1.0, abs=0.05)


def test_patch_is_that_of_hertz():
    *_, solution = contact()
    patch = hertz(45.0, 1.0, 300.0, PAIR.contact_modulus)
    assert solution.peak_pressure == pytest.approx(patch.peak_pressure, rel=1e-9)
    assert solution.approach == pytest.approx(patch.approach, rel=1e-9)
    assert solution.half_length == pytest.approx(patch.half_length(solution.y), rel=1e-9)


GRIDS = st.builds(lambda half, strips: Grid.spanning(-half, half, strips),
                  st.floats(2.4e-3, 9e-3), st.integers(31, 300))  # fmt: skip


@settings(deadline=None, max_examples=40)
@given(GRIDS, st.floats(-0.8e-3, 0.8e-3), st.floats(-1e-3, 1e-3), st.floats(-0.5, 0.5))
def test_load_and_energy_balance_hold_on_any_grid(grid, yc, eta, phi):
    _, _, point, solution = contact(grid, (1e-3, eta, phi), shape=lambda y: 2e-6 + (y - yc) ** 2)
    assert solution.line_load.sum() * grid.spacing == pytest.approx(300.0, rel=1e-12)
    assert solution.power == pytest.approx(balance(point, solution), rel=1e-12)
    assert np.all(solution.line_load >= 0.0)
    assert solution.approach == pytest.approx(2e-6 + 3.22274e-6, rel=1e-6)


@pytest.mark.parametrize("bound", ["parabolic", "elliptic"])
def test_power_is_smooth_with_partly_covered_strips(bound):
    exact = contact(my=1000, bound=bound)[-1].power
    for half in np.linspace(3.0e-3, 3.2e-3, 9):
        power = contact(Grid.spanning(-half, half, 81), bound=bound)[-1].power
        assert power == pytest.approx(exact, rel=1e-3)


@pytest.mark.parametrize("closed_form", ["exact", "always", "never"])
def test_mirrored_contact_has_the_mirrored_solution(closed_form):
    grid = Grid.spanning(-3e-3, 3e-3, 60)
    solutions = [
        contact(
            grid,
            (8e-4, sign * 4e-4, 0.0 if closed_form == "exact" else sign * 0.4),
            shape=lambda y, s=sign: (y - s * 3e-4) ** 2,
            closed_form=closed_form,
        )[-1]
        for sign in (1.0, -1.0)
    ]
    one, other = solutions
    assert one.dissipation == pytest.approx(other.dissipation[::-1], rel=1e-9, abs=1e-12)
    assert one.force_y == pytest.approx(-other.force_y, rel=1e-9)
    assert one.spin_moment == pytest.approx(-other.spin_moment, rel=1e-9, abs=1e-15)


def test_one_flexibility_is_the_weighted_mean_of_three():
    xi, eta = 3e-4, -4e-4
    *_, solution = contact(creepage=(xi, eta, 0.0), flexibility="one", my=400)
    assert solution.force_y / solution.force_x == pytest.approx(eta / xi, rel=1e-12)
    patch = hertz(45.0, 1.0, 300.0, PAIR.contact_modulus)
    three = flexibilities(
        creepage_coefficients(patch.a / patch.b, 0.3), patch.a, patch.b, PAIR.shear_modulus
    )
    mean = (3.0 * three.longitudinal + 4.0 * three.lateral) / 5.0
    half = patch.half_length(solution.y)
    expected = closed_form_parabolic(patch.a, patch.b, 300.0, 0.1, 5e-4, mean, half)
    assert solution.dissipation == pytest.approx(SPEED * 5e-4 * expected, rel=1e-9)


@pytest.mark.parametrize("creepage", [(5e-4, 0.0, 0.0), (0.0, 5e-4, 0.0), (0.0, 0.0, 0.7)])
def test_one_flexibility_is_kalkers_for_a_single_creepage(creepage):
    one, three = (
        contact(creepage=creepage, flexibility=name, closed_form="never")[-1]
        for name in ("one", "three")
    )
    assert one.dissipation == pytest.approx(three.dissipation, rel=1e-12)


def test_one_flexibility_in_gross_sliding_follows_creepage():
    # with three the traction has the direction of that with adhesion
    creepage = (0.012, 0.016, 0.0)
    *_, one = contact(creepage=creepage, flexibility="one")
    *_, three = contact(creepage=creepage)
    assert one.force_y / one.force_x == pytest.approx(4.0 / 3.0, rel=1e-12)
    assert one.power > 1.01 * three.power
    assert one.power == pytest.approx(SPEED * 30.0 * 0.02, rel=1e-3)


@pytest.mark.parametrize("depth", [1e-6, 5e-6, 17e-6, 48e-6])
def test_worn_profile_has_a_wider_patch_with_the_same_load(depth):
    grid = Grid.spanning(-9e-3, 9e-3, 181)
    _, _, point, solution = contact(grid, shape=groove(depth, 2e-4))
    assert solution.line_load.sum() * grid.spacing == pytest.approx(300.0, rel=1e-12)
    width = np.count_nonzero(solution.line_load) * grid.spacing
    assert width > 3.08978e-3
    assert solution.power == pytest.approx(balance(point, solution), rel=1e-12)


def test_solution_is_independent_of_the_initial_guess():
    grid = Grid.spanning(-9e-3, 9e-3, 181)
    model, gap, point, cold = contact(grid, shape=groove(17e-6))
    warm = model.solve_one(gap, RIG[0], point, None, cold)
    assert np.array_equal(warm.dissipation, cold.dissipation)


@pytest.mark.parametrize(
    ("shape", "match"),
    [
        (lambda y: -(y**2), "curvature over .* needs it positive"),
        (lambda y: 1e-3 * y**2, "extends beyond its strips"),
        (lambda y: (y - 2.8e-3) ** 2, "extends beyond its strips"),
        (lambda y: 1e5 * y**2, "fewer than three strips"),
        (lambda y: np.where(y > 0.0, np.nan, y**2), "not finite"),
    ],
)
def test_profiles_without_hertz_solution_raise_with_state(shape, match):
    with pytest.raises(ContactError, match=match) as caught:
        contact(Grid.spanning(-3e-3, 3e-3, 61), shape=shape)
    assert {"gap", "normal_force"} <= set(caught.value.state)


def test_nan_input_is_an_error():
    with pytest.raises(ContactError, match="power is not finite"):
        contact(creepage=(math.nan, 0.0, 0.0))


def test_lost_contact_is_an_error():
    with pytest.raises(ContactError, match="contact is lost"):
        contact(Grid.spanning(-3e-3, 3e-3, 61), load=0.0)


def test_wear_compliance_is_refused():
    model, gap, point, _ = contact()
    with pytest.raises(CapabilityError, match="stepper = 'stabilised'"):
        model.solve_one(gap, RIG[0], point, np.zeros_like(gap))


def test_prescribed_patch_determines_pressure_and_power():
    patch = {"a": "0.2 mm", "b": "2 mm"}
    _, _, point, solution = contact(patch=patch)
    assert solution.peak_pressure == pytest.approx(1.5 * 300.0 / (math.pi * 2e-4 * 2e-3))
    assert solution.line_load.sum() * (solution.y[1] - solution.y[0]) == pytest.approx(300.0)
    assert solution.half_length.max() == pytest.approx(2e-4, rel=1e-3)
    grid = Grid.spanning(-6e-3, 6e-3, 121)
    worn = contact(grid, patch=patch, shape=lambda y: groove(20e-6)(y - 1e-4))[-1]
    centre = np.dot(worn.y, worn.line_load) / worn.line_load.sum()
    assert centre == pytest.approx(1e-4, abs=1e-6)
    assert worn.power == pytest.approx(solution.power, rel=2e-3)
    assert solution.power == pytest.approx(balance(point, solution), rel=1e-12)
    with pytest.raises(ContactError, match="needs it positive"):
        contact(grid, patch=patch, shape=lambda y: -(y**2))
    with pytest.raises(ContactError, match="extends beyond its strips"):
        contact(Grid.spanning(-1.5e-3, 1.5e-3, 31), patch=patch)


def test_bearing_torque_determines_the_creepage():
    model, gap, _, _ = contact()
    point = OperatingPoint(
        300.0, SPEED, Creepage(0.0), 0.1, bearing_torque=0.1, rolling_radius=np.full(50, 20e-3)
    )
    solution = model.solve_one(gap, RIG[0], point)
    assert -solution.force_x * 20e-3 == pytest.approx(0.1, rel=1e-9)
    assert solution.longitudinal_creepage > 0.0
    with pytest.raises(ContactError, match="skids"):
        model.solve_one(
            gap,
            RIG[0],
            OperatingPoint(
                300.0, SPEED, Creepage(0.0), 0.1, bearing_torque=1.0,
                rolling_radius=np.full(50, 20e-3),
            ),
        )  # fmt: skip


def test_creepage_may_vary_from_strip_to_strip():
    model, gap, _, _ = contact()
    grid = SPEC.suggest_grid(HertzFastsimOptions(), RIG[1], RIG[0], 300.0, MATERIALS)
    creepage = Creepage(1e-3, variation=200.0 * grid.y**2)
    point = OperatingPoint(300.0, SPEED, creepage, 0.1)
    for closed_form in ("exact", "never"):
        options = HertzFastsimOptions(closed_form=closed_form, mx=400)
        chosen = HertzFastsim(options, grid, MATERIALS)
        solution = chosen.solve_one(gap, RIG[0], point)
        mean = np.dot(creepage.variation, solution.line_load) / solution.line_load.sum()
        local = 1e-3 + creepage.variation - mean
        assert np.all(solution.dissipation[np.abs(local) > 1e-6] > 0.0)
        powers = solution.power
    assert powers == pytest.approx(model.solve_one(gap, RIG[0], point).power, rel=1e-4)


@pytest.mark.parametrize("bound", ["parabolic", "elliptic"])
def test_fields_integrate_to_the_solution(bound):
    creepage = (6e-4, 3e-4, 0.0)
    model, gap, point, solution = contact(creepage=creepage, bound=bound, closed_form="never")
    fields = model.fields(solution, gap, RIG[0], point, points_along=801)
    assert fields.x.shape == fields.slip_x.shape == (801, 50)
    assert np.all(np.diff(fields.x, axis=0) > 0.0)
    spacing = solution.y[1] - solution.y[0]
    force = trapezoid(fields.traction_x, fields.x, axis=0).sum() * spacing
    assert force == pytest.approx(solution.force_x, rel=2e-3)
    load = trapezoid(fields.pressure, fields.x, axis=0).sum() * spacing
    assert load == pytest.approx(300.0, rel=2e-3)
    power = trapezoid(fields.power_density, fields.x, axis=0).sum() * spacing
    assert power == pytest.approx(solution.power, rel=1e-2)
    traction = np.hypot(fields.traction_x, fields.traction_y)
    # a parabolic bound exceeds mu p by up to 4/3 in a strip, but not in the sum of all strips
    excess = 1.0 if bound == "elliptic" else 4.0 / 3.0
    assert np.all(traction <= 0.1 * excess * fields.pressure + 1e-3)
    assert fields.pressure.max() == pytest.approx(solution.peak_pressure, rel=2e-3)
    assert np.all(fields.power_density[fields.adhesion] == 0.0)
    assert np.all(fields.power_density >= -1e-6 * fields.power_density.max())


def test_closed_form_with_spin_keeps_the_energy_balance():
    *_, point, solution = contact(creepage=(6e-4, 3e-4, 0.2), closed_form="always")
    assert solution.power == pytest.approx(balance(point, solution), rel=1e-12)


def hertz_strips(strips=81):
    """Return the strips of the patch of the rig as plain `Strips`."""
    patch = hertz(45.0, 1.0, 300.0, PAIR.contact_modulus)
    grid = Grid.spanning(-1.1 * patch.b, 1.1 * patch.b, strips)
    load = np.diff(
        patch.load_below(np.append(grid.y, grid.y[-1] + grid.spacing) - 0.5 * grid.spacing)
    )
    half = np.sqrt(4.0 * load / grid.spacing / (math.pi * PAIR.contact_modulus * RIG[0]))
    return patch, Strips(
        grid.y, half, load / grid.spacing, grid.spacing, RIG[0], 0.0, patch.peak_pressure, 0
    )


def test_equivalent_ellipse_of_an_ellipse_is_nearly_itself():
    patch, strips = hertz_strips(401)
    a, b = equivalent_ellipse(strips)
    # a(y) of a line contact with the Hertzian line load differs by 0.5 % from Hertz's
    assert (a, b) == pytest.approx((patch.a, patch.b), rel=1e-2)


def test_other_strips_have_nearly_the_power_of_the_ellipse():
    _, strips = hertz_strips(401)
    point = OperatingPoint(300.0, SPEED, Creepage(1e-3), 0.1)
    for bound in ("parabolic", "elliptic"):
        found = complete(FastsimTheory(bound), strips, PAIR, point)
        expected = contact(bound=bound)[-1].power
        # Kalker's parabola has 4/3 (1 - y^2/b^2)^(1/2) of Hertz's line load: more of it slips
        assert found.power == pytest.approx(expected, rel=0.05 if bound == "parabolic" else 0.01)
        assert found.power == pytest.approx(balance(point, found), rel=1e-12)


def test_options_are_validated_and_described():
    for bad in ({"mx": 1}, {"my": 2}, {"bound": "flat"}, {"kalker_coefficients": {"c11": -1.0}}):
        with pytest.raises(ValidationError):
            HertzFastsimOptions(**bad)
    for field in HertzFastsimOptions.model_fields.values():
        assert field.description
    assert HertzFastsimOptions(patch={"a": "0.1 mm", "b": "1 mm"}).patch.b == 1e-3


def test_spec_builds_its_model():
    model = SPEC.factory(SPEC.options(), Grid.spanning(-3e-3, 3e-3, 50), MATERIALS)
    assert isinstance(model, HertzFastsim)
    assert SPEC.name == "hertz-fastsim"
    assert not model.capabilities.wear_compliance
    assert not model.capabilities.pass_loop
