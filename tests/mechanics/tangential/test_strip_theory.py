"""Strip theory against the exact theory on Hertzian patches, and its balances."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

import wearsim
from tests.materials import STEEL
from wearsim.mechanics.hertz.elasticity import combine
from wearsim.mechanics.tangential.strip_interaction import strip_elasticity
from wearsim.mechanics.tangential.strip_theory import (
    SUMS,
    bound_steepness,
    compile_strip_contacts,
    new_tractions,
    strip_contacts,
    strips_of_contact,
)
from wearsim.scenario.examples import shipped_scenario

PAIR = combine(STEEL, STEEL)
ELASTICITY = strip_elasticity(PAIR.contact_modulus, PAIR.shear_modulus)


def ellipse(a, b, load, strips=200):
    """Return place, half-length and line load of the strips of a Hertzian patch."""
    y = (np.arange(strips) - 0.5 * (strips - 1)) * 2.0 * b / strips
    part = 1.0 - (y / b) ** 2
    line_load = part * load / (part.sum() * 2.0 * b / strips)
    return y, a * np.sqrt(part), line_load


def solve(half_length, line_load, friction, slip_x, slip_y, spin, spacing):
    out = new_tractions(len(slip_x))
    friction = np.full(len(slip_x), friction) if np.ndim(friction) == 0 else friction
    strips_of_contact(
        half_length, line_load, friction, slip_x, slip_y, spin, spacing, ELASTICITY, out
    )
    return out


def solve_row(a, b, load, friction, row):
    """Return the place of the strips and their tractions for a row of the reference."""
    y, half_length, line_load = ellipse(a, b, load)
    slip_x, spacing = row["xi"] - row["phi_per_m"] * y, y[1] - y[0]
    spin = row["phi_per_m"]
    return y, solve(half_length, line_load, friction, slip_x, row["eta"], spin, spacing)


def errors(found):
    """Return rms and worst of the relative errors of pairs (ours, exact)."""
    relative = np.array([ours / exact - 1.0 for ours, exact in found])
    return np.sqrt((relative**2).mean()), np.abs(relative).max()


creepages = st.floats(-4.0, 4.0).map(lambda x: np.sign(x) * 1e-3 * 10.0 ** (abs(x) - 3.0))
noise = st.lists(st.floats(-1.0, 1.0), min_size=40, max_size=40).map(np.array)


@given(creepages, creepages, creepages, noise, st.floats(1.0, 50.0), st.booleans())
def test_work_is_that_of_the_rigid_slip_and_not_negative(
    longitudinal, lateral, spin, uneven, width, two_patches
):
    a, friction = 1.4e-4, 0.2 + 0.15 * uneven[::-1].copy()
    y, half_length, line_load = ellipse(a, a * width, 300.0, strips=40)
    if two_patches:
        line_load[17:22] = 0.0
    spin /= a * width
    slip_x = longitudinal * (1.0 + 0.5 * uneven) - spin * y
    found = solve(half_length, line_load, friction, slip_x, lateral, spin, y[1] - y[0])
    assert (found.work >= 0.0).all()
    rigid = -(found.force_x * slip_x + found.force_y * lateral + found.moment * spin)
    assert found.work.sum() == pytest.approx(rigid.sum(), rel=1e-12, abs=1e-300)
    assert (np.hypot(found.force_x, found.force_y) <= friction * line_load * (1 + 1e-12)).all()
    assert not found.work[line_load == 0.0].any()


@given(creepages, creepages, creepages)
def test_mirrored_contact_has_mirrored_strips(longitudinal, lateral, spin):
    y, half_length, line_load = ellipse(1.4e-4, 1.5e-3, 300.0, strips=40)
    line_load, spin = line_load * (1.0 + 300.0 * y), spin / 1.5e-3
    first = solve(half_length, line_load, 0.2, longitudinal - spin * y, lateral, spin, y[1] - y[0])
    second = solve(
        half_length,
        line_load[::-1].copy(),
        0.2,
        longitudinal + spin * y,
        -lateral,
        -spin,
        y[1] - y[0],
    )
    size = np.abs(first.force_x).max() + np.abs(first.force_y).max()
    np.testing.assert_allclose(second.force_x[::-1], first.force_x, rtol=1e-9, atol=1e-9 * size)
    np.testing.assert_allclose(second.force_y[::-1], -first.force_y, rtol=1e-9, atol=1e-9 * size)
    np.testing.assert_allclose(
        second.work[::-1], first.work, rtol=1e-9, atol=1e-9 * first.work.max()
    )


@pytest.mark.parametrize("longitudinal", [1e-4, 4e-4, 8e-4, 2e-3])
def test_neglected_induced_slip_of_longitudinal_creepage_is_small(longitudinal):
    y, half_length, line_load = ellipse(1.4e-4, 1.5e-3, 300.0)
    slip_x = np.full(len(y), longitudinal)
    single, slight = (
        solve(half_length, line_load, 0.1, slip_x, lateral, 0.0, y[1] - y[0])
        for lateral in (0.0, 1e-12)
    )
    assert not single.force_y.any()
    assert slight.work.sum() == pytest.approx(single.work.sum(), rel=6e-4)
    assert np.linalg.norm(slight.work - single.work) < 2e-3 * np.linalg.norm(single.work)


def test_steepness_is_the_mean_by_load():
    half_length, line_load = np.array([7.0, 2.0, 0.5, 0.3]), np.array([0.0, 0.1, 0.3, 0.0])
    steepness = 4.0 / np.pi * np.array([0.1 / 2.0**2, 0.3 / 0.5**2])  # 2 p0/a
    expected = (0.1 * steepness[0] + 0.3 * steepness[1]) / 0.4
    assert bound_steepness(half_length, line_load) == pytest.approx(expected, rel=1e-14)
    assert bound_steepness(half_length, np.zeros(4)) == 0.0


def test_distant_patches_are_independent():
    y, half_length, line_load = ellipse(1e-4, 1e-3, 200.0, strips=50)
    gap = np.zeros(600)
    both = [np.concatenate([values, gap, values]) for values in (half_length, line_load)]
    slip_x = np.full(700, 5e-4)
    found = solve(*both, 0.2, slip_x, 4e-4, 0.0, y[1] - y[0])
    single = solve(half_length, line_load, 0.2, slip_x[:50].copy(), 4e-4, 0.0, y[1] - y[0])
    np.testing.assert_allclose(found.work[:50], single.work, rtol=2e-3)


def test_no_dissipation_without_friction_or_creepage():
    y, half_length, line_load = ellipse(1e-4, 1e-3, 200.0, strips=50)
    slip_x = np.full(50, 5e-4)
    slippery = solve(half_length, line_load, 0.0, slip_x, 1e-4, 0.3, y[1] - y[0])
    assert not np.array(slippery).any()
    slight = solve(half_length, line_load, 1e-9, slip_x, 0.0, 0.0, y[1] - y[0])
    np.testing.assert_allclose(slight.work, 1e-9 * line_load * 5e-4, rtol=1e-9)
    still = solve(half_length, line_load, 0.1, 0.0 * slip_x, 0.0, 0.0, y[1] - y[0])
    assert not still.work.any()
    np.testing.assert_array_equal(still.adhesion_length, 2.0 * half_length)


@pytest.mark.parametrize(("lateral", "spin"), [(0.0, 0.0), (3e-4, 0.5), (1e-4, 20.0)])
def test_strips_without_friction_or_load_do_not_affect_others(lateral, spin):
    y, half_length, line_load = ellipse(1e-4, 1e-3, 200.0, strips=50)
    slip_x, friction = 3e-4 - spin * y, np.full(50, 0.1)
    friction[20:30] = 0.0
    found = solve(half_length, line_load, friction, slip_x, lateral, spin, y[1] - y[0])
    assert not np.array(found)[:5, 20:30].any()
    assert np.all(found.work[:20] > 0.0)
    # values of an earlier contact in strips outside the contact are ignored
    zeros, leftover = np.zeros(3), np.full(3, 7e-5)
    wider = solve(
        np.concatenate([leftover, half_length, leftover]),
        np.concatenate([zeros, line_load, zeros]),
        np.concatenate([zeros, friction, zeros]),
        np.concatenate([leftover, slip_x, leftover]),
        lateral,
        spin,
        y[1] - y[0],
    )
    np.testing.assert_array_equal(np.array(wider)[:5, 3:-3], np.array(found)[:5])
    assert not np.array(wider)[:5, [0, 1, 2, -3, -2, -1]].any()


def test_contact_totals_are_the_sums_over_strips():
    y, half_length, line_load = ellipse(1.4e-4, 1.5e-3, 300.0, strips=60)
    spacing, speed, friction = y[1] - y[0], 2.6, np.full(60, 0.2)
    longitudinal, lateral, spin = 3e-4, 4e-4, 0.6
    variation = 7.0 - spin * y
    dissipation, sums, torque = np.empty((2, 60)), np.empty((6, 2)), np.empty(2)
    radius = 0.02 + y

    def twice(value):
        return np.array([value, value])

    strip_contacts(
        twice(line_load),
        twice(half_length),
        y,
        spacing,
        ELASTICITY,
        twice(speed),
        twice(longitudinal),
        twice(lateral),
        twice(spin),
        twice(variation),
        twice(friction),
        twice(radius),
        dissipation,
        sums,
        torque,
    )
    found = solve(half_length, line_load, friction, longitudinal - spin * y, lateral, spin, spacing)
    np.testing.assert_allclose(dissipation, twice(speed * found.work), rtol=1e-9)
    totals = dict(zip(SUMS, sums[:, 1] / spacing, strict=True))
    assert totals["force_x"] == pytest.approx(found.force_x.sum(), rel=1e-9)
    assert totals["force_y"] == pytest.approx(found.force_y.sum(), rel=1e-9)
    assert torque == pytest.approx([-spacing * (found.force_x * radius).sum()] * 2, rel=1e-9)
    moment = (found.moment - y * found.force_x).sum()
    assert totals["spin_moment"] == pytest.approx(moment, rel=1e-9)
    work = longitudinal * sums[0, 1] + lateral * sums[1, 1] + spin * sums[2, 1]
    assert sums[3, 1] == pytest.approx(-speed * work, rel=1e-11)
    peak = 2.0 * (line_load / half_length).max() / np.pi
    assert sums[4, 1] == pytest.approx(peak, rel=1e-9)
    adhering = found.adhesion_length.sum() / (2.0 * half_length.sum())
    assert sums[5, 1] == pytest.approx(adhering, rel=1e-9)


def test_call_that_compiles_strip_contacts_has_the_signature_of_the_model():
    compile_strip_contacts()
    wearsim.solve_contact(shipped_scenario("rig-450min"))
    assert len(strip_contacts.dispatcher.signatures) == 1


def test_work_of_few_strips_is_that_of_the_effective_slip():
    y, half_length, line_load = ellipse(1.4e-4, 1.5e-3, 300.0, strips=7)
    slip_x, slip_y, spin = 6e-4 - 0.4 * y, 3e-4, 0.4
    out = solve(half_length, line_load, 0.1, slip_x, slip_y, spin, y[1] - y[0])
    rigid = -(out.force_x * slip_x + out.force_y * slip_y + spin * out.moment)
    effective = rigid - out.force_x * out.induced_x - out.force_y * out.induced_y
    assert np.abs(effective - rigid).max() > 1e-3 * rigid.max()
    np.testing.assert_allclose(out.work, effective * rigid.sum() / effective.sum(), rtol=1e-12)
