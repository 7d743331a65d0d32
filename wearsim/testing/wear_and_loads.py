"""Conformance tests of wear laws, loads and load terms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from wearsim.plugins import BODIES, Body, Load, LoadSpec, LoadTerm, WearLaw, WearLawSpec
from wearsim.testing.checks import (
    Checks,
    Fixture,
    agree,
    require,
    require_instance,
    require_repeatable,
    require_values,
    spec_checks,
)
from wearsim.types import ContactSolution, FloatArray, Grid

_SPEED = 2.618
_LOAD, _CREEPAGE, _FRICTION = 300.0, 1e-3, 0.1
_HALF_WIDTH, _HALF_LENGTH = 1.5e-3, 1.3e-4
WEAR_LAW: Checks[WearLawFixture] = spec_checks()
_DEPTH = "wearsim.plugins.WearLaw.depth_per_pass"
_SAMPLES = 200_000
_PARTS = ((0.0, 1.0), (0.1, 0.35), (0.5, 0.5001), (0.999, 1.0))
_STEPS = 1000
ANY: Checks[LoadFixture] = spec_checks()
BASE: Checks[LoadFixture] = Checks()
TERM: Checks[LoadFixture] = Checks()


def sliding_contact(strips: int, speed: float = _SPEED, slides: float = 1.0) -> ContactSolution:
    """Return a sliding Hertzian ellipse, divided into strips.

    Parameters
    ----------
    strips : int
        Number of strips over twice the patch's width; half of them are outside the patch.
    speed : float
        Rolling speed [m/s].
    slides : float
        Slip as a fraction of the creepage; 0 is a loaded contact without slip.
    """
    grid = Grid.spanning(-2.0 * _HALF_WIDTH, 2.0 * _HALF_WIDTH, strips)
    inside = np.maximum(1.0 - (grid.y / _HALF_WIDTH) ** 2, 0.0)
    load = 0.75 * _LOAD / _HALF_WIDTH * inside
    dissipation = _FRICTION * load * slides * _CREEPAGE * speed
    return ContactSolution(
        y=grid.y,
        half_length=_HALF_LENGTH * np.sqrt(inside),
        line_load=load,
        dissipation=dissipation,
        force_x=-_FRICTION * _LOAD,
        force_y=0.0,
        spin_moment=0.0,
        approach=3e-6,
        peak_pressure=1.5 * _LOAD / (np.pi * _HALF_LENGTH * _HALF_WIDTH),
        adhesion_fraction=0.0,
        power=float(dissipation.sum()) * grid.spacing,
        longitudinal_creepage=slides * _CREEPAGE,
        iterations=1,
    )


class WearLawFixture(Fixture[WearLawSpec]):
    """A wear law under test."""

    def depth(self, body: Body, contact: ContactSolution, speed: float = _SPEED) -> FloatArray:
        """Return the depth of one pass [m]."""
        return np.asarray(self.instance.depth_per_pass(body, contact, speed))


@WEAR_LAW.specified_in("wearsim.plugins.WearLawSpec")
def factory_builds_a_wear_law(fixture: WearLawFixture) -> None:
    """The factory builds a WearLaw."""
    require_instance(fixture, WearLaw)


@WEAR_LAW.specified_in(_DEPTH)
def depth_is_never_negative(fixture: WearLawFixture) -> None:
    """The depth has the shape of the strips, is finite and never negative."""
    contact = sliding_contact(200)
    for body in BODIES:
        depth = fixture.depth(body, contact)
        require_values(f"{body}: the depth", depth, contact.y.shape)
        require(float(depth.min()) >= 0.0, f"{body}: the depth falls to {depth.min():.3g} m")


@WEAR_LAW.specified_in(_DEPTH)
def no_wear_outside_contact(fixture: WearLawFixture) -> None:
    """The depth is zero where the line load is zero."""
    contact = sliding_contact(200)
    for body in BODIES:
        largest = float(fixture.depth(body, contact)[contact.line_load == 0.0].max())
        require(largest == 0.0, f"{body}: the depth outside the contact is up to {largest:.3g} m")


@WEAR_LAW.specified_in("wearsim.plugins.WearLaw")
def no_wear_without_dissipation(fixture: WearLawFixture) -> None:
    """The depth is zero where the dissipation is zero."""
    contact = sliding_contact(200, slides=0.0)
    for body in BODIES:
        largest = float(fixture.depth(body, contact).max())
        require(largest == 0.0, f"{body}: the depth without dissipation is up to {largest:.3g} m")


@WEAR_LAW.specified_in("wearsim.plugins.WearLaw.depth_per_dissipation")
def linear_factor_matches_depth(fixture: WearLawFixture) -> None:
    """The depth per dissipation, if given, is the depth over the dissipation of any contact."""
    for body in BODIES:
        for speed in (_SPEED, 3.0 * _SPEED):
            factor = fixture.instance.depth_per_dissipation(body, speed)
            if factor is None:
                continue
            require(np.isfinite(factor) and factor >= 0.0, f"{body}: the factor is {factor}")
            for slides in (1.0, 0.3):
                contact = sliding_contact(200, speed, slides)
                agree(
                    f"{body}, V = {speed:g} m/s: the depth, compared with depth_per_dissipation,",
                    fixture.depth(body, contact, speed),
                    factor * contact.dissipation,
                    1e-12,
                )


@WEAR_LAW.specified_in(_DEPTH)
def depth_independent_of_strips(fixture: WearLawFixture) -> None:
    """The depth at a position does not depend on the width of the strips."""
    coarse, fine = sliding_contact(400), sliding_contact(1600)
    for body in BODIES:
        depth = fixture.depth(body, coarse)
        refined = np.interp(coarse.y, fine.y, fixture.depth(body, fine))
        # a law can have a threshold, next to which one strip differs
        difference = float(np.abs(depth - refined).sum())
        require(
            difference <= 0.02 * float(depth.sum()),
            f"{body}: the depths of 400 and 1600 strips differ by {difference:.3g} m in total",
        )


@WEAR_LAW.specified_in(_DEPTH)
def depth_is_reproducible(fixture: WearLawFixture) -> None:
    """The same contact has the same depth bit for bit, and is not changed."""
    contact, original = sliding_contact(200), sliding_contact(200)
    for body in BODIES:
        first = fixture.depth(body, contact).copy()
        fixture.depth(body, sliding_contact(200, slides=0.5))
        for what, law in (("a second call", fixture.instance), ("a new law", fixture.fresh())):
            repeated = law.depth_per_pass(body, contact, _SPEED)
            require(np.array_equal(first, repeated), f"{body}: {what} differs")
    for name in ("half_length", "line_load", "dissipation"):
        unchanged = np.array_equal(getattr(contact, name), getattr(original, name))
        require(unchanged, f"depth_per_pass changes the {name} of its input")


@dataclass(frozen=True)
class LoadFixture(Fixture[LoadSpec]):
    """A load or a load term under test.

    Parameters
    ----------
    configured : ConfiguredSpec
        Its spec and options.
    duration : float
        Time interval for a load without a span and for a load term [s].
    """

    duration: float = 3600.0

    @cached_property
    def intervals(self) -> list[tuple[float, float]]:
        """Time intervals at which the load is known [s]."""
        first, last = self.instance.span or (0.0, self.duration)
        return [(first + a * (last - first), first + b * (last - first)) for a, b in _PARTS]

    def forces(self, start: float, stop: float) -> FloatArray:
        """Return the load at the midpoints of equal parts of an interval [N]."""
        midpoints = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
        return np.asarray(self.instance.force(start + (stop - start) * midpoints))

    @cached_property
    def term_state(self) -> tuple[FloatArray, FloatArray, float]:
        """States of a term for three rollers, their powers [W], and the largest state."""
        power = np.array([0.0, 0.05, 0.2])
        start = self.instance.advance(np.zeros(3), power[::-1].copy(), 0.2 * self.duration)
        return np.asarray(start), power, float(np.abs(start).max())


@ANY.specified_in("wearsim.plugins.LoadSpec")
def factory_matches_role(fixture: LoadFixture) -> None:
    """The factory of a base builds a Load, the factory of a term a LoadTerm."""
    role = fixture.configured.spec.role
    required = Load if role == "base" else LoadTerm
    require(
        isinstance(fixture.instance, required),
        f"{role} requires a {required.__name__}, not a {type(fixture.instance).__name__}",
    )


@BASE.specified_in("wearsim.plugins.Load.span")
def span_is_an_interval(fixture: LoadFixture) -> None:
    """The span is None or a first and a last time; the stiffness is not negative."""
    span, stiffness = fixture.instance.span, fixture.instance.stiffness
    require(
        span is None or (len(span) == 2 and span[0] < span[1]),
        f"the span is {span}, neither None nor a first and a last time",
    )
    require(stiffness >= 0.0, f"the stiffness is {stiffness:g} N/m")


@BASE.specified_in("wearsim.plugins.Load.force")
def force_is_elementwise(fixture: LoadFixture) -> None:
    """The force is finite, has the shape of the times, and depends on each time individually."""
    times = np.linspace(*fixture.intervals[0], 60)

    def reshaped(times: FloatArray) -> FloatArray:
        forces = np.asarray(fixture.fresh().force(times.reshape(6, 10)))
        require_values("force at times of shape (6, 10)", forces, (6, 10))
        return forces.ravel()

    other = {"a call with times of shape (6, 10)": reshaped}
    forces = require_repeatable("force", fixture.instance.force, other, times)
    require_values("force", forces, times.shape)


@BASE.specified_in("wearsim.plugins.Load.mean")
def mean_matches_force(fixture: LoadFixture) -> None:
    """The mean is exact: it equals the mean of the force, and of the means of sub-intervals."""
    load = fixture.instance
    for start, stop in fixture.intervals:
        forces = fixture.forces(start, stop)
        name, mean = f"the mean from {start:g} to {stop:g} s", load.mean(start, stop)
        agree(f"{name}, compared with the force,", mean, forces.mean(), 1e-6, float(np.ptp(forces)))
        middle = start + 0.3 * (stop - start)
        parts = 0.3 * load.mean(start, middle) + 0.7 * load.mean(middle, stop)
        agree(f"{name}, compared with its sub-intervals,", mean, parts, 1e-7)


@BASE.specified_in("wearsim.plugins.Load.deviation")
def deviation_matches_force(fixture: LoadFixture) -> None:
    """The deviation is exact: it equals the standard deviation of the force."""
    for start, stop in fixture.intervals:
        forces = fixture.forces(start, stop)
        agree(
            f"the deviation from {start:g} to {stop:g} s, compared with the force,",
            fixture.instance.deviation(start, stop),
            forces.std(),
            1e-3,
            # cancellation in mean squares of a short part of a long log: some 1e-6 of the force
            5e-3 * float(np.abs(forces).max()),
        )


@BASE.specified_in("wearsim.plugins.Load.extremes")
def extremes_bound_force(fixture: LoadFixture) -> None:
    """The extremes are the smallest and the largest force."""
    for start, stop in fixture.intervals:
        forces = fixture.forces(start, stop)
        extremes = fixture.instance.extremes(start, stop)
        sampled = float(forces.min()), float(forces.max())
        # the default implementation samples the force and can miss a peak slightly
        slack = 1e-3 * float(np.ptp(forces)) + 1e-9 * float(np.abs(forces).max())
        require(
            all(abs(a - b) <= slack for a, b in zip(extremes, sampled, strict=True)),
            f"from {start:g} to {stop:g} s the extremes are {extremes[0]:.9g} to"
            f" {extremes[1]:.9g} N, and the force varies from {sampled[0]:.9g} to"
            f" {sampled[1]:.9g} N",
        )


@BASE.specified_in("wearsim.plugins.Load.pauses")
def pauses_are_without_load(fixture: LoadFixture) -> None:
    """The pauses are intervals in order, and the force in them is zero."""
    pauses = np.asarray(fixture.instance.pauses)
    require(
        pauses.ndim == 2 and pauses.shape[1] == 2 and bool((np.diff(pauses.ravel()) >= 0.0).all()),
        f"the pauses, shape {pauses.shape}, are not starts and ends of intervals in order",
    )
    for start, stop in pauses.tolist():
        force = float(np.abs(fixture.instance.force(np.linspace(start, stop, 11))).max())
        require(force == 0.0, f"the force in the pause from {start:g} to {stop:g} s is {force:g} N")


@TERM.specified_in("wearsim.plugins.LoadTerm.advance")
def two_half_steps_equal_one(fixture: LoadFixture) -> None:
    """Two half steps of a term equal one step, and a step of zero duration changes nothing."""
    term, (state, power, size) = fixture.instance, fixture.term_state
    for part in (1e-3, 0.1, 1.0):
        time = part * fixture.duration
        halves = term.advance(term.advance(state, power, 0.5 * time), power, 0.5 * time)
        name = f"two steps of {0.5 * time:g} s, compared with one of {time:g} s,"
        agree(name, halves, term.advance(state, power, time), 1e-10, size)
    agree("the state after zero time", term.advance(state, power, 0.0), state, 1e-12)


@TERM.specified_in("wearsim.plugins.LoadTerm.mean_force")
def mean_force_matches_state(fixture: LoadFixture) -> None:
    """The mean force of an interval equals the mean of the state, which is the force."""
    term, (state, power, size) = fixture.instance, fixture.term_state
    for part in (1e-3, 0.1, 1.0):
        time = part * fixture.duration
        total, current = np.zeros_like(state), term.advance(state, power, 0.5 * time / _STEPS)
        for _ in range(_STEPS):
            total = total + current / _STEPS
            current = term.advance(current, power, time / _STEPS)
        name, mean = f"the mean force over {time:g} s", term.mean_force(state, power, time)
        # the midpoint rule has an error in the square of a step over the time constant
        agree(f"{name}, compared with the advancing state,", mean, total, 1e-3, size)
        later = term.advance(state, power, 0.25 * time)
        parts = 0.25 * term.mean_force(state, power, 0.25 * time)
        parts = parts + 0.75 * term.mean_force(later, power, 0.75 * time)
        agree(f"{name}, compared with its sub-intervals,", mean, parts, 1e-10, size)


def _of_rollers(
    function: Callable[..., FloatArray],
    duration: float,
    size: int,
    state: FloatArray,
    power: FloatArray,
) -> FloatArray:
    """Return the values of all rollers, computed for `size` of them at a time."""
    parts = [slice(first, first + size) for first in range(0, len(state), size)]
    return np.concatenate([function(state[part], power[part], duration) for part in parts])


@TERM.specified_in("wearsim.plugins.LoadTerm")
def rollers_are_independent(fixture: LoadFixture) -> None:
    """The value of a roller does not depend on the other rollers."""
    state, power, _ = fixture.term_state
    for name in ("advance", "mean_force"):
        compute = partial(_of_rollers, getattr(fixture.instance, name), fixture.duration, 3)
        single = partial(_of_rollers, getattr(fixture.fresh(), name), fixture.duration, 1)
        others = {"the value of a roller without the others": single}
        together = require_repeatable(name, compute, others, state, power)
        require_values(f"{name} of 3 rollers", together, (3,))


@TERM.specified_in("wearsim.plugins.LoadTerm.lag")
def lag_parameters_match(fixture: LoadFixture) -> None:
    """A term with a `lag` is a first-order lag with this gain and time constant."""
    lag = fixture.instance.lag()
    if lag is None:
        return
    gain, constant = lag
    require(constant > 0.0, f"the time constant is {constant:g} s")
    state, power, _ = fixture.term_state
    for time in (0.1 * constant, constant, 5.0 * constant):
        rest, decay = gain * power, np.exp(-time / constant)
        when = f"after {time:g} s, for a lag of {gain:g} N/W and {constant:g} s,"
        expected = rest + (state - rest) * decay
        agree(f"the state {when}", fixture.instance.advance(state, power, time), expected, 1e-9)
        mean = rest + (state - rest) * (1.0 - decay) * constant / time
        agree(f"the mean force {when}", fixture.instance.mean_force(state, power, time), mean, 1e-9)


# the requirements above are complete here
LOADS = {"base": Checks(ANY | BASE), "term": Checks(ANY | TERM)}
