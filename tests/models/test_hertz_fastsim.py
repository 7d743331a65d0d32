"""The contact model `hertz-fastsim`, and FASTSIM on the strips of other contacts."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from tests.materials import STEEL
from tests.mechanics.tangential.kalker_closed_form import closed_form_parabolic
from wearsim.contact_batch import OperatingPoints
from wearsim.errors import CapabilityError, ContactError
from wearsim.mechanics.hertz.elasticity import combine
from wearsim.mechanics.hertz.ellipse import hertz
from wearsim.mechanics.tangential.kalker_coefficients import creepage_coefficients, flexibilities
from wearsim.models.contact.equivalent_ellipse import equivalent_ellipse
from wearsim.models.contact.hertz_fastsim import SPEC, HertzFastsim, HertzFastsimOptions
from wearsim.models.tangential.base import Strips, complete
from wearsim.models.tangential.fastsim import FastsimTheory
from wearsim.types import Creepage, Grid, OperatingPoint

MATERIALS = (STEEL, STEEL)
PAIR = combine(*MATERIALS)
SPEED = 1000.0 * 2.0 * math.pi / 60.0 * 25e-3
RIG = (90.0, 2.0)  # relative curvatures along and across


def contact(grid=None, creepage=(1e-3, 0.0, 0.0), load=300.0, mu=0.1, shape=None, **options):
    """Solve the rig's contact; `options` as in a scenario."""
    model = HertzFastsim(HertzFastsimOptions(**options))
    if grid is None:
        grid = model.suggest_grid(RIG[1], RIG[0], load, MATERIALS)
    model.prepare(grid, MATERIALS)
    gap = grid.y**2 if shape is None else shape(grid.y)
    point = OperatingPoint(load, SPEED, Creepage(*creepage), mu)
    return model, gap, point, model.solve(gap, RIG[0], point)


def balance(point, solution):
    creepage = point.creepage
    return -point.rolling_speed * (
        solution.longitudinal_creepage * solution.force_x
        + creepage.lateral * solution.force_y
        + creepage.spin * solution.spin_moment
    )


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


def groove(depth, offset=0.0):
    return lambda y: y**2 + 0.95 * np.maximum(depth - (y - offset) ** 2, 0.0)


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
    warm = model.solve(gap, RIG[0], point, None, cold)
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
        model.solve(gap, RIG[0], point, np.zeros_like(gap))


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
    solution = model.solve(gap, RIG[0], point)
    assert -solution.force_x * 20e-3 == pytest.approx(0.1, rel=1e-9)
    assert solution.longitudinal_creepage > 0.0
    with pytest.raises(ContactError, match="skids"):
        model.solve(
            gap,
            RIG[0],
            OperatingPoint(
                300.0, SPEED, Creepage(0.0), 0.1, bearing_torque=1.0,
                rolling_radius=np.full(50, 20e-3),
            ),
        )  # fmt: skip


def test_friction_may_differ_from_strip_to_strip():
    model, gap, _, whole = contact()
    friction = np.where(np.arange(50) < 25, 0.1, 0.05)
    half = model.solve(gap, RIG[0], OperatingPoint(300.0, SPEED, Creepage(1e-3), friction))
    assert half.dissipation[:25] == pytest.approx(whole.dissipation[:25], rel=1e-12)
    assert np.all(half.dissipation[25:] < whole.dissipation[25:])


def test_creepage_may_vary_from_strip_to_strip():
    model, gap, _, _ = contact()
    y = model.suggest_grid(RIG[1], RIG[0], 300.0, MATERIALS).y
    creepage = Creepage(1e-3, variation=200.0 * y**2)
    point = OperatingPoint(300.0, SPEED, creepage, 0.1)
    for closed_form in ("exact", "never"):
        chosen = HertzFastsim(HertzFastsimOptions(closed_form=closed_form, mx=400))
        chosen.prepare(model.suggest_grid(RIG[1], RIG[0], 300.0, MATERIALS), MATERIALS)
        solution = chosen.solve(gap, RIG[0], point)
        mean = np.dot(creepage.variation, solution.line_load) / solution.line_load.sum()
        local = 1e-3 + creepage.variation - mean
        assert np.all(solution.dissipation[np.abs(local) > 1e-6] > 0.0)
        powers = solution.power
    assert powers == pytest.approx(model.solve(gap, RIG[0], point).power, rel=1e-4)


