"""Conformance tests of loads and of terms added to them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from wearsim.plugins import Load, LoadSpec, LoadTerm
from wearsim.testing.checks import (
    Checks,
    Fixture,
    agree,
    require,
    require_repeatable,
    require_values,
    spec_checks,
)
from wearsim.types import FloatArray

_SAMPLES = 200_000
_PARTS = ((0.0, 1.0), (0.1, 0.35), (0.5, 0.5001), (0.999, 1.0))
_STEPS = 1000


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
        forces: FloatArray = self.instance.force(start + (stop - start) * midpoints)
        return forces

    @cached_property
    def term_state(self) -> tuple[FloatArray, FloatArray, float]:
        """States of a term for three rollers, their powers [W], and the largest state."""
        power = np.array([0.0, 0.05, 0.2])
        start = self.instance.advance(np.zeros(3), power[::-1].copy(), 0.2 * self.duration)
        return np.asarray(start), power, float(np.abs(start).max())


ANY: Checks[LoadFixture] = spec_checks()
BASE: Checks[LoadFixture] = Checks()
TERM: Checks[LoadFixture] = Checks()


@ANY.specified_in("wearsim.plugins.LoadSpec")
def factory_matches_role(fixture: LoadFixture) -> None:
    """The factory of a base builds a Load, that of a term a LoadTerm."""
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


BY_ROLE = {"base": Checks(ANY | BASE), "term": Checks(ANY | TERM)}
