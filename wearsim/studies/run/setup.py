"""Setup of a test: its inputs as drawn, and the facts that follow before its first pass."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import zip_longest

import numpy as np

from wearsim.evolution.quantities import OneStation, Varying
from wearsim.mechanics.hertz.ellipse import HertzContact, hertz
from wearsim.models.loads import FollowerLoad
from wearsim.plugins import BODIES, JointDistribution, WearLaw
from wearsim.scenario import RandomInput, Scenario, require_run
from wearsim.scenario.axial_gap import AxialGap
from wearsim.scenario.parse.fields import CONTACT_FIELDS
from wearsim.studies.cam.point import Point
from wearsim.studies.cam.turn import CamTurn, turn_of
from wearsim.studies.run.inputs import load_mistake, origin
from wearsim.studies.start.heights import StartExtent, start_extent
from wearsim.types import ContactSolution, FloatArray

_BISECTIONS = 40
LINE_APPROACH = 12.0  # of a line contact, roughly, over q/(pi E*)
_MIDPOINTS = np.linspace(0.5, 63.5, 64) / 64.0  # probabilities to average over a distribution
RARE = 1e-7  # fraction of the passes that may exceed the range of the strips


class CylinderTurn:
    """A turn of a cylinder, as a cam with one station and constant kinematics.

    Parameters
    ----------
    scenario : Scenario
    """

    varies, greatest_demand, greatest_skid = False, 0.0, 0.0  # as of `CamTurn`

    def __init__(self, scenario: Scenario) -> None:
        self.mean_radius = scenario.cylinder.radius
        self.curvatures = (1.0 / self.mean_radius + 1.0 / scenario.roller.radius,)
        self.track = OneStation(
            *self.curvatures, scenario.operation.speed * self.mean_radius, self.mean_radius
        )

    def loads_and_curvatures(self, load: float) -> list[tuple[float, float]]:
        """Return the load of a roller [N] and the relative curvature [1/m], of the one station."""
        return [(load, *self.curvatures)]


@dataclass(frozen=True, eq=False)
class Setup:
    """A test before its first pass: its inputs as drawn, and the facts that follow from them.

    Each fact is computed once, when it is first needed.

    Parameters
    ----------
    scenario : Scenario
        The scenario with the values drawn for the whole test; other random inputs at their mean.
    rollers : mapping of str to ndarray, shape (rollers,)
        Values drawn for each roller that a scenario cannot hold, by field of `ContactInputs`.
    varying : tuple of Varying
        Processes; their rollers are the scenario's.
    passes : tuple of RandomInput
        Inputs that are drawn at every pass or turn.
    values : mapping of str to ndarray, shape () or (rollers,)
        All values drawn for the test and for its rollers, by the scenario's key [SI].
    time_means : mapping of str to ndarray, shape () or (rollers,)
        Means over the test of the processes, by the scenario's key [SI].
    """

    scenario: Scenario
    rollers: Mapping[str, FloatArray] = field(default_factory=dict)
    varying: tuple[Varying, ...] = ()
    passes: tuple[RandomInput, ...] = ()
    values: Mapping[str, FloatArray] = field(default_factory=dict)
    time_means: Mapping[str, FloatArray] = field(default_factory=dict)
    _patches: dict[tuple[float, float], HertzContact] = field(default_factory=dict, init=False)

    def greatest_mean(self, name: str, mean: float) -> float:
        """Return the greatest mean absolute value of an input of a contact over the whole test.

        Inputs that change sign cause wear with either sign, so that their absolute value counts.

        Parameters
        ----------
        name : str
            Field of `ContactInputs`.
        mean : float
            The value where the input is not random, which is also the mean over the passes.
        """
        sizes = [abs(float(value)) for value in (mean, *self.rollers.get(name, ()))]
        whole = np.zeros(1), np.full(1, self.scenario.total_time)
        for paths in [item.paths for item in self.varying if item.name == name]:
            signed = _changes_sign(paths.value)
            mean_of_path = np.abs(paths.value).mean() if signed else paths.mean(*whole)[0]
            sizes.append(abs(float(mean_of_path)))
        for random in self.passes:
            if len(random.keys) == 1 and CONTACT_FIELDS[random.keys[0]] == name:
                values = random.scalar.quantile(_MIDPOINTS)
                sizes += [float(np.abs(values).mean())] * _changes_sign(values)
        return max(sizes)

    def range_of(self, name: str) -> tuple[float, float]:
        """Return the approximate range of the drawn values of an input of a contact, and of 0.

        Parameters
        ----------
        name : str
            Field of `ContactInputs`.
        """
        paths = [item.paths.value for item in self.varying if item.name == name]
        limits = [
            limits
            for random in self.passes
            for key, limits in zip(random.keys, _ranges(random), strict=True)
            if CONTACT_FIELDS[key] == name
        ]
        values = [
            *(0.0, *self.rollers.get(name, ())),
            *(end for pair in limits for end in pair),
            *(float(end) for path in paths for end in (path.min(), path.max())),
        ]
        return min(values), max(values)

    @cached_property
    def turn(self) -> CamTurn | CylinderTurn:
        """Turn of the cam, or of the cylinder."""
        return turn_of(self.scenario) if self.scenario.cam else CylinderTurn(self.scenario)

    @cached_property
    def inputs(self) -> Mapping[str, FloatArray]:
        """Inputs of the contacts of all rollers as the scenario has them, shape (rollers, 1) [SI].

        By field of `ContactInputs`, and "offset" of the roller.
        """
        scenario, creepage = self.scenario, self.scenario.creepage
        values: Mapping[str, float | tuple[float, ...]] = {
            "offset": scenario.roller.offset,
            "normal_force_offset": 0.0,
            "yaw": creepage.yaw,
            "tilt": creepage.tilt,
            "friction": scenario.friction.coefficient,
            "longitudinal": creepage.longitudinal or 0.0,
            "bearing_torque": creepage.bearing_torque or 0.0,
        }
        shape = scenario.operation.rollers, 1
        return {name: np.full(shape, np.reshape(value, (-1, 1))) for name, value in values.items()}

    def inputs_of(
        self, rollers: Sequence[int], drawn: Mapping[str, FloatArray]
    ) -> dict[str, FloatArray]:
        """Return the inputs of some rollers, by number, and drawn ones instead of them.

        Parameters
        ----------
        rollers : sequence of int
        drawn : mapping of str to ndarray
            Drawn inputs from `contact_values`; they broadcast to (rollers, realisations).
        """
        return {**{name: column[list(rollers)] for name, column in self.inputs.items()}, **drawn}

    @cached_property
    def kinds(self) -> list[tuple[object, ...]]:
        """Offset, yaw, tilt and start profile of each roller; equal rows are merged."""
        columns = [self.inputs[name][:, 0].tolist() for name in ("offset", "yaw", "tilt")]
        profiles = self.scenario.roller.profiles or (None,)  # the last one is that of the others
        return list(zip_longest(*columns, profiles, fillvalue=profiles[-1]))

    @cached_property
    def start_extent(self) -> StartExtent | None:
        """Extent of the start profiles, None if there is none."""
        cylinder, roller = self.scenario.cylinder, self.scenario.roller
        if cylinder.profile is None and cylinder.start_surface is None and not roller.profiles:
            return None
        return start_extent(self.scenario, self.inputs["offset"][:, 0].tolist())

    @cached_property
    def greatest_load(self) -> float:
        """Greatest load of the test [N].

        Raises
        ------
        ScenarioError
            If the load is not defined for the whole test, or not positive.
        """
        return self.range_of("normal_force_offset")[1] + self.load_range()[1]

    def load_range(self, stop: float | None = None) -> tuple[float, float]:
        """Return the least and greatest load up to `stop` [s], before any feedback [N].

        By default it is that of the whole test, which the scenario must define.

        Raises
        ------
        ScenarioError
            If the load is not defined for the whole time, or is not positive outside of pauses.
        """
        scenario, load = self.scenario, self.scenario.load.built
        if stop is None:
            require_run(scenario)
            stop = scenario.total_time
        if isinstance(load, FollowerLoad):
            low, high = turn_of(scenario).normal_range
            return (low if low > 0.0 else high), high  # where N changes sign, the flank changes
        span = None if load.constant else load.span  # a constant load is known at all times
        if span is not None and (span[0] > 0.0 or span[1] < stop * (1.0 - 1e-9)):
            raise load_mistake(
                scenario,
                "the log does not cover the test",
                f"{span[0] / 60.0:.6g} to {span[1] / 60.0:.6g} min",
                f"0 to {stop / 60.0:.6g} min: a longer log or a shorter operation.duration",
            )
        low, high = load.extremes(0.0, stop)
        if scenario.load.terms:
            return low, high
        if high <= 0.0:
            when = f"never above zero up to {stop / 60.0:.6g} min" if stop else "zero at the start"
            raise load_mistake(
                scenario,
                f"the load is {when}, and there is no contact",
                f"{high:.6g} N",
                "a load above zero",
            )
        if low < 0.0 or (low == 0.0 and not len(load.pauses)):
            before, after = 0.0, stop
            for _ in range(60):  # the first time of the least load, of any kind of load
                middle = 0.5 * (before + after)
                reached = load.extremes(0.0, middle)[0] <= low
                before, after = (before, middle) if reached else (middle, after)
            raise load_mistake(
                scenario,
                "the load falls to zero or below, and contact is lost",
                f"{low:.6g} N at {after / 60.0:.6g} min",
                "a load above zero at all times, or zero for a pause in a log",
            )
        return low, high

    @cached_property
    def patch(self) -> HertzContact:
        """Widest patch of the unworn bodies in the test."""
        return self.widest_patch(self.greatest_load)

    @cached_property
    def positions(self) -> FloatArray:
        """Contact positions of all rollers on an unworn cylinder, shape (rollers, 1) [m]."""
        return self.positions_of(self.inputs)

    @cached_property
    def centre(self) -> float:
        """Middle of the contacts [m]: the scenario's, or between those of the rollers."""
        return self.centre_of(self.positions)

    @property
    def first_centre(self) -> float:
        """Middle of the first roller's contact, or the scenario's choice [m]."""
        return self.centre_of(self.positions[:1])

    @cached_property
    def drawn_shift(self) -> float:
        """Greatest distance by which the drawn tilt moves contacts [m]."""
        tilts = self.range_of("tilt")
        shifts = self.scenario.creepage.tilt_shifts_contact and any(tilts)
        return float(np.abs(self.tilt_shift(tilts)).max()) if shifts else 0.0

    @cached_property
    def shift(self) -> float:
        """Greatest distance of the contacts' middles from `centre` [m]."""
        return float(np.abs(self.positions - self.centre).max()) + self.drawn_shift

    @cached_property
    def fresh(self) -> float:
        """Distance from `centre` of the contacts' edges on the unworn bodies, with a margin [m]."""
        return self.shift + 1.3 * self.patch.b

    @cached_property
    def final(self) -> float:
        """Distance from `centre` of the edges of the final groove, with a margin [m]."""
        return self.reach_of(self.half_width(self.greatest_load))

    @property
    def overrollings(self) -> float:
        """Overrollings of a point of a roller in a pass of the cylinder, or a turn of the cam."""
        return self.turn.mean_radius / self.scenario.roller.radius / self.scenario.operation.rollers

    def reach_of(self, half_width: float) -> float:
        """Return the distance from `centre` of the edges of a groove, with a margin [m]."""
        return self.fresh + 1.1 * half_width

    def positions_of(self, inputs: Mapping[str, FloatArray]) -> FloatArray:
        """Return contact positions on an unworn cylinder [m].

        Parameters
        ----------
        inputs : mapping of str to ndarray
            Among them offset [m] and tilt [rad], see `inputs`.
        """
        shifts = self.scenario.creepage.tilt_shifts_contact and inputs["tilt"].any()
        shift = self.tilt_shift(inputs["tilt"]) if shifts else 0.0
        return np.asarray(inputs["offset"] * self.scenario.axial_gap.apex_share + shift)

    def centre_of(self, positions: FloatArray) -> float:
        """Return the middle of the strips for contact positions [m]."""
        given = self.scenario.contact.centre
        return 0.5 * float(positions.min() + positions.max()) if given is None else given

    def tilt_shift(self, tilt: FloatArray | tuple[float, ...]) -> FloatArray:
        """Return the distance by which tilt [rad] moves the contact of unworn bodies [m]."""
        gap = self.scenario.axial_gap
        half = 0.0 if gap.is_crowned else self.widest_patch(self.load_range(0.0)[1]).b
        return gap.shift(np.asarray(tilt, dtype=np.float64), half)

    def fresh_patch(self, load: float, curvature: float | None = None) -> HertzContact:
        """Return the patch of the unworn bodies under `load` [N] after Hertz.

        Where a roller ends within it, the patch is a line contact as wide as the roller. The
        relative curvature along rolling [1/m] is taken from cylinder and roller unless it is given.
        """
        if curvature is None:
            curvature = 1.0 / self.scenario.cylinder.radius + 1.0 / self.scenario.roller.radius
        known = self._patches.get((load, curvature))
        if known is None:
            known = self._patches[load, curvature] = _patch(self.scenario, load, curvature)
        return known

    def patches_at(self, point: Point) -> list[HertzContact]:
        """Return the patch of the unworn bodies at the points of a turn, with its load there."""
        curvatures = point.kinematics.relative_curvature.ravel().tolist()
        return list(map(self.fresh_patch, point.normal_force.ravel().tolist(), curvatures))

    def hardest_patch(self, load: float) -> tuple[HertzContact, float]:
        """Return the patch of the greatest peak pressure and its load [N].

        It is that under `load` [N] on a cylinder, and one of those at the stations of a cam.
        """
        pairs = [(self.fresh_patch(*at), at[0]) for at in self.turn.loads_and_curvatures(load)]
        return max(pairs, key=lambda pair: pair[0].peak_pressure)

    def widest_patch(self, load: float) -> HertzContact:
        """Return the widest patch under `load` [N] around the cylinder or the cam."""
        patches = [self.fresh_patch(load, max(c, 1e-3)) for c in self.turn.curvatures]
        return max(patches, key=lambda patch: patch.b)

    def half_width(self, load: float, full_slip: bool = True) -> float:
        """Return half the final width of the groove predicted for full slip under `load` [N] [m].

        Rigid bodies in full slip wear to a depth d = [(3/4) c N n / sqrt(2 R)]^(2/3) and a width
        2 sqrt(2 R d), where c is the depth per pass and load of both bodies; with another form than
        a circular crown, to the depth of a conformal groove with the same cross-section. For a
        nonlinear wear law c is the greater value of the initial contact and the final groove.
        Without `full_slip` the slip is less by the adhesion in the initial patch, after Carter.
        """
        scenario, creepage, turn = self.scenario, self.scenario.creepage, self.turn
        if scenario.wear is None:
            return 0.0
        patch, roller = self.fresh_patch(load), scenario.roller
        friction = self.greatest_mean("friction", scenario.friction.coefficient)
        longitudinal = self.greatest_mean("longitudinal", creepage.longitudinal or 0.0)
        saturation = friction * patch.a * turn.curvatures[-1] / scenario.friction.creep_factor
        longitudinal = max(longitudinal, saturation * turn.greatest_demand, turn.greatest_skid)
        yaw, tilt = (
            max(abs(angle) for angle in (*self.range_of(name), *self.inputs[name].ravel().tolist()))
            for name in ("yaw", "tilt")
        )
        differs = creepage.differential_slip or (creepage.drive == "free" and not scenario.cam)
        curvature = 1.0 / roller.radius + 1.0 / scenario.cylinder.radius if differs else 0.0
        gap, profile = scenario.axial_gap, self.start_extent
        slipping = 1.0
        if not full_slip:
            rolling = 1.0 / roller.radius + 1.0 / scenario.cylinder.radius
            saturated = friction * patch.a * rolling / scenario.friction.creep_factor
            ratio = min(float(np.hypot(longitudinal, yaw)) / saturated, 1.0)
            slipping = ratio * (2.0 - ratio)
        start = 0.0 if profile is None else profile.relief
        share = self.overrollings
        half, speed, law = patch.b, scenario.rolling_speed, scenario.wear.built
        of_cylinder, of_roller = (law.depth_per_dissipation(body, speed) for body in BODIES)
        linear = None
        if of_cylinder is not None and of_roller is not None:
            linear = of_cylinder + share * of_roller
        for _ in range(20):  # the slip at the sides of the groove depends weakly on its width
            rise = half**2 / (2.0 * gap.radius_at(half))
            along = longitudinal + tilt / roller.radius * half + rise * curvature
            sliding = slipping * friction * float(np.hypot(along, yaw))
            if linear is None:
                line_loads = 0.75 * load / np.array([patch.b, max(half, patch.b)])
                per_load = self._wear_per_load(law, share, line_loads, sliding)
            else:
                per_load = linear * sliding * speed
            depth = gap.depth_of(per_load * load * scenario.total_passes)
            before, half = half, float(gap.half_width(depth + start))
            if half == before:
                break
        return half

    def _wear_per_load(
        self, law: WearLaw, share: float, line_load: FloatArray, friction_slip: float
    ) -> float:
        """Return the greatest depth per pass and line load in full slip, of both bodies [m/(N/m)].

        Parameters
        ----------
        law : WearLaw
            Not linear in the dissipation.
        share : float
            Overrollings of a point of a roller per pass.
        line_load : ndarray, shape (strips,)
            Line loads at which it is evaluated [N/m].
        friction_slip : float
            Friction coefficient times slip.
        """
        scenario, speed = self.scenario, self.scenario.rolling_speed
        curvature = 1.0 / scenario.cylinder.radius + 1.0 / scenario.roller.radius
        stiffness = np.pi * scenario.pair.contact_modulus * curvature
        half_length = np.sqrt(4.0 * line_load / stiffness)
        dissipation = friction_slip * line_load * speed
        sliding = ContactSolution(
            y=np.zeros_like(line_load),
            half_length=half_length,
            line_load=line_load,
            dissipation=dissipation,
            force_x=0.0,
            force_y=0.0,
            spin_moment=0.0,
            approach=0.0,
            peak_pressure=float((2.0 * line_load / (np.pi * half_length)).max()),
            adhesion_fraction=0.0,
            power=float(dissipation.sum()),
            longitudinal_creepage=0.0,
            iterations=0,
        )
        of_cylinder, of_roller = (law.depth_per_pass(body, sliding, speed) for body in BODIES)
        return float(((of_cylinder + share * of_roller) / line_load).max())


