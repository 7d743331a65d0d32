"""Worn profiles of a test as the start profiles of another one: numerical running-in."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from wearsim.errors import ResultsFileError
from wearsim.report.csv_files import path_in_folder, write_files
from wearsim.scenario import Scenario
from wearsim.scenario.parse.overrides import apply_overrides, flat
from wearsim.scenario.parse.toml import parse_toml
from wearsim.studies.run.assemble import merged_rollers, start_height
from wearsim.studies.run.continuation import stored_scenario
from wearsim.studies.run.draws import draw
from wearsim.studies.run.result import Result, RunData
from wearsim.studies.start.heights import roller_profile
from wearsim.types import FloatArray, Grid, Profile

_OF_PROFILES = ("columns", "units", "row", "mean_rows", "at", "filter")


class RunningIn(NamedTuple):
    """Files of a scenario that starts from worn profiles, with what its user should know.

    Parameters
    ----------
    paths : list of Path
        The written files, the scenario first.
    notes : list of str
    """

    paths: list[Path]
    notes: list[str]


def export_running_in(result: Result, folder: str | Path, *, force: bool = False) -> RunningIn:
    """Write the worn profiles of a run as CSV, and a scenario that starts from them.

    The scenario is that of the run, of the same length, with the start profiles of cylinder or cam
    and rollers at the last record. A depth of the new test counts from these profiles.

    Parameters
    ----------
    result : Result
        Of one wear test.
    folder : str or Path
        Target folder, which is created if it does not exist.
    force : bool
        Overwrite existing files.

    Returns
    -------
    RunningIn

    Raises
    ------
    ResultsFileError
        If the result is not that of one wear test, the folder cannot be written, or one of the
        files exists and `force` is false; then no file is written.

    Examples
    --------
    >>> result = wearsim.run("rig.toml")
    >>> files = wearsim.export_running_in(result, "worn")
    >>> [path.name for path in files.paths]
    ['rig-worn.toml', 'cylinder-worn.csv']
    >>> worn = wearsim.load_scenario(files.paths[0]).cylinder.profile
    >>> print(f"{worn.height.min() * 1e6:.1f} um")
    -48.1 um
    """
    if not isinstance(result, Result):
        raise ResultsFileError(
            "worn profiles are those of one wear test, from `wearsim run`, not of a"
            f" {type(result).__name__}"
        )
    data = result.raw
    scenario = stored_scenario(data)
    body, key, text_of = "cylinder", "cylinder.profile", _cylinder_text
    if scenario.cam is not None:
        body, key, text_of = "cam", "cam.start_profile", _surface_text
    contents = {f"{body}-worn.csv": text_of(scenario, data)}
    overrides: dict[str, object] = {"title": f"{scenario.title}, worn", key: f"{body}-worn.csv"}
    profiles = _rollers(scenario, data)
    names = [f"roller-{number}-worn.csv" for number in range(1, len(profiles) + 1)]
    if len({profile.height.tobytes() for profile in profiles}) == 1:
        profiles, names = profiles[:1], ["roller-worn.csv"]
    if any(profile.height.any() for profile in profiles):
        contents |= dict(zip(names, map(_profile_text, profiles), strict=True))
        overrides["roller.profile"] = names if len(names) > 1 else names[0]
    keys = _keys_of_texts(data.scenario_text)
    for name, content in data.files.items():
        key = keys.get(name, "")
        if key in overrides or key not in {*keys.values()}:
            continue  # a start profile of the run, which is replaced
        copied = path_in_folder(name, contents)
        contents[copied] = content
        if copied != name:
            overrides[key] = copied
    text = apply_overrides(
        data.scenario_text,
        data.scenario_file,
        overrides,
        [f"cylinder.profile_{key}" for key in _OF_PROFILES],
    )
    files = {f"{Path(data.scenario_file).stem}-worn.toml": text, **contents}
    pieces = {name: [content] for name, content in files.items()}
    return RunningIn(write_files(Path(folder), pieces, force=force), _notes(scenario, data))


def _keys_of_texts(text: str) -> dict[str, str]:
    """Return the dotted keys of the texts in a scenario, by text."""
    keys: dict[str, str] = {}
    for key, value in flat(parse_toml(text, "scenario")):
        for item in value if isinstance(value, list) else [value]:
            inner = item.values() if isinstance(item, dict) else [item]
            keys |= {name: key for name in inner if isinstance(name, str)}
    return keys


def _grid(data: RunData) -> Grid:
    return Grid(data.static["y"], float(data.checkpoint["spacing"]))


def _joined(y: FloatArray, height: FloatArray, earlier: Profile | None) -> Profile:
    """Return a profile on strips, with an earlier profile where it reaches beyond them."""
    if earlier is None:
        return Profile(y, height)
    before, after = earlier.y < y[0], earlier.y > y[-1]
    return Profile(
        np.concatenate([earlier.y[before], y, earlier.y[after]]),
        np.concatenate([earlier.height[before], height, earlier.height[after]]),
    )


def _cylinder_text(scenario: Scenario, data: RunData) -> str:
    """Return the worn profile of the cylinder as CSV."""
    grid = _grid(data)
    height = start_height(scenario, grid) - data.records["cylinder_depth_profile"][-1, 0, 0]
    return _profile_text(_joined(grid.y, height, scenario.cylinder.profile))


def _rollers(scenario: Scenario, data: RunData) -> list[Profile]:
    """Return the worn profiles of all rollers, from their apexes."""
    draws, count = draw(scenario), scenario.operation.rollers
    groups, _ = merged_rollers(draws)
    drawn = {name: values[:, None] for name, values in draws.rollers.items()}
    offsets, settings = draws.inputs_of(range(count), drawn)["offset"], draws.kinds
    y, worn = data.static["y"], data.records["roller_depth_profile"][-1, :, 0]
    profiles = []
    for number in range(count):
        same = [k for k, first in enumerate(groups) if settings[first] == settings[number]]
        place = groups.index(number) if number in groups else same[0]
        s, earlier = y - offsets[number, 0], roller_profile(scenario, number)
        start = 0.0 if earlier is None else np.interp(s, earlier.y, earlier.height)
        profiles.append(_joined(s, start - worn[place], earlier))
    return profiles


def _profile_text(profile: Profile) -> str:
    """Return a profile as CSV, with all digits."""
    rows = zip((1e3 * profile.y).tolist(), (1e6 * profile.height).tolist(), strict=True)
    return "".join(["y [mm],height [um]\n", *(f"{y!r},{z + 0.0!r}\n" for y, z in rows)])


def _surface_text(scenario: Scenario, data: RunData) -> str:
    """Return the worn surface of a cam as CSV, with all digits."""
    grid, angle = _grid(data), np.ravel(data.static["station_angle"])
    height = start_height(scenario, grid, angle) - data.records["cylinder_depth_profile"][-1, :, 0]
    y = (1e3 * grid.y).tolist()
    rows = (
        f"{math.degrees(place)!r},{at!r},{z + 0.0!r}\n"
        for place, row in zip(angle.tolist(), (1e6 * height).tolist(), strict=True)
        for at, z in zip(y, row, strict=True)
    )
    return "".join(["angle [deg],y [mm],height [um]\n", *rows])


def _notes(scenario: Scenario, data: RunData) -> list[str]:
    """Return the differences between the new test and a continuation of the old one."""
    load, passes = scenario.load.built, float(data.records["record_passes"][-1])
    has_feedback = load.stiffness or getattr(load, "feedback", "none") != "none"
    notes = (
        (
            passes < data.total_passes,
            f"the profiles are those after {passes:.0f} of {data.total_passes:.0f} passes",
        ),
        (
            has_feedback,
            (
                "the load of the new scenario is that of the old one at its start: it falls with"
                " the wear of the new test alone"
            ),
        ),
        (not load.constant or scenario.load.terms, "the load begins again at time 0"),
        (
            any(item.role == "process" for item in scenario.random),
            "random processes begin again at time 0",
        ),
    )
    return [text for applies, text in notes if applies]
