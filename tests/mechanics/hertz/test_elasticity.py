"""Elastic constants of a pair of bodies."""

import pytest
from hypothesis import given, settings, strategies as st

from wearsim.mechanics.hertz.elasticity import combine
from wearsim.types import Material

materials = st.builds(
    Material, st.floats(1e6, 1e12), st.floats(0.0, 0.5, exclude_max=True), st.none()
)


def test_two_steels_have_the_constants_of_steel():
    pair = combine(Material(200e9, 0.3), Material(200e9, 0.3))
    assert pair.shear_modulus == pytest.approx(200e9 / 2.6, rel=1e-14)
    assert pair.poisson_ratio == pytest.approx(0.3, rel=1e-14)
    assert pair.contact_modulus == pytest.approx(200e9 / (2 * (1 - 0.09)), rel=1e-14)
    assert pair.dundurs == 0.0


@settings(deadline=None)
@given(materials, materials)
def test_contact_modulus_is_that_of_both_bodies_in_series(first, second):
    series = sum((1.0 - m.poisson_ratio**2) / m.youngs_modulus for m in (first, second))
    pair = combine(first, second)
    assert pair.contact_modulus == pytest.approx(1.0 / series, rel=1e-12)
    assert 0.0 <= pair.poisson_ratio <= 0.5


@settings(deadline=None)
@given(materials, materials)
def test_swapped_bodies_change_only_the_sign_of_the_coupling(first, second):
    one, other = combine(first, second), combine(second, first)
    assert one.shear_modulus == pytest.approx(other.shear_modulus, rel=1e-14)
    assert one.dundurs == pytest.approx(-other.dundurs, rel=1e-9, abs=1e-15)
    assert abs(one.dundurs) <= 0.5


def test_soft_body_on_a_rigid_one_has_dundurs_constant():
    # beta = (1 - 2 nu)/(2 (1 - nu)) against a rigid body, in size
    pair = combine(Material(1e6, 0.3), Material(1e15, 0.3))
    assert abs(pair.dundurs) == pytest.approx(0.4 / 1.4, rel=1e-6)


def test_steel_and_aluminium_have_the_sums_of_their_compliances():
    pair = combine(Material(200e9, 0.3), Material(70e9, 0.35))
    first, second = 2.6 / 200e9, 2.7 / 70e9  # 1/G
    assert pair.shear_modulus == pytest.approx(2.0 / (first + second), rel=1e-14)
    poisson = (0.3 * first + 0.35 * second) / (first + second)
    assert pair.poisson_ratio == pytest.approx(poisson, rel=1e-14)
    # Johnson, Contact Mechanics, eq. 5.3, where the bodies have the other order
    coupling = 0.5 * (0.4 * first - 0.3 * second) / (0.7 * first + 0.65 * second)
    assert pair.dundurs == pytest.approx(-coupling, rel=1e-12)
    soft = pair.reduced(0.5).reduced(0.8)
    assert soft.creep_factor == pytest.approx(0.4)
    assert soft.shear_modulus == pytest.approx(0.4 * pair.shear_modulus)
    assert soft.contact_modulus == pytest.approx(0.4 * pair.contact_modulus)
    assert (soft.poisson_ratio, soft.dundurs) == (pair.poisson_ratio, pair.dundurs)
