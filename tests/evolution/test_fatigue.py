"""Damage by fatigue: closed forms without wear, cams station by station, and every pass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.evolution import built, stepped, worn
from wearsim.evolution.fatigue import effective_damage, fatigue_of
from wearsim.mechanics.hertz.elasticity import combine
from wearsim.mechanics.hertz.ellipse import hertz
from wearsim.plugins import Load
from wearsim.types import Material

PASSES_REF, PRESSURE_REF, EXPONENT, SLOPE = 1e6, 1e9, 8.0, 1.125
LAW = {
    "law": "pressure-life",
    "source": "a closed form",
    "reference_passes": PASSES_REF,
    "reference_pressure": "1 GPa",
    "exponent": EXPONENT,
}
UNWORN = {"wear__cylinder__k_over_h": "0 1/Pa", "contact__strips": 41, "contact__width": "4 mm"}
#: the wear of the rig in a three hundredth of the passes
QUICK = {
    "operation__duration": "1.5 min",
    "wear__cylinder__k_over_h": "3.3e-9 1/Pa",
    "contact__strips": 81,
}


def fatigue(**changes):
    return {"fatigue": {"slope": SLOPE, "cylinder": LAW, **changes}}


def pressures(problem, state):
    """Return the greatest pressure of every strip, (stations, contacts, N, strips) [Pa]."""
    load, length = (problem.values_of(state.contacts, n) for n in ("line_load", "half_length"))
    return 2.0 * load / (np.pi * np.where(length > 0.0, length, 1.0))


def life(pressure):
    return PASSES_REF * (PRESSURE_REF / pressure) ** EXPONENT


def fresh_pressure():
    """Return the greatest pressure of the rig's contact by Hertz [Pa]."""
    steel = Material(200e9, 0.3)
    modulus = combine(steel, steel).contact_modulus
    return hertz(0.5 / 25e-3 + 0.5 / 20e-3, 0.5 / 0.5, 300.0, modulus).peak_pressure


def damage_of(problem, state):
    return float(effective_damage(problem, state.damage[0])[0])


@pytest.fixture(scope="module")
def unworn():
    return worn(**UNWORN, **fatigue())


def test_life_without_wear_is_the_closed_form():
    problem, state = worn(**UNWORN, **fatigue(), contact__model="hertz")
    # a strip has its mean line load
    greatest = pressures(problem, state).max()
    assert greatest == pytest.approx(fresh_pressure(), rel=1e-3)
    found = state.passes[0] / damage_of(problem, state)
    assert found == pytest.approx(life(greatest), rel=1e-10)


class TwoLevels(Load):
    """Load of 200 N in the first part of a test, and of 400 N after it."""

    low, high, until = 200.0, 400.0, 1000.0

    def force(self, time):
        return np.where(np.asarray(time) < self.until, self.low, self.high)

    def first(self, start, stop):
        return min(max((self.until - start) / (stop - start), 0.0), 1.0)

    def mean(self, start, stop):
        part = self.first(start, stop)
        return part * self.low + (1.0 - part) * self.high

    def deviation(self, start, stop):
        part = self.first(start, stop)
        return (part * (1.0 - part)) ** 0.5 * (self.high - self.low)

    def extremes(self, start, stop):
        part = self.first(start, stop)
        return (self.low if part > 0.0 else self.high), (self.high if part < 1.0 else self.low)


@pytest.mark.parametrize("share", [0.5, 0.1, 0.93])
def test_two_loads_add_up_by_their_shares(share):
    problem, stepper, passes = built(**UNWORN, **fatigue())
    load = TwoLevels()
    load.until = share * float(problem.time(np.array([passes]))[0])
    end, _ = stepped(replace(problem, loads=(load,)), stepper, passes)
    lives = []
    for level in ("200 N", "400 N"):
        one, state = worn(**UNWORN, **fatigue(), load__normal_force=level)
        lives.append(float(state.passes[0]) / damage_of(one, state))
    expected = 1.0 / (share / lives[0] + (1.0 - share) / lives[1])
    # line loads converge to 1e-8, and a life goes with a high power of the pressure
    assert passes / damage_of(problem, end) == pytest.approx(expected, rel=1e-7)