@pytest.mark.parametrize("bound", ["parabolic", "elliptic"])
def test_fields_integrate_to_the_solution(bound):
    creepage = (6e-4, 3e-4, 0.0)
    model, gap, point, solution = contact(creepage=creepage, bound=bound, closed_form="never")
    fields = model.fields(solution, gap, RIG[0], point, points_along=801)
    assert fields.x.shape == fields.slip_x.shape == (801, 50)
    assert np.all(np.diff(fields.x, axis=0) > 0.0)
    spacing = solution.y[1] - solution.y[0]
    force = np.trapezoid(fields.traction_x, fields.x, axis=0).sum() * spacing
    assert force == pytest.approx(solution.force_x, rel=2e-3)
    load = np.trapezoid(fields.pressure, fields.x, axis=0).sum() * spacing
    assert load == pytest.approx(300.0, rel=2e-3)
    power = np.trapezoid(fields.power_density, fields.x, axis=0).sum() * spacing
    assert power == pytest.approx(solution.power, rel=1e-2)
    traction = np.hypot(fields.traction_x, fields.traction_y)
    # a parabolic bound exceeds mu p by up to 4/3 in a strip, but not in the sum of all strips
    excess = 1.0 if bound == "elliptic" else 4.0 / 3.0
    assert np.all(traction <= 0.1 * excess * fields.pressure + 1e-3)
    assert fields.pressure.max() == pytest.approx(solution.peak_pressure, rel=2e-3)
    assert np.all(fields.power_density[fields.adhesion] == 0.0)
    assert np.all(fields.power_density >= -1e-6 * fields.power_density.max())


CONTACTS = 60


def draws(contacts=CONTACTS, seed=0):
    """Return operating points as in the paper: load, creepage, yaw, tilt and friction."""
    random = np.random.default_rng(seed)
    radius, angle = 2e-3 * np.sqrt(random.random(contacts)), 2 * np.pi * random.random(contacts)
    return OperatingPoints(
        normal_force=random.normal(307.0, 32.0, contacts),
        longitudinal=np.abs(random.normal(1e-3, 4e-4, contacts)),
        lateral=radius * np.cos(angle),
        spin=radius * np.sin(angle) / 20e-3,
        friction=np.abs(random.normal(0.1, 0.02, contacts)),
        rolling_speed=SPEED,
    )


def batch(points, shape=None, half=3e-3, strips=50, **options):
    """Solve the contacts of the rig at `points` as a batch, on one gap or on several."""
    model, grid = HertzFastsim(HertzFastsimOptions(**options)), Grid.spanning(-half, half, strips)
    model.prepare(grid, MATERIALS)
    gap = np.broadcast_to(grid.y**2, (1, 1, len(points), strips))
    if shape is not None:
        gap = np.array([shape(grid.y, k) for k in range(len(points))])[None, None]
    return model, gap, model.solve_batch(gap, RIG[0], points)


def assert_same(found, expected):
    for name, value in vars(expected).items():
        # adhesion is counted in points; a moment is a small difference of forces times arms
        scale = 300.0 * 3e-3 if name == "spin_moment" else np.abs(value).max()
        assert getattr(found, name) == pytest.approx(value, rel=0.0, abs=1e-13 * scale), name
        assert type(getattr(found, name)) is type(value)


OPTIONS = [
    {},
    {"closed_form": "always"},
    {"closed_form": "never", "bound": "elliptic", "mx": 17},
    {"dissipation": "element-sum"},
    {"kalker": "line-limit"},
    {"kalker_coefficients": {"c11": 4.0, "c22": 3.0, "c23": 0.5}},
    {"patch": {"a": "0.2 mm", "b": "2 mm"}},
    {"flexibility": "one", "closed_form": "never"},
    {"flexibility": "one", "dissipation": "element-sum", "bound": "elliptic"},
]


@pytest.mark.parametrize("spin", [True, False])
@pytest.mark.parametrize("options", OPTIONS)
def test_batch_equals_single_solutions(options, spin):
    points = draws() if spin else replace(draws(), spin=np.zeros(CONTACTS))
    model, gap, found = batch(points, **options)
    assert found.stack("line_load").shape == (1, 1, CONTACTS, 50)
    for k in range(0, CONTACTS, 4):
        assert_same(found.solutions[k], model.solve(gap[0, 0, k], RIG[0], points[k]))


@pytest.mark.parametrize("flexibility", ["three", "one"])
def test_batch_supports_any_gap_friction_and_creepage(flexibility):
    random = np.random.default_rng(1)
    shapes = [groove(depth, offset) for depth, offset in random.random((CONTACTS, 2)) * 3e-6]
    points = replace(
        draws(),
        friction=random.uniform(0.05, 0.15, (CONTACTS, 81)),
        variation=random.normal(size=(CONTACTS, 81)) * 1e-4,
    )
    model, gap, found = batch(points, lambda y, k: shapes[k](y), 9e-3, 81, flexibility=flexibility)
    for k in range(0, CONTACTS, 4):
        assert_same(found.solutions[k], model.solve(gap[0, 0, k], RIG[0], points[k]))


