"""Start profiles of rollers and start surfaces of cams, measured or worn by an earlier test."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from wearsim.csv_tables import column_names, read_columns
from wearsim.errors import ScenarioError, mistake_in
from wearsim.profiles import read_profile
from wearsim.quantities import InputFile
from wearsim.scenario.parse.mistakes import Mistakes
from wearsim.types import FloatArray, Profile

_SAME_ANGLE = 1e-9  # rad
_SIDES: tuple[Literal["left", "right"], ...] = ("left", "right")


@dataclass(frozen=True, eq=False)
class StartSurface:
    """Height of a cam's surface above its nominal shape at the start of a test.

    Parameters
    ----------
    angle : ndarray, shape (angles,)
        Angles of the cam in their order, within a turn; one that is given twice has the heights
        before and after it, where they jump [rad].
    y : ndarray, shape (points,)
        Increasing axial positions [m].
    height : ndarray, shape (angles, points)
        Heights, negative where the cam is worn [m].
    """

    angle: FloatArray
    y: FloatArray
    height: FloatArray

    @property
    def varies(self) -> bool:
        """Whether there are heights at several angles."""
        return len(self.angle) > 1

    def at(self, angle: FloatArray, y: FloatArray) -> FloatArray:
        """Return the heights at angles and positions, by linear interpolation of the surface.

        Parameters
        ----------
        angle : ndarray, shape (stations,)
            [rad].
        y : ndarray, shape (strips,)
            [m].

        Returns
        -------
        ndarray, shape (stations, strips)
            Beyond the outer positions the heights there [m].
        """
        rows = np.array([np.interp(y, self.y, row) for row in self.height])
        if not self.varies:
            return np.repeat(rows, len(angle), axis=0)
        # one turn on both sides closes the surface
        known = np.concatenate(
            [[self.angle[-1] - math.tau], self.angle, [self.angle[0] + math.tau]]
        )
        rows = np.concatenate([rows[-1:], rows, rows[:1]])
        theta = np.where((angle >= 0.0) & (angle <= math.tau), angle, np.mod(angle, math.tau))
        nearest = known[np.abs(known - theta[:, None]).argmin(axis=1)]
        theta = np.where(np.abs(nearest - theta) < _SAME_ANGLE, nearest, theta)
        # of two stations at one angle the first is before it, as is the end of the turn
        before = np.append(np.diff(theta) == 0.0, False) | (theta == math.tau)
        at_left, at_right = (np.searchsorted(known, theta, side=side) for side in _SIDES)
        given = at_right > at_left
        low = np.where(given, np.where(before, at_left, at_right - 1), at_right - 1)
        high = np.where(given, low, at_right)
        span = np.where(given, 1.0, known[high] - known[low])
        part = np.where(given, 0.0, (theta - known[low]) / span)[:, None]
        return np.asarray((1.0 - part) * rows[low] + part * rows[high])


def read_roller_profiles(
    mistakes: Mistakes, files: InputFile | tuple[InputFile, ...] | None
) -> tuple[Profile, ...]:
    """Return the start profiles of rollers; of files with mistakes, which are added, none."""
    profiles = []
    for file in () if files is None else files if isinstance(files, tuple) else (files,):
        try:
            profiles.append(read_profile(file.text, file.path))
        except ScenarioError as error:
            mistakes.add_file(error, "roller", "profile")
    return tuple(profiles)


def read_start_surface(mistakes: Mistakes, file: InputFile | None) -> StartSurface | None:
    """Return the start surface of a cam; None without a file, or after adding its mistakes."""
    if file is None:
        return None
    try:
        if "angle" not in {name.casefold() for name in column_names(file.text)}:
            profile = read_profile(file.text, file.path)
            return StartSurface(np.zeros(1), profile.y, profile.height[None])
        return _surface(file)
    except ScenarioError as error:
        mistakes.add_file(error, "cam", "start_profile")
    return None


def _surface(file: InputFile) -> StartSurface:
    """Return the surface in a file with a column of angles."""
    columns = read_columns(
        file.text,
        file.path,
        {"angle": "rad", "y": "m", "height": "m"},
        aliases={"height": ["z"]},
        opposite={"height": "depth"},
    )
    angle, y, height = (columns[name] for name in ("angle", "y", "height"))
    angle = np.where(np.abs(angle - math.tau) < _SAME_ANGLE, math.tau, angle)
    turned = np.abs(np.diff(angle)) > _SAME_ANGLE
    first = np.flatnonzero(np.concatenate([[True], turned | (np.diff(y) <= 0.0)]))
    angles, count = angle[first], int(np.diff(np.append(first, len(y))).max())
    whole = len(y) == count * len(first)
    grid = y.reshape(-1, count) if whole else np.zeros((0, count))
    if not whole or count < 2 or (grid != grid[0]).any():
        raise mistake_in(
            file.path,
            "needs the same positions y, at least two and increasing, at every angle",
            f"{len(y)} rows, {len(angles)} angles",
            key="column y",
        )
    turns = np.diff(angles)
    thrice = (np.abs(turns[1:]) + np.abs(turns[:-1]) < _SAME_ANGLE).any()
    if angles[0] < 0.0 or angles[-1] > math.tau or (turns < -_SAME_ANGLE).any() or thrice:
        raise mistake_in(
            file.path,
            "must not fall from row to row, be within 0 to 360 deg and at most twice the same",
            f"{math.degrees(angles.min()):.6g} to {math.degrees(angles.max()):.6g} deg",
            key="column angle",
        )
    return StartSurface(angles, grid[0], height.reshape(grid.shape))