def test_weakest_link_of_twice_the_area_has_a_shorter_life(unworn):
    areas = []
    for area in ("50 mm^2", "25 mm^2"):
        one = fatigue(scatter="weakest-link", reference_area=area)
        problem, state = worn(**UNWORN, **one)
        areas.append(damage_of(problem, state))
    assert areas[1] / areas[0] == pytest.approx(2.0 ** (1.0 / SLOPE), rel=1e-12)
    # the sum over the strips of the cylinder
    problem, state = worn(**UNWORN, **fatigue(scatter="weakest-link", reference_area="50 mm^2"))
    part = 2.0 * np.pi * 25e-3 * problem.grid.spacing / 50e-6
    pressure = pressures(problem, state)[0, 0, 0]
    damage = state.passes[0] / life(pressure[pressure > 0.0])
    expected = (part * (damage**SLOPE).sum()) ** (1.0 / SLOPE)
    assert damage_of(problem, state) == pytest.approx(expected, rel=1e-8)
    assert damage_of(*unworn) < damage_of(problem, state)


def test_bodies_multiply_their_chances_of_survival():
    both = fatigue(roller=LAW)
    problem, state = worn(**UNWORN, **both)
    stations = problem.shape[0]
    cylinder, roller = state.damage[0, :stations].max(), state.damage[0, stations:].max()
    # a point of a roller is passed once in R_cylinder/R_roller turns of 3 passes
    assert roller / cylinder == pytest.approx(25.0 / 20.0 / 3.0, rel=1e-12)
    one = fatigue_of(problem)
    survival = (1.0 - one.pitting(cylinder)) * (1.0 - one.pitting(roller)) ** 3
    assert 1.0 - one.pitting(damage_of(problem, state)) == pytest.approx(survival, rel=1e-12)
    assert one.pitting(np.array([1.0]))[0] == pytest.approx(0.1, rel=1e-15)


def test_cam_without_wear_has_the_damage_of_each_station():
    changes = {"wear__cylinder__k_over_h": "0 1/Pa", "wear__roller__k_over_h": "0 1/Pa"}
    problem, state = worn("cam-cycloidal", operation__turns=1000, **changes, **fatigue())
    stations = problem.shape[0]
    assert stations > 5
    greatest = pressures(problem, state).max(axis=(1, 2, 3))
    assert np.ptp(greatest) > 0.03 * greatest.max()
    found = state.damage[0, :stations, 0].max(axis=-1)
    assert found == pytest.approx(state.passes[0] / life(greatest), rel=1e-7)


@pytest.fixture(scope="module")
def every_pass():
    return worn(**QUICK, **fatigue(), evolution__stepper="per-pass")


def test_damage_on_a_worn_profile_agrees_with_every_pass(every_pass):
    problem, state = worn(**QUICK, **fatigue())
    found, true = damage_of(problem, state), damage_of(*every_pass)
    assert found == pytest.approx(true, rel=2e-3)
    without_wear = state.passes[0] / life(680.2e6)
    assert found < 0.03 * without_wear


def test_stated_error_of_the_integral_covers_fine_steps():
    problem, state = worn(**QUICK, **fatigue(), evolution__tolerance=3e-2)
    fine = damage_of(*worn(**QUICK, **fatigue(), evolution__tolerance=1e-4))
    stated = effective_damage(problem, state.damage[0] + state.damage[1])[0]
    found = damage_of(problem, state)
    assert abs(found - fine) < 5.0 * (stated - found) + 0.02 * fine


def test_worn_off_material_takes_its_damage_with_it(every_pass):
    kept = damage_of(*every_pass)
    removed = damage_of(*worn(**QUICK, **fatigue(remove=True)))
    single = damage_of(*worn(**QUICK, **fatigue(remove=True), evolution__stepper="per-pass"))
    assert removed < 0.8 * kept
    assert removed == pytest.approx(single, rel=5e-3)


def test_test_without_fatigue_has_no_damage_and_the_same_wear():
    plain = worn(**QUICK, evolution__step=200)[1]
    damaged = worn(**QUICK, **fatigue(), evolution__step=200)[1]
    assert plain.damage is None
    assert np.array_equal(plain.cylinder_depth, damaged.cylinder_depth)


def test_damage_does_not_depend_on_the_batch(every_pass):
    problem, stepper, stop = built(**QUICK, **fatigue())
    three = problem.at(np.zeros(3, dtype=np.int64))
    inputs = three.inputs.with_values({"friction": np.array([[0.1, 0.07, 0.13]])})
    single, _ = stepped(problem, stepper, stop)
    _, advances = stepped(replace(three, inputs=inputs), stepper, stop)
    last = [advance.end for advance in advances if 0 in advance.numbers][-1]
    assert np.array_equal(last.damage[:, :, 0], single.damage[:, :, 0])