def test_list_of_points_equals_columns():
    points = draws()
    model, gap, found = batch(points)
    listed = model.solve_batch(gap, RIG[0], list(points))
    assert np.array_equal(listed.stack("power"), found.stack("power"))
    part = model.solve_batch(gap[:, :, 10:20], RIG[0], points[10:20])
    assert np.array_equal(part.stack("dissipation"), found.stack("dissipation")[:, :, 10:20])


def test_columns_of_different_lengths_are_refused():
    with pytest.raises(ValueError, match="spin has 2 values for 60 contacts"):
        replace(draws(), spin=np.zeros(2))


def test_batch_with_bearing_torques_is_solved():
    model, gap, _, _ = contact()
    points = [
        OperatingPoint(
            300.0, SPEED, Creepage(0.0), 0.1, bearing_torque=torque,
            rolling_radius=np.full(50, 20e-3),
        )
        for torque in (0.1, 0.2)
    ]  # fmt: skip
    found = model.solve_batch(np.array([gap, gap]), RIG[0], points)
    assert -found.stack("force_x") * 20e-3 == pytest.approx([0.1, 0.2], rel=1e-9)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"normal_force": 0.0}, "contact is lost"),
        ({"normal_force": 1e5}, "extends beyond its strips"),
        ({"lateral": math.nan}, "power is not finite"),
    ],
)
def test_batch_error_names_the_failed_contact(change, match):
    points = draws()
    for name, value in change.items():
        getattr(points, name)[17] = value
    with pytest.raises(ContactError, match=f"^realisation 17: .*{match}") as caught:
        batch(points)
    assert caught.value.state["contact"] == [0, 0, 17]
    assert "gap" in caught.value.state


def test_batch_refuses_wrong_curvature_and_friction_shape():
    points = draws()
    model, gap, _ = batch(points)
    with pytest.raises(ContactError, match="curvature along rolling is -1 1/m"):
        model.solve_batch(gap, -1.0, points)
    with pytest.raises(ValueError, match=r"friction has the shape \(7, 50\)"):
        batch(replace(points, friction=np.full((CONTACTS, 7, 50), 0.1)))
    with pytest.raises(ValueError, match="60 operating points for a batch of 59 contacts"):
        model.solve_batch(gap[:, :, 1:], RIG[0], points)
    with pytest.raises(CapabilityError, match="stepper = 'stabilised'"):
        model.solve_batch(gap, RIG[0], points, np.zeros_like(gap))


def test_neglect_of_lateral_spin_slip_has_the_stated_error():
    points = draws(300)
    powers = {
        name: batch(points, None, 1.8e-3, strips, closed_form=form, mx=mx)[2].stack("power").ravel()
        for name, form, strips, mx in (
            ("reference", "never", 200, 200),
            ("strips", "always", 200, 200),
            ("quick", "always", 24, 50),
        )
    }
    reference = powers["reference"]
    error = powers["strips"] / reference - 1.0
    assert np.sqrt(np.mean(error**2)) < 2.5e-3
    assert np.abs(error).max() < 0.03
    for name, tolerance in (("strips", 2e-4), ("quick", 1e-3)):
        assert powers[name].mean() == pytest.approx(reference.mean(), rel=tolerance)
        assert powers[name].std() == pytest.approx(reference.std(), rel=tolerance)


def test_closed_form_with_spin_keeps_the_energy_balance():
    *_, point, solution = contact(creepage=(6e-4, 3e-4, 0.2), closed_form="always")
    assert solution.power == pytest.approx(balance(point, solution), rel=1e-12)


FIELD_OPTIONS = [{}, {"bound": "elliptic"}, {"dissipation": "element-sum"}]


@pytest.mark.parametrize("options", FIELD_OPTIONS)
def test_uniform_friction_field_equals_one_coefficient(options):
    options = options | {"closed_form": "never"}
    model, gap, point, expected = contact(creepage=(4e-4, 5e-4, 0.3), **options)
    for carried in (False, True):
        field = replace(point, friction=np.full((50, 50), 0.1), friction_carried=carried)
        found = model.solve(gap, RIG[0], field)
        assert found.dissipation == pytest.approx(expected.dissipation, rel=1e-13)
        assert found.adhesion_fraction == pytest.approx(expected.adhesion_fraction, rel=1e-12)
        assert found.force_y == pytest.approx(expected.force_y, rel=1e-13)