def _patch(scenario: Scenario, load: float, curvature: float) -> HertzContact:
    """Return the patch of the unworn bodies; see `Setup.fresh_patch`."""
    modulus, along = scenario.pair.contact_modulus, 0.5 * curvature
    half, gap = 0.5 * (scenario.roller.width or math.inf), scenario.axial_gap
    if not gap.is_crowned:
        return _patch_of_form(gap, along, load, modulus)
    patch = hertz(along, 0.5 / gap.radius_at(half), load, modulus)
    if patch.b <= half:
        return patch
    line_load = load / (2.0 * half)
    half_length = math.sqrt(2.0 * line_load / (math.pi * modulus * along))
    pressure = 2.0 * line_load / (math.pi * half_length)
    return replace(patch, a=half_length, b=half, peak_pressure=max(pressure, patch.peak_pressure))


def _patch_of_form(gap: AxialGap, along: float, load: float, modulus: float) -> HertzContact:
    """Return the approximate patch of bodies that are not circular crowns.

    It is as wide as that of the crown with the same gap at its ends. The line loads are those of a
    foundation that yields by the gap there, or by the approach of a line contact if that is more.
    """
    half = _half_width(gap, along, load, modulus)
    line_load = load / (2.0 * half)
    approach = LINE_APPROACH * line_load / (math.pi * modulus)
    level = max(gap.depth_at(half), approach)
    greatest = line_load * level / (level - gap.mean_drop(half))
    half_length = math.sqrt(2.0 * greatest / (math.pi * modulus * along))
    return HertzContact(half_length, half, 2.0 * greatest / (math.pi * half_length), approach, load)


