"""Reading of a lift by angle, of a follower or a swinging arm, as a motion over a turn."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from wearsim.csv_tables import read_columns, units_of_columns
from wearsim.errors import mistake_in
from wearsim.mechanics.cam import Follower, Motion
from wearsim.mechanics.cam.smoothing import estimated_noise, scatter_through_points
from wearsim.models.motion import (
    ANGLE_NAMES,
    FEWEST_ROWS,
    LIFT_NAMES,
    LiftSpline,
    kinks,
    refuse_kinks,
)
from wearsim.quantities import Quantity
from wearsim.scenario.tables.cam_points import (
    CHOICE,
    MeasuredPoints,
    has_dimension,
    motion_of,
    peak,
    refuse_few,
    refuse_unit,
    small_lift,
    smoothed_points,
)
from wearsim.types import FloatArray
from wearsim.units import ANGLE, LENGTH, QuantityError, in_engineers_unit

if TYPE_CHECKING:
    from wearsim.scenario.tables.cam import CamTable

_CLOSED = 6.0  # standard deviations by which both ends of a turn may differ
_ROUNDED = 0.25  # of a step, by which the last angle may differ from a turn after the first
_NEAR = 0.05  # of a turn: angles in the wrong unit, the last row of which may be missing
_WIDEST = 2.0  # swing of an arm [rad]


def motion_of_lift(
    notes: list[str], table: CamTable, follower: Follower
) -> tuple[Motion, MeasuredPoints | None]:
    """Return the motion of a table of the lift, and its noise if it was smoothed.

    Parameters
    ----------
    notes : list of str
        Gets a note of jumps of the acceleration.
    table : CamTable
        With `lift`.
    follower : Follower

    Raises
    ------
    ScenarioError, QuantityError
        If the file or the tolerance cannot be used.
    """
    assert table.lift is not None
    tolerance, path = _tolerance(table.lift_tolerance, follower), table.lift.path
    read = read_lift_table(table.lift.text, path, table.columns, table.units, follower, notes)
    unit = "rad" if follower.swings else "m"
    angle, lift = one_turn(path, *read, unit)
    return motion_of_table(notes, path, angle, lift, unit, tolerance)


def _tolerance(text: str | None, follower: Follower) -> float | None:
    """Return the stated noise of a lift [m], of an arm [rad]."""
    if text is None:
        return None
    if follower.swings:
        try:
            return Quantity(ANGLE, "not negative").parse(text)
        except QuantityError as error:
            if error.what != "wrong dimension":
                raise
        return float(Quantity(LENGTH, "not negative").parse(text)) / follower.arm_length
    return Quantity(LENGTH, "not negative").parse(text)


def read_lift_table(
    text: str,
    path: str,
    names: tuple[str, str] | None,
    units: tuple[str, str] | None,
    follower: Follower,
    notes: list[str] | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Return angles [rad] and lifts of a file, in metres or, of an arm, in radians.

    Lengths of an arm are arcs of its roller's path.

    Parameters
    ----------
    text, path : str
        Content of the file, and its name for messages.
    names, units : tuple of str, optional
        Names of the columns, and their units where the file has none.
    follower : Follower
    notes : list of str, optional
        Gets a note of lifts whose unit is probably wrong.

    Raises
    ------
    ScenarioError
        With all mistakes of the file.
    """
    angle, lift = names or ("angle", "lift")
    aliases = {} if names else {angle: ANGLE_NAMES, lift: LIFT_NAMES}
    given = dict(zip((angle, lift), units or (), strict=False))
    heads = units_of_columns(text, {lift: aliases.get(lift, ())})
    length = not follower.swings or has_dimension(given.get(lift) or heads.get(lift), "m")
    columns = read_columns(
        text,
        path,
        {angle: "rad", lift: "m" if length else "rad"},
        aliases=aliases,
        units=given,
        rising=angle,
        either_way=True,
        choice=CHOICE.format("LIFT"),
    )
    lifts, unit = columns[lift], given.get(lift) or heads.get(lift)
    swing = float(np.ptp(lifts))
    if not length and swing > _WIDEST:
        raise mistake_in(
            path,
            f"column '{lift}' is too large for an arm: its unit is probably wrong",
            f"a swing of {math.degrees(swing):.3g} deg",
            "deg as unit, not rad",
        )
    if length:
        found = _checked_lifts(path, lift, unit, lifts, follower)
        if notes is not None:
            notes += found
    if follower.swings and length:
        lifts = lifts / follower.arm_length
    refuse_few(path, len(lifts), FEWEST_ROWS, "rows for a quintic spline")
    return columns[angle], lifts


