"""Single steps of each stepper against plain loops over the strips of an elastic foundation.

A pass under the line load q wears the depth (K/H) mu s q off the cylinder, at a slip s, and R/r
times as much off a roller of radius r. With a friction that rises with the line load, mu is
multiplied by 1 + q/Q, so that the power and the worn volume change with the profile too.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.evolution import built, stepped
from tests.evolution.black_box import BlackBox, boxed
from wearsim.errors import ContactError, StepError
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.error_estimates import (
    COVER,
    DEPTH_EXPONENT,
    SHARE,
    UNCERTAIN,
    VARYING_COVER,
)
from wearsim.evolution.quantities import Varying
from wearsim.evolution.steppers.base import GROW, SAFETY
from wearsim.evolution.steppers.forward_euler import ExplicitStepper, decay_rates, stability_limit
from wearsim.evolution.steppers.implicit import ImplicitStepper
from wearsim.evolution.steppers.single_step import explicit_step
from wearsim.evolution.steppers.stabilised import (
    StabilisedStepper,
    _never_negative,
    stabilised_step,
)
from wearsim.evolution.steppers.step_doubling import LEAST
from wearsim.mechanics.numerics.piecewise_linear import Paths

LOAD, FRICTION, SLIP, FACTOR, MODULUS = 300.0, 0.1, 1e-3, 1.1e-11, 2e13  # K/H [1/Pa], [Pa/m]
RADII = 0.025, 0.02
RISE = 2e5  # line load Q at which the friction has doubled [N/m]
PER_LOAD = FACTOR * FRICTION * SLIP  # depth per pass and line load [m/(N/m)]


def line_loads(gap, approach, curvature=90.0):
    """Return the line load of every strip [N/m]."""
    depth = np.maximum(approach - gap, 0.0)
    return 4.0 / 3.0 * MODULUS * depth * np.sqrt(2.0 * depth / curvature)


def solved(gap, load, spacing, curvature=90.0):
    """Return line loads and approach under a load."""

    def excess(approach):
        return line_loads(gap, approach, curvature).sum() * spacing - load

    approach = brentq(excess, gap.min(), gap.min() + 1e-3, xtol=1e-20)
    return line_loads(gap, approach, curvature), approach


class Rising(BlackBox):
    """Contact model with a friction that rises with the line load."""

    def solve_contact(self, *arguments):
        found = super().solve_contact(*arguments)
        dissipation = found.dissipation * (1.0 + found.line_load / RISE)
        power = dissipation.sum() * (found.y[1] - found.y[0])
        return replace(found, dissipation=dissipation, power=power)


class Rig:
    """One roller on a cylinder that wears: problem, start, gap of unworn bodies and wear rates."""

    def __init__(self, **changes):
        self.problem, _, _ = boxed(foundation=True, box=Rising, contact__strips=41, **changes)
        self.state = fresh_state(self.problem)
        self.gap, self.spacing = self.problem.nominal_gap[0, 0, 0], self.problem.grid.spacing

    def rate(self, depth, load=LOAD):
        """Return the wear of a pass on a profile [m]."""
        q = solved(self.gap + depth, load, self.spacing)[0]
        return PER_LOAD * q * (1.0 + q / RISE)

    def sizes(self, depth, difference):
        """Return greatest difference where it is deep [m], volume [m^3] and part of the profile."""
        deep = depth >= 0.5 * depth.max()
        volume = 2.0 * math.pi * RADII[0] * self.spacing * difference.sum()
        part = np.linalg.norm(difference) / np.linalg.norm(depth)
        return np.array([np.abs(difference[deep]).max(), abs(volume), part])


@pytest.fixture(scope="module")
def rig():
    return Rig()


def errors_of(state):
    """Return the errors of depth, volume and profile of the only test."""
    return np.array([state.depth_error[0], state.volume_error[0], state.profile_error[0]])


def test_explicit_step_is_the_wear_at_its_start(rig):
    count, stepper = 4000.0, ExplicitStepper(1e-3)
    tried = stepper.attempt(rig.problem, rig.state, np.array([count]), count, explicit_step)
    (end,) = tried.path
    depth = count * rig.rate(0.0)
    np.testing.assert_allclose(end.cylinder_depth[0, 0, 0], depth, rtol=1e-9, atol=1e-18)
    volume = rig.sizes(depth, depth)[1]
    assert end.energy[0] == pytest.approx(volume / FACTOR, rel=1e-9, abs=0.0)
    errors = COVER * rig.sizes(depth, 0.5 * (depth - count * rig.rate(depth)))
    np.testing.assert_allclose(errors_of(end), errors, rtol=1e-6)
    assert (end.passes[0], end.steps, tried.warning) == (count, 1, None)
    allowed = SHARE * 1e-3 * depth.max()
    by_volume = errors[1] / (SHARE * 1e-3 * volume)
    assert tried.excess[0] == pytest.approx(max(errors[0] / allowed, by_volume), rel=1e-6, abs=0.0)
    assert tried.ratio[0] == pytest.approx(SAFETY * tried.excess[0] ** -0.5, rel=1e-12, abs=0.0)
    half = stepper.attempt(rig.problem, rig.state, np.array([count]), 4.0 * count, explicit_step)
    longer = errors[0] / (allowed / 0.25**DEPTH_EXPONENT)
    assert half.excess[0] == pytest.approx(max(longer, by_volume * 0.25**0.75), rel=1e-6, abs=0.0)
    again = stepper.attempt(rig.problem, end, np.array([count]), 2.0 * count, explicit_step)
    after = depth + count * rig.rate(depth)
    more = 0.5 * (after - depth - count * rig.rate(after))
    np.testing.assert_allclose(
        errors_of(again.path[0]), errors + COVER * rig.sizes(after, more), rtol=1e-5
    )


def test_steps_take_the_mean_of_a_varying_friction(rig):
    path = Paths.through(np.array([0.0, 200.0]), np.array([FRICTION, 3.0 * FRICTION]))
    problem = replace(rig.problem, varying=(Varying("friction", (0,), path),))
    passes, state = np.array([2000.0]), fresh_state(problem)
    part = 1.0 + 0.5 * float(problem.time(passes)[0]) / 100.0
    depth = 2000.0 * part * rig.rate(0.0)
    end = explicit_step(problem, state, passes)
    np.testing.assert_allclose(end.cylinder_depth[0, 0, 0], depth, rtol=1e-9, atol=1e-18)
    assert end.contacts.power[0] == pytest.approx(
        (2.0 * part - 1.0) * explicit_step(rig.problem, state, part * passes).contacts.power[0]
    )
    (tried,) = ExplicitStepper(1e-3).attempt(problem, state, passes, 1e6, explicit_step).path
    errors = rig.sizes(depth, 0.5 * (depth - 2000.0 * part * rig.rate(depth)))
    assert errors_of(tried)[0] > 0.9 * COVER * errors[0]
    steady = rig.problem.with_inputs(
        rig.problem.inputs.with_values({"friction": np.full((1, 1), part * FRICTION)})
    )
    stages = [
        stabilised_step(one, fresh_state(one), passes, np.zeros(1)) for one in (problem, steady)
    ]
    np.testing.assert_allclose(stages[0].stacked, stages[1].stacked, rtol=1e-9, atol=1e-18)


def test_decay_rate_follows_from_the_stiffness_of_the_strips(rig):
    q, approach = solved(rig.gap, LOAD, rig.spacing)
    stiffness = 2.0 * MODULUS * np.sqrt(2.0 / 90.0 * np.maximum(approach - rig.gap, 0.0))
    # with the load constant, the approach follows the mean of a change of the gap
    change = np.diag(stiffness) - np.outer(stiffness, stiffness) / stiffness.sum()
    decrease = PER_LOAD * (1.0 + 2.0 * q / RISE)[:, None] * change
    first = decrease @ (-1.0) ** np.arange(41)
    exact = np.abs(decrease @ first).max() / np.abs(first).max()
    assert decay_rates(rig.problem, rig.state)[0] == pytest.approx(exact, rel=1e-3, abs=0.0)
    assert exact == pytest.approx(np.abs(np.linalg.eigvals(decrease)).max(), rel=0.1, abs=0.0)
    assert stability_limit(rig.problem, rig.state)[0] == pytest.approx(
        2.0 / exact, rel=1e-3, abs=0.0
    )
    proposed = ExplicitStepper(1e-3).proposed(rig.problem, rig.state)
    assert proposed[0] == pytest.approx(1.0 / exact, rel=1e-3, abs=0.0)


def test_doubled_step_has_the_error_of_its_whole_step(rig):
    count, stepper = 4000.0, StabilisedStepper(1e-3)
    worn, coarse, state, volume = np.zeros(41), np.zeros(41), rig.state, 0.0
    for number in (1, 2):
        tried = stepper.attempt(rig.problem, state, np.array([count]), 2.0 * count, explicit_step)
        middle, end = tried.path
        before = worn - coarse
        half = worn + 0.5 * count * rig.rate(worn)
        worn, coarse = half + 0.5 * count * rig.rate(half), coarse + count * rig.rate(coarse)
        np.testing.assert_allclose(middle.cylinder_depth[0, 0, 0], half, rtol=1e-8, atol=1e-16)
        np.testing.assert_allclose(end.cylinder_depth[0, 0, 0], worn, rtol=1e-8, atol=1e-16)
        reached = COVER * rig.sizes(worn, worn - coarse)
        added = COVER * rig.sizes(worn, worn - coarse - before)
        volume += added[1]
        depth = max(reached[0], LEAST * reached[2] * worn.max())
        np.testing.assert_allclose(errors_of(end), [depth, volume, reached[2]], rtol=1e-4)
        assert (middle.passes[0], end.passes[0]) == ((number - 0.5) * count, number * count)
        assert end.steps == number
        ratio = min(GROW, SAFETY * tried.excess[0] ** (-1.0 / 3.0))
        assert tried.ratio[0] == pytest.approx(ratio, rel=1e-12, abs=0.0)
        if number == 1:  # half of the test
            allowed = SHARE * 1e-3 * rig.sizes(worn, worn) / 0.5 ** np.array([0.5, 0.75, 0.0])
            worst = (added / allowed)[:2].max()
            assert tried.excess[0] == pytest.approx(worst, rel=1e-4, abs=0.0)
        state = end
    assert state.coarse_step_solution.passes[0] == 2.0 * count
    assert state.coarse_step_solution.coarse_step_solution is None


def test_doubled_step_contains_the_variation_of_the_load(tmp_path):
    count, times, loads = 500, [0.0, 4.0, 6.0, 11.0, 30.0], [280.0, 380.0, 250.0, 330.0, 330.0]
    log = tmp_path / "log.csv"
    lines = ["time [s], load [N]", *(f"{t}, {load}" for t, load in zip(times, loads, strict=True))]
    log.write_text("\n".join(lines))
    load = {"kind": "recorded", "file": str(log)}
    rig = Rig(load=load, operation__passes=count)

    def over(first, last):
        passes = (np.arange(100_000.0) + 0.5) / 100_000.0 * (last - first) + first
        values = np.interp(passes * 0.02, times, loads)
        return values.mean(), values.std()

    last, (mean, deviation) = np.interp(count * 0.02, times, loads), over(0, count)

    def bias_on(worn):
        lower, middle, upper = (rig.rate(worn, last + k * deviation) for k in (-1.0, 0.0, 1.0))
        return 0.5 * count * (lower - 2.0 * middle + upper)

    step, whole = np.array([float(count)]), count * rig.rate(0.0, mean)
    (end,) = ExplicitStepper(1e-3).attempt(rig.problem, rig.state, step, 1e6, explicit_step).path
    np.testing.assert_allclose(end.cylinder_depth[0, 0, 0], whole, rtol=1e-6, atol=1e-14)
    errors = rig.sizes(whole, 0.5 * (whole - count * rig.rate(whole, mean)))
    errors = COVER * (errors + rig.sizes(whole, bias_on(whole)))
    np.testing.assert_allclose(errors_of(end), errors, rtol=1e-4)
    half = 0.5 * count * rig.rate(0.0, over(0, count / 2)[0])
    worn = half + 0.5 * count * rig.rate(half, over(count / 2, count)[0])
    coarse, bias = whole, bias_on(worn)
    # a part of the bias increases the difference of the two solutions
    side = 1.0 if ((coarse - worn) * bias).sum() >= 0.0 else -1.0
    worn, coarse = worn + bias, coarse + bias + UNCERTAIN * side * bias
    end = StabilisedStepper(1e-3).attempt(rig.problem, rig.state, step, 1e6, explicit_step).path[1]
    np.testing.assert_allclose(end.cylinder_depth[0, 0, 0], worn, rtol=1e-6, atol=1e-14)
    errors = COVER * VARYING_COVER * rig.sizes(worn, worn - coarse)
    errors[0] = max(errors[0], LEAST * errors[2] * worn.max())
    np.testing.assert_allclose(errors_of(end), errors, rtol=1e-4)
    assert end.energy[0] == pytest.approx(rig.sizes(worn, worn)[1] / FACTOR, rel=1e-9, abs=0.0)


def test_first_step_wears_a_tenth_of_the_elastic_approach(rig):
    _, approach = solved(rig.gap, LOAD, rig.spacing)
    passes = 0.1 * (approach - rig.gap.min()) / rig.rate(0.0).max()
    stepper = StabilisedStepper(1e-3)
    assert stepper.proposed(rig.problem, rig.state)[0] == pytest.approx(passes, rel=1e-6, abs=0.0)
    later = rig.state.replaced(step=np.array([17.0]))
    assert stepper.proposed(rig.problem, later)[0] == 17.0


@pytest.mark.parametrize("count", [3, 6])
def test_stabilised_step_equals_the_recursion_of_its_source(rig, count):
    """C.D. Meyer et al., J. Comput. Phys. 257 (2014) 594, equations 14 to 17."""
    passes, decay = 5000.0, (count * count + count - 3.0) / 2.0 / 1.2 / 5000.0
    weight = 4.0 / (count * count + count - 2.0)
    b = [1 / 3, 1 / 3, *((j * j + j - 2) / (2 * j * (j + 1)) for j in range(2, count + 1))]
    start = passes * rig.rate(0.0)
    stages = [np.zeros(41), b[1] * weight * start]
    for j in range(2, count + 1):
        mu, nu = (2 * j - 1) / j * b[j] / b[j - 1], -(j - 1) / j * b[j] / b[j - 2]
        rate = passes * rig.rate(stages[-1])
        stage = mu * stages[-1] + nu * stages[-2]
        stage += mu * weight * (rate - (1.0 - b[j - 1]) * start)
        stages.append(stage)
    end = stabilised_step(rig.problem, rig.state, np.array([passes]), np.array([decay]))
    np.testing.assert_allclose(end.cylinder_depth[0, 0, 0], stages[-1], rtol=1e-6, atol=1e-14)
    assert end.solves - rig.state.solves == count
    volume = 2.0 * math.pi * RADII[0] * rig.spacing * end.cylinder_depth.sum()
    assert end.energy[0] == pytest.approx(volume / FACTOR, rel=1e-12, abs=0.0)


def test_solves_count_the_contacts_of_all_rollers():
    problem, _, _ = boxed(
        foundation=True, contact__strips=41, roller__offset=["0 mm", "1 mm", "2 mm"]
    )
    state = fresh_state(problem)
    end = stabilised_step(problem, state, np.array([1000.0]), np.zeros(1))
    assert end.solves - state.solves == 9
    tried = StabilisedStepper(1e-3).attempt(problem, state, np.array([10.0]), 1e6, explicit_step)
    assert tried.path[-1].solves - state.solves == 9
    # under another load than that of the contacts at the start, they are solved twice
    offset = problem.inputs.with_values({"normal_force_offset": np.array([[1.0], [0.0], [0.0]])})
    end = explicit_step(replace(problem, inputs=offset), state, np.array([10.0]))
    assert end.solves - state.solves == 6


def test_depths_are_not_negative_and_keep_their_sum():
    depths = 1e-9 * np.array([[3.0, -1.0, 2.0], [0.0, 0.0, 0.0], [1.0, 0.0, 1.0]])
    exact = 1e-9 * np.array([[2.4, 0.0, 1.6], [0.0, 0.0, 0.0], [1.0, 0.0, 1.0]])
    np.testing.assert_allclose(_never_negative(depths), exact, rtol=1e-15)


@pytest.mark.parametrize("strips", [21, 201])
def test_steps_in_a_groove_are_limited_by_strips_and_elastic_approach(strips):
    problem, _, _ = built(contact__strips=strips)
    state, _ = stepped(problem, ImplicitStepper(1e-3, forced_step=30_000.0), 300_000.0)
    state, stepper = state.replaced(step=np.array([1e9])), StabilisedStepper(1e-3)
    to_edge = np.count_nonzero(state.contacts[0].line_load) // 2
    worn = state.cylinder_depth.max()
    elastic = state.contacts.approach[0] - worn
    # the distance to an edge grows as the cubic root of the passes, the depth as its square
    by_strips = 3.0 * 300_000.0 / to_edge * 0.5
    by_approach = 1.5 * 300_000.0 / worn * 0.7 * elastic
    longest = min(by_strips, by_approach)
    assert longest == (by_approach if strips == 21 else by_strips)
    assert stepper.proposed(problem, state)[0] == pytest.approx(longest, rel=1e-12, abs=0.0)
    short = state.replaced(step=np.array([100.0]))
    assert stepper.proposed(problem, short)[0] == 100.0
    assert StabilisedStepper(1e-3, forced_step=1e9).proposed(problem, state)[0] == 1e9


def test_forced_explicit_steps_stop_at_the_limit_unless_allowed(rig):
    limit = stability_limit(rig.problem, rig.state)[0]
    for factor, allowed in ((0.9, False), (1.1, True), (0.9, True)):
        stepper = ExplicitStepper(1e-3, factor * limit, allow_unstable=allowed)
        assert stepper.proposed(rig.problem, rig.state)[0] == factor * limit
    with pytest.raises(StepError, match="exceeds the stability limit"):
        ExplicitStepper(1e-3, 1.1 * limit).proposed(rig.problem, rig.state)


class Failing(BlackBox):
    """Contact model that solves no contact."""

    def solve_contact(self, *_):
        raise ContactError("no contact")


def test_decay_rate_without_a_solution_is_that_of_the_state(rig):
    failing = replace(rig.problem, model=Failing(rig.problem.model.inner))
    with pytest.raises(ContactError):
        decay_rates(failing, rig.state)
    assert decay_rates(failing, rig.state.replaced(decay=np.array([0.25])))[0] == 0.25
    unworn, _, _ = boxed(foundation=True, contact__strips=41, wear__cylinder__k_over_h="0 1/Pa")
    assert decay_rates(unworn, fresh_state(unworn))[0] == 0.0
    assert stability_limit(unworn, fresh_state(unworn))[0] == np.inf
