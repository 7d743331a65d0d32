"""Measured profiles: CSV, and lines of SDF (ISO 25178-71) and X3P (ISO 25178-72) surfaces."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from wearsim.csv_cells import decode
from wearsim.csv_tables import read_columns
from wearsim.errors import ScenarioError, mistake_in, optional_library
from wearsim.quantities import quantity
from wearsim.types import FloatArray, Profile

_SDF = (b"aISO-", b"bISO-", b"aBCR-", b"bBCR-")
_X3P = b"PK\x03\x04"
_HDF5 = b"\x89HDF"
MAX_POINTS = 1_000_000  # of a filtered profile
ROW_CHOICES = ("row", "mean_rows", "at")
_NAMES = (
    "choose other names with --columns Y,Z or, in a scenario, profile_columns"
    ' = ["Y", "Z"] or, in a tests file, columns; a minus sign before Z makes it a depth'
)
_UNITS = (
    "the right units in the header, as in y [mm], height [um], or by --units mm,um or, in a"
    ' scenario, profile_units = ["mm", "um"]'
)
_CLEARLY = 3.0  # heights above the ends of a profile over those below
_ALPHA = math.sqrt(math.log(2.0) / math.pi)


@dataclass(frozen=True)
class ProfileChoice:
    """Choice of one profile from a file that holds more than its columns y and height.

    Parameters
    ----------
    columns : tuple of str, optional
        Names of the columns of position and height in a CSV file; a column "depth" is positive
        downwards, and so is one after a minus sign, "-Tiefe".
    units : tuple of str, optional
        Units of these columns where the header has none, ("mm", "um").
    row : int, optional
        Number of a row of a surface, counted from 0.
    mean_rows : tuple of int, optional
        First row of a mean over rows, and the row after the last.
    at : float, optional
        Position of a row across the rows [m]; the nearest one is taken.
    """

    columns: tuple[str, str] | None = None
    units: tuple[str, str] | None = None
    row: int | None = None
    mean_rows: tuple[int, int] | None = None
    at: float | None = None

    @property
    def rows(self) -> list[str]:
        """Names of the given options that choose rows of a surface."""
        return [name for name in ROW_CHOICES if getattr(self, name) is not None]


def name_of_rows(file: str, rows: Mapping[str, object]) -> str:
    """Return the name of some rows of a surface, "map.x3p#row=3".

    Parameters
    ----------
    file : str
        Name of the file.
    rows : mapping of str to object
        Values by `ROW_CHOICES`, as in a scenario.
    """
    return "#".join([file, *(f"{key}={json.dumps(value)}" for key, value in rows.items())])


def split_name(name: str) -> tuple[str, ProfileChoice]:
    """Return the file and the rows in a name from `name_of_rows`.

    Raises
    ------
    ValueError
        If the value of a row is not of its form.
    """
    file, *parts = name.split("#")
    choice: dict[str, Any] = {}
    for part in parts:
        key, _, text = part.partition("=")
        value = json.loads(text)
        if key == "mean_rows":
            value = tuple(int(row) for row in value)
        choice[key] = quantity(value, "m") if key == "at" else value
    return file, ProfileChoice(**choice)


def load_profile(path: str | Path, choice: ProfileChoice | None = None) -> Profile:
    """Read a measured profile from a file; see `read_profile`.

    Raises
    ------
    ScenarioError
        With all mistakes of the file.
    """
    try:
        return read_profile(Path(path).read_bytes(), str(path), choice)
    except OSError as error:
        raise mistake_in(str(path), f"the file cannot be read ({error.strerror})") from error


def read_profile(content: str | bytes, file: str, choice: ProfileChoice | None = None) -> Profile:
    """Read a measured profile.

    A CSV file has the columns y and height, or y and depth, which is positive downwards; y may
    rise or fall. The rows of a surface run along y, whose zero is the middle of a row; points
    that were not measured are left out.

    Parameters
    ----------
    content : str or bytes
        Content of the file: CSV, SDF or X3P.
    file : str
        Name of the file, for messages.
    choice : ProfileChoice, optional
        Columns and units, or rows of a surface.

    Returns
    -------
    Profile

    Raises
    ------
    ScenarioError
        With all mistakes of the file; if a surface has several rows and none is chosen, with its
        rows and the options that choose.
    """
    choice = choice or ProfileChoice()
    if isinstance(content, bytes):
        if is_surface(content):
            return _chosen_row(_surface(content, file), file, choice)
        if content.startswith(_HDF5):
            raise mistake_in(
                file,
                "this is a results file; wearsim export writes its profiles as CSV, of which"
                " --profile takes one: cylinder_depth_profiles.csv with --columns"
                " 'y,-depth at N passes'",
            )
        content = decode(content)
    if choice.rows:
        raise mistake_in(
            file, f"{choice.rows[0]} is for the rows of a surface, and this is a CSV file"
        )
    y, height = choice.columns or ("y", "height")
    # a column chosen by the name "depth" has the sign of one found by that name
    downwards = choice.columns and (height.startswith("-") or height.casefold() == "depth")
    height = height.removeprefix("-")
    if y == height:
        raise mistake_in(file, "position and height need two columns", y)
    columns = read_columns(
        content,
        file,
        {y: "m", height: "m"},
        aliases={} if choice.columns else {"height": ["z"]},
        opposite={} if choice.columns else {"height": "depth"},
        units=dict(zip((y, height), choice.units or (), strict=False)),
        rising=y,
        either_way=True,
        choice=_NAMES,
    )
    sign = -1.0 if downwards else 1.0
    return _profile_of(columns[y], sign * columns[height], file, (y, height), _UNITS)


def _profile_of(
    y: FloatArray,
    height: FloatArray,
    file: str,
    names: tuple[str, str] = ("y", "height"),
    remedy: str = "the unit that the file states to be right",
) -> Profile:
    """Return the profile of a file; a mistake names the file and the column."""
    try:
        return Profile(y, height)
    except ScenarioError as error:
        columns = dict(zip(("y", "height"), names, strict=True))
        mistakes = [
            replace(item, key=f"column {columns.get(item.key, item.key)}", expected=remedy)
            for item in error.mistakes
        ]
        raise ScenarioError(file, mistakes) from error


def load_lines(path: str | Path) -> list[Profile]:
    """Read all lines of a surface without gaps, or the only profile of another file.

    Parameters
    ----------
    path : path
        CSV, SDF or X3P.

    Returns
    -------
    list of Profile
        Lines of a surface at the same positions; one that was not measured at all of them is left
        out.

    Raises
    ------
    ScenarioError
        With all mistakes of the file.
    """
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise mistake_in(str(path), f"the file cannot be read ({error.strerror})") from error
    if not is_surface(content):
        return [read_profile(content, str(path))]
    surface = _surface(content, str(path))
    whole = np.isfinite(surface.height).all(axis=1)
    if not whole.any():
        raise mistake_in(str(path), "no line was measured at all of its points")
    y = surface.along - 0.5 * (surface.along[0] + surface.along[-1])
    return [_profile_of(y, line, str(path)) for line in surface.height[whole]]


def sign_note(profile: Profile, choice: ProfileChoice, file: str) -> str | None:
    """Return a note if a column chosen by its name seems to hold depths read as heights.

    Parameters
    ----------
    profile : Profile
        As read, with worn material negative.
    choice : ProfileChoice
    file : str
        Name of the file.

    Returns
    -------
    str or None
        None if the sign is known from the name, or the profile does not rise above its ends.
    """
    position, name = choice.columns or ("y", "height")
    if name.startswith("-") or name.casefold() in {"height", "z", "depth"}:
        return None
    level = 0.5 * float(profile.height[0] + profile.height[-1])
    above, below = float(profile.height.max()) - level, level - float(profile.height.min())
    if above <= _CLEARLY * below:
        return None
    return (
        f"{file}: column '{name}' rises {1e6 * above:.4g} um above its ends, and worn material is"
        f" negative; if it holds depths, choose the columns {position} and -{name}"
    )


def is_surface(content: bytes) -> bool:
    """Return whether the content of a file is a surface in SDF or X3P."""
    return content.startswith((*_SDF, _X3P))


class _Surface(NamedTuple):
    """Heights on a grid [m], shape (rows, points); positions along and across the rows [m]."""

    along: FloatArray
    across: FloatArray
    height: FloatArray


def _surface(content: bytes, file: str) -> _Surface:
    """Return the heights in an SDF or X3P file; NaN where the surface was not measured."""
    name = "SDF" if content.startswith(_SDF) else "X3P"
    missing = mistake_in(
        file, f"{name} files need another package: pip install 'wearsim[surfaces]'"
    )
    reader = optional_library("sdfio" if name == "SDF" else "x3pio", missing)
    try:
        surface = reader.read(io.BytesIO(content))
        if name == "SDF":
            return _Surface(surface.x_axis, surface.y_axis, surface.data)
        (layer,) = surface.layers
        across = getattr(layer, "y_values", np.zeros(1))
        return _Surface(layer.x_values, across, np.atleast_2d(layer.z))
    except Exception as error:  # of any kind that the reader raises for a damaged file
        raise mistake_in(file, f"is no {name} file of one surface or profile: {error}") from error


def _chosen_row(surface: _Surface, file: str, choice: ProfileChoice) -> Profile:
    """Return one row of a surface, or the mean of several."""
    if choice.columns or choice.units:
        raise mistake_in(file, "columns and units are for CSV files; a surface has its own units")
    count, across = len(surface.height), surface.across
    rows = f"{count} rows, {1e3 * across[0]:.6g} to {1e3 * across[-1]:.6g} mm"
    if count > 1 and len(choice.rows) != 1:
        raise mistake_in(
            file,
            "has several rows" if not choice.rows else f"{' and '.join(choice.rows)} are given",
            rows,
            "one of --row 0, --mean-rows 0:10 or --at '1 mm'; in a scenario, profile_row,"
            " profile_mean_rows or profile_at",
        )
    row = choice.row or 0
    if choice.at is not None:
        row = int(np.abs(across - choice.at).argmin())
        half = 0.5 * float(np.diff(across).max()) if count > 1 else 0.0
        if not across[0] - half <= choice.at <= across[-1] + half:
            raise mistake_in(file, "at is not on the surface", f"{1e3 * choice.at:.6g} mm", rows)
    first, stop = choice.mean_rows or (row, row + 1)
    if not 0 <= first < stop <= count:
        raise mistake_in(
            file, "there are no such rows", f"{first} to {stop - 1}", f"0 to {count - 1}"
        )
    chosen = surface.height[first:stop]
    known = np.isfinite(chosen)
    measured = known.any(axis=0)
    if np.count_nonzero(measured) < 2:
        raise mistake_in(
            file, "fewer than two points of the rows were measured", f"rows {first} to {stop - 1}"
        )
    total = np.where(known, chosen, 0.0).sum(axis=0)[measured]
    y = surface.along - 0.5 * (surface.along[0] + surface.along[-1])
    return _profile_of(y[measured], total / known.sum(axis=0)[measured], file)


def gaussian_filtered(profile: Profile, cutoff: float) -> Profile:
    """Return a profile without roughness, by the Gaussian filter of ISO 16610-21.

    A wave as long as the cutoff keeps half of its amplitude. Near the ends, where the weights of
    the filter are cut off, a straight line is fitted with these weights (ISO 16610-28), so that
    slopes are kept up to the ends.

    Parameters
    ----------
    profile : Profile
        Any spacing of points; it is interpolated to a uniform spacing.
    cutoff : float
        Cutoff wavelength [m].

    Returns
    -------
    Profile
        At equally spaced points, at most as far apart as in the input.

    Raises
    ------
    ValueError
        If the cutoff is not positive, exceeds the length of the profile or is less than twice the
        distance of its points.
    """
    length = float(profile.y[-1] - profile.y[0])
    if not 0.0 < cutoff <= length:
        raise ValueError(
            f"the cutoff of {1e3 * cutoff:.4g} mm must be positive and at most the length of the"
            f" profile, {1e3 * length:.4g} mm"
        )
    count = min(math.ceil(length / float(np.diff(profile.y).min()) - 1e-6), MAX_POINTS) + 1
    y = np.linspace(profile.y[0], profile.y[-1], count)
    height = np.interp(y, profile.y, profile.height)
    spacing = length / (count - 1)
    if spacing > 0.5 * cutoff:
        raise ValueError(
            f"the cutoff of {1e3 * cutoff:.4g} mm must be at least twice the distance of points,"
            f" {1e3 * spacing:.4g} mm"
        )
    reach = math.ceil(cutoff / spacing)  # weights beyond are below 1e-6
    distance = spacing * np.arange(-reach, reach + 1) / (_ALPHA * cutoff)
    weight, size = np.exp(-np.pi * distance**2), count + 2 * reach

    def weighted(values: FloatArray, power: int) -> FloatArray:
        # the sum over points k of weight(y_k - y) (y_k - y)^power values_k
        kernel = (weight * distance**power)[::-1]
        product = np.fft.rfft(values, size) * np.fft.rfft(kernel, size)
        return np.fft.irfft(product, size)[reach : reach + count]

    s0, s1, s2 = (weighted(np.ones(count), power) for power in range(3))
    t0, t1 = weighted(height, 0), weighted(height, 1)
    return Profile(y, (s2 * t0 - s1 * t1) / (s0 * s2 - s1 * s1))