def _checked_lifts(
    path: str, column: str, unit: str | None, lifts: FloatArray, follower: Follower
) -> list[str]:
    """Return notes of lifts [m] that do not suit the base circle; refuse those of a wrong unit."""
    least, base_radius = float(lifts.min()), follower.base_radius
    greatest = float(np.ptp(lifts))
    refuse_unit(path, column, unit, greatest, base_radius, 0.0)
    note = small_lift(path, column, unit, greatest, base_radius)
    notes = [note] if note else []
    if least > 0.5 * base_radius:
        got = in_engineers_unit(least, "m", 3)
        notes.append(
            f"{path}: column '{column}' is nowhere below {got}: lifts are counted from the base"
            " circle, and radii from the axis belong in a table of the surface, profile"
        )
    return notes


def one_turn(
    path: str, angle: FloatArray, values: FloatArray, unit: str
) -> tuple[FloatArray, FloatArray]:
    """Return a table of lifts in `unit` from its first angle to the same one after a turn [rad]."""
    turn = float(angle[-1] - angle[0])
    noise = estimated_noise(angle[:-1], values[:-1])
    allowed = max(1e-9 * float(np.ptp(values)), _CLOSED * math.sqrt(2.0) * noise)
    closes = abs(values[-1] - values[0]) <= allowed
    off, steps = abs(turn - math.tau), np.diff(angle)
    # a last row at 6.28 or 6.2832 rad repeats the first one, at a rounded angle
    if 1e-9 < off < _ROUNDED * float(steps.min()) and (closes or turn > math.tau):
        angle = np.append(angle[:-1], angle[0] + math.tau)
    elif off > 1e-9:
        if not 0.0 < math.tau - turn < 1.5 * float(steps.max()) + 1e-6:
            what = "the angles do not span a turn"
            if abs(math.degrees(turn) / math.tau - 1.0) < _NEAR:
                what += "; their unit is probably rad, not deg"
            elif abs(math.radians(turn) / math.tau - 1.0) < _NEAR:
                what += "; their unit is probably deg, not rad"
            raise mistake_in(
                path,
                what,
                f"{math.degrees(angle[0]):.6g} to {math.degrees(angle[-1]):.6g} deg",
                "0 to 360 deg",
            )
        return np.append(angle, angle[0] + math.tau), np.append(values, values[0])
    if not closes:
        got = " and ".join(in_engineers_unit(values[k], unit) for k in (0, -1))
        what = "the lift does not close: its first and last value differ"
        raise mistake_in(path, what, got, "equal values at 0 and 360 deg")
    return angle, values


def motion_of_table(
    notes: list[str],
    path: str,
    angle: FloatArray,
    lift: FloatArray,
    unit: str,
    tolerance: float | None,
) -> tuple[Motion, MeasuredPoints | None]:
    """Return the motion of a lift over a closed turn, whose first and last angle are the same."""
    turned = angle - angle[0]
    curve = smoothed_points(turned[:-1], lift[:-1], tolerance)
    closed_lift = np.append(lift[:-1], lift[0])
    around = np.concatenate([angle, angle[1:5] + math.tau])
    closed = np.concatenate([closed_lift, closed_lift[1:5]])
    refuse_kinks(path, around, closed, curve.noise if curve else 0.0)
    if curve is not None:
        motion = motion_of("lift", replace(curve, factor=np.empty((0, 0))), curve.dwells)
        scatter = scatter_through_points(turned[:-1], curve.noise)
        points = turned[:-1], curve.residual
        fitted = curve.noise, tolerance, *points, scatter, curve.second_error, peak(curve)
        return motion, MeasuredPoints(path, "lift", unit, *fitted)
    steps = np.unique(np.round(np.degrees(kinks(around, closed)[1]) % 360.0, 6))
    if len(steps):
        at = ", ".join(f"{place:.6g} deg" for place in steps[:5])
        notes.append(f"{path}: the acceleration of the follower jumps at about {at}")
    return motion_of("lift", LiftSpline(turned, closed_lift, closed=True), ()), None
