"""What any load, and any term added to one, keeps."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from wearsim.plugins import Load, LoadSpec, LoadTerm
from wearsim.testing.checks import Checks, agree, require
from wearsim.testing.specs import Chosen, spec_checks
from wearsim.types import FloatArray

_SAMPLES = 200_000
_PARTS = ((0.0, 1.0), (0.1, 0.35), (0.5, 0.5001), (0.999, 1.0))


@dataclass(frozen=True)
class LoadBench:
    """A load, or a term, with options.

    Parameters
    ----------
    chosen : Chosen
        Its spec and options.
    duration : float
        Time over which a load that is known at all times is looked at, and a term followed [s].
    """

    chosen: Chosen[LoadSpec]
    duration: float = 3600.0

    def __str__(self) -> str:
        return str(self.chosen)

    def fresh(self) -> Any:
        """Return a new load or term."""
        return self.chosen.spec.factory(self.chosen.options)

    @cached_property
    def load(self) -> Any:
        """One load or term for all checks."""
        return self.fresh()

    @cached_property
    def intervals(self) -> list[tuple[float, float]]:
        """Intervals of time at which the load is known [s]."""
        first, last = self.load.span or (0.0, self.duration)
        return [(first + a * (last - first), first + b * (last - first)) for a, b in _PARTS]

    def forces(self, start: float, stop: float) -> FloatArray:
        """Return the load in the middle of many equal parts of an interval [N]."""
        middles = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
        forces: FloatArray = self.load.force(start + (stop - start) * middles)
        return forces


ANY: Checks[LoadBench] = Checks(spec_checks())
BASE: Checks[LoadBench] = Checks()
TERM: Checks[LoadBench] = Checks()
_LOAD = "wearsim.plugins.Load"


@ANY.promised_in("wearsim.plugins.LoadSpec")
def role_is_what_the_factory_builds(bench: LoadBench) -> None:
    """The factory of a base builds a Load, that of a term a LoadTerm."""
    role = bench.chosen.spec.role
    wanted = Load if role == "base" else LoadTerm
    built = type(bench.load).__name__
    require(
        isinstance(bench.load, wanted), f"{role} needs a {wanted.__name__}, and {built} is none"
    )


@BASE.promised_in("wearsim.plugins.Load.span")
def span_is_a_stretch_of_time(bench: LoadBench) -> None:
    """The span is None or goes from a first to a last time; the stiffness is not negative."""
    span = bench.load.span
    told = f"the span is {span}, neither None nor a first and a last time"
    require(span is None or (len(span) == 2 and span[0] < span[1]), told)
    require(bench.load.stiffness >= 0.0, f"the stiffness is {bench.load.stiffness:g} N/m")


@BASE.promised_in("wearsim.plugins.Load.force")
def force_is_the_same_however_it_is_asked(bench: LoadBench) -> None:
    """The force is finite, shaped as the times, and the same for each time however it is asked."""
    times = np.linspace(*bench.intervals[0], 60)
    kept = times.copy()
    forces = np.array(bench.load.force(times))
    require(np.array_equal(times, kept), "force changes the times it is given")
    require(forces.shape == times.shape, f"force has the shape {forces.shape}, not {times.shape}")
    require(bool(np.isfinite(forces).all()), "force is not finite")
    square = bench.fresh().force(times.reshape(6, 10))
    require(np.array_equal(square, forces.reshape(6, 10)), "times of shape (6, 10) differ")


@BASE.promised_in("wearsim.plugins.Load.mean")
def mean_is_that_of_the_force(bench: LoadBench) -> None:
    """The mean is exact: that of the force, and of the means of its parts."""
    for start, stop in bench.intervals:
        forces = bench.forces(start, stop)
        size = 1e-3 * float(np.ptp(forces))
        told = f"the mean from {start:g} to {stop:g} s, against that of the force,"
        agree(told, bench.load.mean(start, stop), forces.mean(), 1e-6, 1e3 * size)
        middle = start + 0.3 * (stop - start)
        parts = 0.3 * bench.load.mean(start, middle) + 0.7 * bench.load.mean(middle, stop)
        told = f"the mean from {start:g} to {stop:g} s, against those of its parts,"
        agree(told, bench.load.mean(start, stop), parts, 1e-7)


@BASE.promised_in("wearsim.plugins.Load.deviation")
def deviation_is_that_of_the_force(bench: LoadBench) -> None:
    """The deviation is exact: that of the force."""
    for start, stop in bench.intervals:
        forces = bench.forces(start, stop)
        told = f"the deviation from {start:g} to {stop:g} s, against that of the force,"
        # mean squares of a short part of a long log cancel to some 1e-6 of the force
        size = 5e-3 * float(np.abs(forces).max())
        agree(told, bench.load.deviation(start, stop), forces.std(), 1e-3, size)


@BASE.promised_in("wearsim.plugins.Load.extremes")
def extremes_hold_the_force(bench: LoadBench) -> None:
    """The force lies between its extremes, and reaches them."""
    for start, stop in bench.intervals:
        forces = bench.forces(start, stop)
        low, high = bench.load.extremes(start, stop)
        told = f"from {start:g} to {stop:g} s the extremes are {low:.9g} to {high:.9g} N"
        # those of the default are sampled, and may just miss a peak
        room = 1e-3 * float(np.ptp(forces)) + 1e-9 * float(np.abs(forces).max())
        least, most = float(forces.min()), float(forces.max())
        told += f" where the force goes from {least:.9g} to {most:.9g} N"
        require(low <= least + room and high >= most - room, told)
        require(low >= least - room and high <= most + room, told)


def _states(bench: LoadBench) -> tuple[FloatArray, FloatArray]:
    """Return the states that a term reaches from nothing, and powers [W], one per roller."""
    power = np.array([0.0, 0.05, 0.2])
    start = bench.load.advance(np.zeros(3), power[::-1].copy(), 0.2 * bench.duration)
    return np.asarray(start), power


@TERM.promised_in("wearsim.plugins.LoadTerm.advance")
def two_half_steps_are_one(bench: LoadBench) -> None:
    """A term advanced in two steps is where one step takes it, and no time changes nothing."""
    state, power = _states(bench)
    for part in (1e-3, 0.1, 1.0):
        time = part * bench.duration
        whole = bench.load.advance(state, power, time)
        half = bench.load.advance(bench.load.advance(state, power, 0.5 * time), power, 0.5 * time)
        size = float(np.abs(state).max())
        agree(
            f"two steps of {0.5 * time:g} s, against one of {time:g} s,", half, whole, 1e-10, size
        )
    still = bench.load.advance(state, power, 0.0)
    agree("the state after no time", still, state, 1e-12)


@TERM.promised_in("wearsim.plugins.LoadTerm.mean_force")
def mean_force_follows_the_state(bench: LoadBench) -> None:
    """The mean force of an interval is that of the state, which is the force, as it advances."""
    state, power = _states(bench)
    steps = 1000
    for part in (1e-3, 0.1, 1.0):
        time = part * bench.duration
        total, now = np.zeros_like(state), bench.load.advance(state, power, 0.5 * time / steps)
        for _ in range(steps):
            total = total + now / steps
            now = bench.load.advance(now, power, time / steps)
        # the middles of equal steps leave an error in the square of a step over the term's memory
        told = f"the mean force of {time:g} s, against the advancing state,"
        size = float(np.abs(state).max())
        agree(told, bench.load.mean_force(state, power, time), total, 1e-3, size)
        after = bench.load.advance(state, power, 0.25 * time)
        parts = 0.25 * bench.load.mean_force(state, power, 0.25 * time)
        parts = parts + 0.75 * bench.load.mean_force(after, power, 0.75 * time)
        told = f"the mean force of {time:g} s, against those of its parts,"
        agree(told, bench.load.mean_force(state, power, time), parts, 1e-10, size)


@TERM.promised_in("wearsim.plugins.LoadTerm")
def rollers_go_by_themselves(bench: LoadBench) -> None:
    """Every roller has its own number, that depends on no other's."""
    state, power = _states(bench)
    kept = state.copy(), power.copy()
    for name in ("advance", "mean_force"):
        together = np.asarray(getattr(bench.load, name)(state, power, bench.duration))
        require(together.shape == (3,), f"{name} has the shape {together.shape} for 3 rollers")
        require(bool(np.isfinite(together).all()), f"{name} is not finite")
        unchanged = np.array_equal(state, kept[0]) and np.array_equal(power, kept[1])
        require(unchanged, f"{name} changes what it is given")
        fresh = bench.fresh()
        alone = [getattr(fresh, name)(state[k : k + 1], power[k : k + 1], bench.duration)[0]
                 for k in range(3)]  # fmt: skip
        require(np.array_equal(together, alone), f"{name} of one roller depends on the others")


@TERM.promised_in("wearsim.plugins.LoadTerm.lag")
def lag_is_a_first_order_lag(bench: LoadBench) -> None:
    """A term that says it is a first-order lag is one, with that gain and time constant."""
    lag = bench.load.lag()
    if lag is None:
        return
    gain, constant = lag
    require(constant > 0.0, f"the time constant is {constant:g} s")
    state, power = _states(bench)
    for time in (0.1 * constant, constant, 5.0 * constant):
        rest, left = gain * power, np.exp(-time / constant)
        told = f"after {time:g} s, by a lag of {gain:g} N/W and {constant:g} s,"
        expected = rest + (state - rest) * left
        agree(f"the state {told}", bench.load.advance(state, power, time), expected, 1e-9)
        mean = rest + (state - rest) * (1.0 - left) * constant / time
        agree(f"the mean force {told}", bench.load.mean_force(state, power, time), mean, 1e-9)


BY_ROLE = {"base": Checks(ANY, BASE), "term": Checks(ANY, TERM)}
