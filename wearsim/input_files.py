"""Text of the files that a scenario names: CSV in any usual encoding; TDMS, SDF and X3P as CSV.

Results files keep this text, so that a run can be repeated without the original files.
"""

from __future__ import annotations

import io
from functools import partial
from pathlib import Path
from typing import Any

from wearsim.csv_cells import decode
from wearsim.errors import mistake_in, optional_library
from wearsim.profiles import ProfileChoice, is_surface, read_profile
from wearsim.types import Profile
from wearsim.units import QuantityError, conversion

_TDMS = b"TDSm"


def read_input(path: Path, choice: ProfileChoice | None = None) -> str:
    """Return the text of an input file.

    Parameters
    ----------
    path : Path
        A CSV file; a log in TDMS, whose channels "time" and "load" become columns; or a surface in
        SDF or X3P, of which one profile becomes the columns y and height.
    choice : ProfileChoice, optional
        Rows of a surface.

    Returns
    -------
    str
        CSV.

    Raises
    ------
    OSError
        If the file cannot be read.
    ScenarioError
        If its content cannot be read, or a surface has several rows and none is chosen.
    """
    content = path.read_bytes()
    if content.startswith(_TDMS):
        return _log_of_tdms(content, path.name)
    if not is_surface(content):
        return decode(content)
    return csv_of_profile(read_profile(content, path.name, choice))


def csv_of_profile(profile: Profile) -> str:
    """Return a profile as CSV, from which it is read again bit for bit."""
    return _as_csv("y [m],height [m]", profile.y, profile.height)


def _as_csv(header: str, *columns: Any) -> str:
    rows = (",".join(map(repr, row)) for row in zip(*(c.tolist() for c in columns), strict=True))
    return "\n".join([header, *rows, ""])


def _log_of_tdms(content: bytes, file: str) -> str:
    """Return the log of a LabVIEW file as CSV.

    The time is taken from a channel "time", or from the waveform properties of the channel "load".
    """
    error = partial(mistake_in, file)
    missing = error("TDMS files need another package: pip install 'wearsim[tdms]'")
    reader = optional_library("nptdms", missing).TdmsFile
    try:
        groups = reader.read(io.BytesIO(content)).groups()
        channels = [channel for group in groups for channel in group.channels()]
    except Exception as failure:  # of any kind that the reader raises for a damaged file
        raise error(f"is no TDMS file: {failure}") from failure
    names = ", ".join(channel.name for channel in channels) or "none"
    times, loads = (
        [channel for channel in channels if channel.name.casefold() == name]
        for name in ("time", "load")
    )
    for name, is_wrong in {"time": len(times) > 1, "load": len(loads) != 1}.items():
        if is_wrong:
            raise error(f"the channel '{name}' is needed once", names, f"one channel '{name}'")
    (load,) = loads
    force = load[:] * _factor(load, "N", error)
    if times:
        time = times[0][:] * _factor(times[0], "s", error)
    elif "wf_increment" in load.properties:
        time = load.time_track()
    else:
        raise error("has no time", names, "a channel 'time', or wf_increment of the channel 'load'")
    if len(time) != len(force):
        raise error("time and load differ in length", f"{len(time)} and {len(force)} values")
    return _as_csv("time [s],load [N]", time, force)


def _factor(channel: Any, unit: str, error: Any) -> float:
    """Return the factor from the unit of a channel, its property unit_string, to a unit."""
    written = channel.properties.get("unit_string", "")
    try:
        return float(conversion(written, unit))
    except QuantityError as failure:
        what = f"channel '{channel.name}': {failure.what}"
        raise error(what, failure.got or repr(written), failure.expected) from failure