def test_carried_friction_is_the_mean_over_particles():
    model, gap, point, _ = contact(creepage=(4e-4, 5e-4, 0.0), mx=6)
    friction = np.random.default_rng(3).uniform(0.05, 0.2, (6, 50))
    found = model.solve(gap, RIG[0], replace(point, friction=friction, friction_carried=True))
    singles = [model.solve(gap, RIG[0], replace(point, friction=row)) for row in friction]
    for name in ("dissipation", "force_x", "force_y", "adhesion_fraction", "power"):
        mean = np.mean([getattr(solution, name) for solution in singles], axis=0)
        assert getattr(found, name) == pytest.approx(mean, rel=1e-13), name


def noise(points_along, strips, carried=False, contacts=12):
    """Return the mean power and its standard error with random friction at each point."""
    random = np.random.default_rng(points_along)
    same = np.ones(contacts)
    points = OperatingPoints(
        normal_force=300.0 * same,
        longitudinal=1e-3 * same,
        lateral=0.0 * same,
        spin=0.0 * same,
        friction=random.normal(0.1, 0.02, (contacts, points_along, strips)),
        rolling_speed=SPEED,
        friction_carried=carried,
    )
    options = {"mx": points_along, "kalker": "line-limit"}
    half = 0.5 * strips * contact(my=strips)[0]._grid.spacing
    power = batch(points, None, half, strips, **options)[2].stack("power").ravel()
    return power.mean(), power.std() / math.sqrt(contacts)


@pytest.mark.parametrize(
    ("cells", "expected"),
    [(25, 0.0689), (50, 0.0653), (100, 0.0614), (200, 0.0569), (400, 0.0527), (800, 0.0487)],
)
def test_white_noise_power_decreases_with_grid_refinement(cells, expected):
    mean, deviation = noise(cells, strips=50)
    assert deviation < 0.01 * expected
    assert mean == pytest.approx(expected, rel=0.02)


def test_carried_white_noise_has_a_continuum_limit():
    # the limit is the mean of the power over the distribution of the coefficient
    nodes, weights = np.polynomial.hermite_e.hermegauss(21)
    powers = [contact(mu=0.1 + 0.02 * z, kalker="line-limit")[-1].power for z in nodes]
    limit = np.dot(weights, powers) / weights.sum()
    for cells in (25, 100, 400):
        mean, deviation = noise(cells, 50, carried=True)
        assert mean == pytest.approx(limit, abs=4.0 * deviation)
    assert deviation < 1e-3 * limit


def test_friction_points_are_the_ends_of_the_steps():
    model, gap, point, solution = contact(Grid.spanning(-3e-3, 3e-3, 60), mx=10)
    x, y = model.friction_points(gap, RIG[0], point)
    assert np.array_equal(y, solution.y)
    expected = (1.0 - 0.2 * np.arange(1, 11))[:, None] * solution.half_length
    assert x == pytest.approx(expected, abs=1e-18)
    points = draws()
    model, gap, found = batch(points, mx=10)
    many, _ = model.friction_points_batch(gap, RIG[0], points)
    assert many.shape == (CONTACTS, 10, 50)
    assert np.array_equal(-many[:, -1], found.stack("half_length")[0, 0])
    listed, _ = model.friction_points_batch(gap, RIG[0], list(points))
    assert np.array_equal(listed, many)
    points.normal_force[3] = -1.0
    with pytest.raises(ContactError, match="realisation 3: the contact is lost"):
        model.friction_points_batch(gap, RIG[0], points)


def test_fields_support_friction_per_point():
    model, gap, point, _ = contact(creepage=(6e-4, 3e-4, 0.1), mx=200)
    friction = np.random.default_rng(4).uniform(0.05, 0.15, (200, 50))
    local = replace(point, friction=friction)
    solution = model.solve(gap, RIG[0], local)
    fields = model.fields(solution, gap, RIG[0], local)
    assert fields.x.shape == (201, 50)
    spacing = solution.y[1] - solution.y[0]
    force = np.trapezoid(fields.traction_x, fields.x, axis=0).sum() * spacing
    # the solution includes the corners that the trapezoidal rule omits at the edges
    assert force == pytest.approx(solution.force_x, rel=1e-4)
    bound = friction[::-1] * 4.0 / 3.0 * fields.pressure[:-1]
    assert np.all(np.hypot(fields.traction_x, fields.traction_y)[:-1] <= bound + 1e-3)
    with pytest.raises(CapabilityError, match="no stationary field inside"):
        model.fields(solution, gap, RIG[0], replace(local, friction_carried=True))
    with pytest.raises(CapabilityError, match="without a bearing torque"):
        model.solve(gap, RIG[0], replace(local, bearing_torque=0.1, rolling_radius=np.ones(50)))


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
    model = SPEC.factory(SPEC.options())
    assert isinstance(model, HertzFastsim)
    assert SPEC.name == "hertz-fastsim"
    assert not model.capabilities.wear_compliance
    assert not model.capabilities.pass_loop
