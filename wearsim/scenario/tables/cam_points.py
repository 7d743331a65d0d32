"""Motion from measured points: a spline through them, or a smoothing spline where they have noise.

The smoothing spline is constant on dwells, which become segments.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from wearsim.errors import mistake_in
from wearsim.mechanics.cam import Motion, Segment
from wearsim.mechanics.cam.smoothing import (
    SmoothedCurve,
    estimated_noise,
    scatter_through_points,
    smoothed,
)
from wearsim.types import FloatArray
from wearsim.units import in_engineers_unit, measure

POINTS = 1440  # of a turn, on which a motion is evaluated or fitted
_VISIBLE = 0.005  # change of the acceleration by noise, of its peak, that is smoothed
_FEWEST = 48  # points in whose differences noise can be seen
_NO_NOISE = 1e-12  # of the range of a table: rounding of doubles
#: lifts over the radius of the base circle beyond which their unit is probably wrong: those of cams
#: are 0.02 to 5, and a unit is wrong by a factor of 1000
LARGE, _SMALL = 20.0, 2e-3
CHOICE = 'choose other names with columns = ["ANGLE", "{}"] in [cam]'


@dataclass(frozen=True, eq=False)
class MeasuredPoints:
    """Noise of the table from which a motion was smoothed.

    Parameters
    ----------
    file : str
    quantity : str
        "lift" or "radius".
    unit : str
        SI unit of noise and residuals.
    noise : float
        Standard deviation of the points about the spline.
    tolerance : float, optional
        Noise that the scenario states.
    angle, residual : ndarray, shape (points,)
        Angle of each point from the first on [rad], and its value less the spline.
    scatter, error : float
        Scatter of the acceleration of a curve through every point, and standard error of that of
        the smoothed one, root mean squares over the turn [m/rad^2 or 1/rad].
    peak : float
        Greatest acceleration [m/rad^2 or 1/rad].
    """

    file: str
    quantity: str
    unit: str
    noise: float
    tolerance: float | None
    angle: FloatArray
    residual: FloatArray
    scatter: float
    error: float
    peak: float


def smoothed_points(
    angle: FloatArray, values: FloatArray, tolerance: float | None
) -> SmoothedCurve | None:
    """Return the smoothing spline of a closed table, or None if its points shall be followed."""
    if tolerance is not None:
        return smoothed(angle, values, tolerance) if tolerance > 0.0 else None
    noise = estimated_noise(angle, values) if len(angle) >= _FEWEST else 0.0
    if noise <= _NO_NOISE * float(np.ptp(values)):
        return None
    curve = smoothed(angle, values)
    return curve if scatter_through_points(angle, noise) > _VISIBLE * peak(curve) else None


def peak(motion: Callable[[FloatArray], FloatArray]) -> float:
    """Return the greatest acceleration of a closed curve."""
    return float(np.abs(motion(np.linspace(0.0, math.tau, POINTS))[2]).max())


def motion_of(
    name: str,
    curve: Callable[[FloatArray], FloatArray],
    dwells: tuple[tuple[float, float], ...],
) -> Motion:
    """Return the motion of a closed curve, with a segment for each dwell."""
    base = float(curve(np.zeros(1))[0, 0])
    if not dwells:
        return Motion((Segment(name, math.tau, _Turned(curve, 0.0, base)),), base)
    ends = np.mod([end for dwell in dwells for end in dwell], math.tau).tolist()
    segments = []
    for start, stop in itertools.pairwise(sorted({0.0, *ends, math.tau})):
        if any((0.5 * (start + stop) - low) % math.tau < high - low for low, high in dwells):
            segments.append(Segment("dwell", stop - start, _Still(), dwell=True))
        else:
            here = float(curve(np.array([start]))[0, 0])
            segments.append(Segment(name, stop - start, _Turned(curve, start, here)))
    return Motion(tuple(segments), base)


@dataclass(frozen=True)
class _Turned:
    """Lift of a closed curve, less its lift at an angle."""

    curve: Callable[[FloatArray], FloatArray]
    start: float
    base: float

    def __call__(self, angle: FloatArray) -> FloatArray:
        """Return lift and derivatives, shape (3, points)."""
        lift = self.curve(np.mod(self.start + np.asarray(angle), math.tau))
        lift[0] -= self.base
        return lift


@dataclass(frozen=True)
class _Still:
    """No motion."""

    def __call__(self, angle: FloatArray) -> FloatArray:
        """Return zeros, shape (3, points)."""
        return np.zeros((3, len(np.asarray(angle))))


def has_dimension(unit: str | None, target: str) -> bool:
    """Return whether a unit, if any, is of the dimension of another."""
    try:
        return unit is not None and measure(unit)[1] == measure(target)[1]
    except ValueError:
        return False


def refuse_unit(
    file: str, column: str, unit: str | None, greatest: float, base_radius: float, least: float
) -> None:
    """Raise a ScenarioError if lifts or radii do not suit the base circle at all.

    Parameters
    ----------
    file, column, unit : str
        File, and name and unit of the column.
    greatest : float
        Greatest lift, less the least, or greatest radius [m].
    base_radius : float
        [m].
    least : float
        Least of it over the radius of the base circle; 0 for lifts, which may be small.
    """
    ratio = greatest / base_radius
    if not least <= ratio <= LARGE:
        size = "large" if ratio > LARGE else "small"
        raise mistake_in(
            file,
            f"column '{column}' is too {size} for the base circle: its unit is probably wrong",
            beside(greatest, base_radius),
            f"{other_unit(unit, smaller=ratio > LARGE)} as unit, not {unit}",
        )


def small_lift(
    file: str, column: str, unit: str | None, greatest: float, base_radius: float
) -> str | None:
    """Return a note if the greatest lift is so small that its unit is probably wrong, or None."""
    if greatest >= _SMALL * base_radius:
        return None
    if greatest == 0.0:
        return f"{file}: column '{column}' is the same at all angles: the follower does not move"
    other = other_unit(unit, smaller=False)
    return (
        f"{file}: column '{column}' is small for the base circle, {beside(greatest, base_radius)}:"
        f" unless the cam is almost round, its unit is {other}, not {unit}"
    )


def beside(greatest: float, base_radius: float) -> str:
    """Return a length and the radius of the base circle [m], for messages."""
    first, second = (in_engineers_unit(value, "m", 4) for value in (greatest, base_radius))
    return f"up to {first} with base_radius = {second}"


def other_unit(unit: str | None, *, smaller: bool) -> str:
    """Return the unit that a column in the wrong `unit` probably has."""
    units = ("um", "mm", "m")
    place = units.index(unit) + (-1 if smaller else 1) if unit in units else -1
    return units[place] if 0 <= place < 3 else f"a {'smaller' if smaller else 'greater'} unit"


def refuse_few(path: str, count: int, fewest: int, what: str) -> None:
    """Raise a ScenarioError if a file has too few rows."""
    if count < fewest:
        raise mistake_in(path, f"too few {what}", str(count), f"at least {fewest}")
