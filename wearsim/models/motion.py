"""The built-in motion laws of cam followers.

Laws with a piecewise sinusoidal acceleration are integrated exactly from their pieces. Names and
laws after VDI 2143 and Norton, Cam Design and Manufacturing Handbook (2009), chapters 3 and 4.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from wearsim.csv_tables import read_columns
from wearsim.errors import mistake_in
from wearsim.plugins import MotionLaw, MotionLawSpec, Options
from wearsim.quantities import InputFile, Quantity
from wearsim.types import FloatArray, IntArray
from wearsim.units import ANGLE, as_written, conversion

#: start of a piece, amplitude, angular frequency and phase there of a piece of an acceleration
Piece = tuple[float, float, float, float]

_HALF = 0.5 * math.pi
_MODIFIED_SINE = (
    (0.0, 1.0, 4.0 * math.pi, 0.0),
    (0.125, 1.0, 4.0 * math.pi / 3.0, _HALF),
    (0.875, 1.0, 4.0 * math.pi, 3.0 * _HALF),
)
_MODIFIED_TRAPEZOID = (
    (0.0, 1.0, 4.0 * math.pi, 0.0),
    (0.125, 1.0, 0.0, _HALF),
    (0.375, 1.0, 4.0 * math.pi, _HALF),
    (0.625, -1.0, 0.0, _HALF),
    (0.875, 1.0, 4.0 * math.pi, 3.0 * _HALF),
)
FEWEST_ROWS = 8
#: Other names of the columns of angle and lift.
ANGLE_NAMES = (
    *("cam angle", "rotation", "theta", "phi", "winkel", "drehwinkel", "nockenwinkel"),
    "kurvenwinkel",
)
LIFT_NAMES = (
    *(
        "rise",
        "displacement",
        "follower",
        "s",
        "psi",
        "hub",
        "erhebung",
        "stößelhub",
        "stoesselhub",
    ),
    *("rollenhub", "schwenkwinkel", "hebelwinkel"),
)
_FLOOR = 6.0  # standard deviations of the noise below which a jump is ignored
_BLUNT = 0.05  # part of the greatest slope by which noise may hide a corner
_WIDEST = math.radians(2.0)  # greatest distance of means of a noisy table
_NORTON = ("Norton, Cam Design and Manufacturing Handbook (2009)", "VDI 2143")


class Dwell(MotionLaw):
    """No motion."""

    def __init__(self, options: Options, angle: float, rise: float, unit: str) -> None:
        pass

    def lift(self, angle: FloatArray) -> FloatArray:
        """Return zeros, shape (3, points)."""
        return np.zeros((3, len(angle)))


class Sinusoidal(MotionLaw):
    """Law with an acceleration of sinusoidal pieces, scaled to the rise.

    Parameters
    ----------
    angle, rise : float
        Of the segment [rad], [m or rad].
    pieces : sequence of Piece
        Acceleration over the part of the angle, from 0 to 1.
    """

    def __init__(self, angle: float, rise: float, pieces: Sequence[Piece]) -> None:
        self._angle, self._pieces = angle, pieces
        self._starts = np.array([piece[0] for piece in pieces])
        self.breaks = tuple((self._starts[1:] * angle).tolist())
        self._state = [(0.0, 0.0)]  # lift and slope where each piece starts
        for number, start in enumerate(self._starts[1:].tolist()):
            lift, slope, _ = self._piece(number, np.array(start))
            self._state.append((float(lift), float(slope)))
        self._scale = rise / float(self._piece(len(pieces) - 1, np.array(1.0))[0])

    def _piece(self, number: int, place: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        start, amplitude, frequency, phase = self._pieces[number]
        lift, slope = self._state[number]
        t = place - start
        if frequency == 0.0:
            level = amplitude * math.sin(phase)
            return lift + (slope + 0.5 * level * t) * t, slope + level * t, level + 0.0 * t
        wave, size = frequency * t + phase, amplitude / frequency
        drift = slope + size * math.cos(phase)
        return (
            lift + drift * t + size / frequency * (math.sin(phase) - np.sin(wave)),
            drift - size * np.cos(wave),
            amplitude * np.sin(wave),
        )

    def lift(self, angle: FloatArray) -> FloatArray:
        """Return lift and derivatives by the angle, shape (3, points)."""
        place = np.asarray(angle) / self._angle
        pieces = np.searchsorted(self._starts, place, side="right") - 1
        lift = np.empty((3, len(place)))
        for number in range(len(self._pieces)):
            chosen = pieces == number
            lift[:, chosen] = self._piece(number, place[chosen])
        return lift * (self._scale / self._angle ** np.arange(3.0))[:, None]


class ConstantVelocityOptions(Options):
    """Options of the law `constant-velocity`."""

    blend: Annotated[float, Quantity(ANGLE, "positive")] = Field(
        description="angle of the blend at either end, in which the acceleration is half a sine"
    )


def _constant_velocity(
    options: ConstantVelocityOptions, angle: float, rise: float, unit: str
) -> Sinusoidal:
    blend = options.blend / angle
    if blend > 0.5:
        raise ValueError(
            f"two blends of {math.degrees(options.blend):.6g} deg are longer than the segment of"
            f" {math.degrees(angle):.6g} deg"
        )
    wave = math.pi / blend
    middle = [] if blend == 0.5 else [(blend, 0.0, 0.0, 0.0)]
    return Sinusoidal(angle, rise, [(0.0, 1.0, wave, 0.0), *middle, (1.0 - blend, -1.0, wave, 0.0)])


def _pieces(*pieces: Piece) -> Callable[[Options, float, float, str], Sinusoidal]:
    """Return the factory of a law with these pieces."""

    def build(options: Options, angle: float, rise: float, unit: str) -> Sinusoidal:
        return Sinusoidal(angle, rise, pieces)

    return build


class Polynomial(MotionLaw):
    """Polynomial with given derivatives at both ends of the segment.

    Parameters
    ----------
    angle, rise : float
        Of the segment [rad], [m or rad].
    start, end : sequence of float
        First, second, ... derivative by the angle at the ends.
    """

    def __init__(
        self, angle: float, rise: float, start: Sequence[float], end: Sequence[float]
    ) -> None:
        from numpy.polynomial import Polynomial as Series  # noqa: PLC0415  (few scenarios)

        conditions = [
            (place, order, value)
            for place, derivatives in ((0.0, [0.0, *start]), (1.0, [rise, *end]))
            for order, value in enumerate(derivatives)
        ]
        powers = [Series.basis(k) for k in range(len(conditions))]
        rows = [[power.deriv(order)(place) for power in powers] for place, order, _ in conditions]
        values = [value * angle**order for _, order, value in conditions]
        series = Series(np.linalg.solve(np.array(rows, dtype=np.float64), np.array(values)))
        self._angle = angle
        self._series = [series.deriv(order) if order else series for order in range(3)]

    def lift(self, angle: FloatArray) -> FloatArray:
        """Return lift and derivatives by the angle, shape (3, points)."""
        place = np.asarray(angle) / self._angle
        return np.stack([part(place) / self._angle**k for k, part in enumerate(self._series)])


def _zeros(count: int) -> Callable[[Options, float, float, str], Polynomial]:
    """Return the factory of a polynomial whose first `count` derivatives vanish at the ends."""

    def build(options: Options, angle: float, rise: float, unit: str) -> Polynomial:
        return Polynomial(angle, rise, [0.0] * count, [0.0] * count)

    return build


class EndOptions(Options):
    """Derivatives of the lift at both ends of a segment."""

    start: tuple[str | float, ...] = Field(
        (0.0, 0.0),
        max_length=4,
        description="first, second, ... derivative by the angle at the start, such as"
        ' ["5 mm/rad", "0 mm/rad^2"]; of a swinging arm ["0.1 rad/rad", "0 rad/rad^2"]',
    )
    end: tuple[str | float, ...] = Field(
        (0.0, 0.0), max_length=4, description="the same derivatives at the end"
    )

    def derivatives(self, unit: str) -> tuple[list[float], list[float]]:
        """Return the derivatives at start and end [`unit`/rad^k].

        Raises
        ------
        QuantityError
            If a unit does not fit.
        """
        return tuple(  # type: ignore[return-value]
            [_derivative(value, order, unit) for order, value in enumerate(texts, start=1)]
            for texts in (self.start, self.end)
        )


def _derivative(value: str | float, order: int, unit: str) -> float:
    target = f"{unit}/rad" + (f"^{order}" if order > 1 else "")
    if not isinstance(value, str):
        if value == 0.0:
            return 0.0
        value = str(value)
    number, _, unit_given = value.strip().partition(" ")
    expected = f'a derivative such as "5 {"mm" if unit == "m" else "deg"}{target[len(unit) :]}"'
    return float(number) * float(conversion(unit_given, target, as_written(value), expected))


def _boundary(options: EndOptions, angle: float, rise: float, unit: str) -> Polynomial:
    return Polynomial(angle, rise, *options.derivatives(unit))


class TableOptions(Options):
    """Options of the law `table`."""

    file: InputFile = Field(
        description="CSV with columns such as 'angle [deg]', 'lift [mm]'; the angle from 0 to that"
        " of the segment"
    )


class Table(MotionLaw):
    """Quintic spline through a table, with slope and acceleration zero at both ends."""

    def __init__(self, options: TableOptions, angle: float, rise: float, unit: str) -> None:
        angles, lift = read_lift(options.file.text, options.file.path, unit)
        if abs(angles[0]) > 1e-9 or abs(angles[-1] - angle) > 1e-9:
            got = f"{math.degrees(angles[0]):.6g} to {math.degrees(angles[-1]):.6g} deg"
            expected = f"0 to {math.degrees(angle):.6g} deg, the segment's angle"
            raise mistake_in(options.file.path, "the angles do not span the segment", got, expected)
        angles[-1] = angle
        refuse_kinks(options.file.path, angles, lift)
        self._spline = LiftSpline(angles, lift - lift[0])

    def lift(self, angle: FloatArray) -> FloatArray:
        """Return lift and derivatives by the angle, shape (3, points)."""
        return self._spline(angle)


class LiftSpline:
    """Quintic spline of a lift.

    Parameters
    ----------
    angle, lift : ndarray, shape (points,)
        Points of the table [rad], [m or rad].
    closed : bool
        Whether it is a whole turn, whose last point is the first; else it begins and ends with
        slope and acceleration zero.
    """

    def __init__(self, angle: FloatArray, lift: FloatArray, *, closed: bool = False) -> None:
        from scipy.interpolate import make_interp_spline  # noqa: PLC0415  (slow to import)

        rest = [(1, 0.0), (2, 0.0)]
        ends: Any = "periodic" if closed else (rest, rest)
        spline = make_interp_spline(angle, lift, k=5, bc_type=ends)
        self._parts = [spline, spline.derivative(1), spline.derivative(2)]

    def __call__(self, angle: FloatArray) -> FloatArray:
        """Return lift and derivatives by the angle, shape (3, points)."""
        return np.stack([part(np.asarray(angle)) for part in self._parts])


def read_lift(text: str, path: str, unit: str) -> tuple[FloatArray, FloatArray]:
    """Return angles [rad] and lifts [`unit`] of a CSV file.

    Raises
    ------
    ScenarioError
        If the file cannot be read or has too few rows.
    """
    names = {"angle": ANGLE_NAMES, "lift": LIFT_NAMES}
    columns = read_columns(
        text, path, {"angle": "rad", "lift": unit}, aliases=names, rising="angle"
    )
    if len(columns["angle"]) < FEWEST_ROWS:
        got, expected = f"{len(columns['angle'])} rows", f"at least {FEWEST_ROWS}"
        raise mistake_in(path, "too few rows for a quintic spline", got, expected)
    return columns["angle"], columns["lift"]


def _isolated(values: FloatArray, size: FloatArray) -> IntArray:
    """Return the places of values that exceed sizes, and five times the values around them."""
    values = np.abs(values)
    around = np.full_like(values, np.inf)
    reach = 3  # a corner between two points changes the values at both
    for place in range(reach, len(values) - reach):
        sides = values[place - reach : place - reach + 2], values[place + reach - 1 :][:2]
        around[place] = max(side.max() for side in sides)
    places = np.flatnonzero((values > 5.0 * around) & (values > size))
    return places[np.diff(places, prepend=-9) > 1]  # one of two neighbours


def kinks(angle: FloatArray, lift: FloatArray, noise: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """Return the angles at which the slope, and the acceleration, of a table jump [rad].

    Parameters
    ----------
    angle, lift : ndarray, shape (points,)
    noise : float
        Standard deviation of the errors of the lift, which hide small jumps of the slope.
    """
    slope = np.diff(lift) / np.diff(angle)
    middle = 0.5 * (angle[1:] + angle[:-1])
    second = np.diff(slope) / np.diff(middle)
    third = np.diff(second) / np.diff(angle[1:-1])
    jump = np.diff(slope)
    # standard deviation of a difference of slopes by that of three points
    before, after = 1.0 / np.diff(angle)[:-1], 1.0 / np.diff(angle)[1:]
    scatter = noise * np.sqrt(before**2 + after**2 + (before + after) ** 2)
    floor = np.maximum(1e-3 * np.abs(slope).max(), _FLOOR * scatter)
    corners = angle[1:-1][_isolated(jump, floor)]
    least = np.full(len(third), 0.05 * np.abs(second).max())
    return corners, middle[1:-1][_isolated(third * np.diff(angle[1:-1]), least)]


def refuse_kinks(
    path: str, angle: FloatArray, lift: FloatArray, noise: float = 0.0, name: str = "lift"
) -> None:
    """Raise a ScenarioError if the slope of a table jumps.

    Where noise would hide a corner of 5 % of the greatest slope, means of neighbouring points are
    considered.

    Parameters
    ----------
    path : str
    angle, lift : ndarray, shape (points,)
    noise : float
        Standard deviation of the errors of the lift.
    name : str
        Name of the quantity, for the message.
    """
    if noise > 0.0:
        step, count = float(np.median(np.diff(angle))), 1
        while 2 * count * step <= _WIDEST:
            slope = np.abs(np.diff(lift[::count]) / np.diff(angle[::count])).max()
            if _FLOOR * noise * math.sqrt(6.0 / count) / (count * step) <= _BLUNT * slope:
                break
            count *= 2
        whole = len(angle) // count * count
        angle, lift = (values[:whole].reshape(-1, count).mean(axis=1) for values in (angle, lift))
        noise /= math.sqrt(count)
    corners, _ = kinks(angle, lift, noise)
    if len(corners):
        got = "a corner at " + ", ".join(f"{math.degrees(at):.6g} deg" for at in corners[:3])
        expected = f"a {name} without corners, or more points where it turns sharply"
        raise mistake_in(path, f"the slope of the {name} jumps", got, expected)


def _spec(
    name: str, factory: Callable[..., MotionLaw], summary: str, options: type[Options] = Options
) -> MotionLawSpec:
    return MotionLawSpec(
        name=name,
        factory=factory,
        options=options,
        summary=summary,
        rise={"dwell": "none", "table": "own"}.get(name, "required"),  # type: ignore[arg-type]
        references=_NORTON,
        protocol=2,
    )


SPECS = (
    _spec("dwell", Dwell, "no motion"),
    _spec("cycloidal", _pieces((0.0, 1.0, math.tau, 0.0)), "a sinusoidal acceleration"),
    _spec("harmonic", _pieces((0.0, 1.0, math.pi, _HALF)), "half a cosine; jumps next to a dwell"),
    _spec("modified-sine", _pieces(*_MODIFIED_SINE), "sine of low greatest velocity"),
    _spec("modified-trapezoid", _pieces(*_MODIFIED_TRAPEZOID), "low greatest acceleration"),
    _spec("polynomial-345", _zeros(2), "the 3-4-5 polynomial"),
    _spec("polynomial-4567", _zeros(3), "the 4-5-6-7 polynomial"),
    _spec("polynomial", _boundary, "a polynomial by its boundary conditions", EndOptions),
    _spec(
        "constant-velocity",
        _constant_velocity,
        "a constant velocity between two blends",
        ConstantVelocityOptions,
    ),
    _spec("table", Table, "a quintic spline through a CSV table", TableOptions),
)