def _half_width(gap: AxialGap, along: float, load: float, modulus: float) -> float:
    """Return the half-width of the patch of a crown with the same gap there [m]."""
    low, high = 0.0, gap.greatest_half_width
    if _patch_is_wider(gap, along, load, modulus, high):
        return high
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        wider = _patch_is_wider(gap, along, load, modulus, middle)
        low, high = (middle, high) if wider else (low, middle)
    return high


def _patch_is_wider(
    gap: AxialGap, along: float, load: float, modulus: float, half_width: float
) -> bool:
    """Return whether the crown with the same gap at a half-width has a wider patch."""
    radius = gap.radius_at(half_width)
    return math.isinf(radius) or hertz(along, 0.5 / radius, load, modulus).b > half_width


def _changes_sign(values: FloatArray) -> bool:
    return bool(values.min() < 0.0 < values.max())


def _ranges(item: RandomInput) -> list[list[float]]:
    """Return the range of each value that an input sets, without the mean of a load."""
    if isinstance(item.distribution, JointDistribution):
        return [[-reach, reach] for reach in item.distribution.reach]
    low, high = item.scalar.quantile(np.array([RARE, 1.0 - RARE]))
    mean = origin(item.name, item.mean[0])
    return [[float(low) - mean, float(high) - mean]]
