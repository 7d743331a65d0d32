"""Start profiles of rollers and start surfaces of cams, measured or worn by an earlier test."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from wearsim.csv_tables import column_names, read_columns
from wearsim.errors import Mistake, ScenarioError
from wearsim.profiles import read_profile
from wearsim.quantities import InputFile
from wearsim.scenario.parse.mistakes import Mistakes
from wearsim.types import FloatArray, Profile

_SAME_ANGLE = 1e-9  # rad


@dataclass(frozen=True, eq=False)
class StartSurface:
    """Height of a cam's surface above its nominal shape at the start of a test.

    Parameters
    ----------
    angle : ndarray, shape (angles,)
        Increasing angles of the cam, within a turn [rad].
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
        """Whether the heights are those of several angles."""
        return len(self.angle) > 1

    def at(self, angle: FloatArray, y: FloatArray) -> FloatArray:
        """Return the heights at angles and positions, linear between those of the surface.

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
        columns = [np.interp(angle, self.angle, column, period=math.tau) for column in rows.T]
        return np.array(columns).T


def read_roller_profiles(
    mistakes: Mistakes, files: InputFile | tuple[InputFile, ...] | None
) -> tuple[Profile, ...]:
    """Return the start profiles of rollers; of files with mistakes, which are added, none."""
    found = []
    for file in () if files is None else files if isinstance(files, tuple) else (files,):
        try:
            found.append(read_profile(file.text, file.path))
        except ScenarioError as error:
            mistakes.add_file(error, "roller", "profile")
    return tuple(found)


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
    order = np.lexsort((columns["y"], columns["angle"]))
    angle, y, height = (columns[name][order] for name in ("angle", "y", "height"))
    first = np.concatenate([[True], np.diff(angle) > _SAME_ANGLE])
    angles, count = angle[first], int(np.argmax([*first[1:], True])) + 1
    grid = y.reshape(-1, count) if len(y) == count * len(angles) else None
    if grid is None or count < 2 or not np.array_equal(grid, np.broadcast_to(grid[0], grid.shape)):
        what = "needs the same positions y, at least two, at every angle"
        got = f"{len(y)} rows, {len(angles)} angles"
        raise ScenarioError(file.path, [Mistake("", "column y", what, got)])
    if (np.diff(grid[0]) <= 0.0).any():
        raise ScenarioError(file.path, [Mistake("", "column y", "has a position twice")])
    if angles[0] < 0.0 or angles[-1] >= math.tau:
        got = f"{math.degrees(angles[0]):.6g} to {math.degrees(angles[-1]):.6g} deg"
        what = "must be at least 0 and below 360 deg"
        raise ScenarioError(file.path, [Mistake("", "column angle", what, got)])
    return StartSurface(angles, grid[0], height.reshape(grid.shape))
