"""A run or a study as CSV in engineers' units, the units in the headers."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path, PurePosixPath
from typing import TypeAlias

import numpy as np

from wearsim.errors import ResultsFileError
from wearsim.quantities import engineers_unit
from wearsim.results.data import RunData
from wearsim.results.dissipation_data import DissipationData
from wearsim.results.dissipation_layout import with_inputs
from wearsim.results.dissipation_result import DissipationResult
from wearsim.results.layout import AXES, VARIABLES
from wearsim.results.result import Result
from wearsim.results.writer import write_whole
from wearsim.types import FloatArray

Column: TypeAlias = tuple[str, FloatArray]

# unit a column is written in, and its size in SI
_UNITS = {"m": ("um", 1e-6), "m^3": ("mm^3", 1e-9), "s": ("min", 60.0), "Pa": ("MPa", 1e6)} | {
    "N/m": ("N/mm", 1e3)
}
_LONG = {"y", "width", "half_length"}  # lengths that are written in mm
_DEPTHS = {"cylinder_profile": "depth", "roller_profile": "depth"}
_OTHER_INPUTS = "inputs"  # where input files go that cannot stand where the scenario names them


def export_csv(result: Result | DissipationResult, folder: str | Path) -> list[Path]:
    """Write a run or a study as CSV, and the scenario with the files it names.

    Parameters
    ----------
    result : Result or DissipationResult
        Of a run, its history and its records; of a study, its realisations and its strips.
    folder : str or Path
        Where to; it is made where it does not exist.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    ResultsFileError
        If a file exists already (then none is written), or cannot be written.
    """
    folder = Path(folder)
    tables = _of_run(result.raw) if isinstance(result, Result) else _of_study(result.raw)
    contents = _with_scenario(tables, result.raw)
    texts = {folder / name: text for name, text in contents.items()}
    existing = [str(path) for path in texts if path.exists()]
    if existing:
        raise ResultsFileError(
            f"{', '.join(existing)}: already exists; remove it, or choose another folder with -o"
        )
    for path, text in texts.items():
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ResultsFileError(f"{path.parent}: cannot be made ({error.strerror})") from error
        write_whole(path, text.encode("utf-8", "surrogatepass"))
    return list(texts)


def _of_run(raw: RunData) -> dict[str, str]:
    """Return the tables of a run, by the name of the file each goes into."""
    texts = {
        "history.csv": _csv(_history(raw)),
        "cylinder_profiles.csv": _csv(_records(raw, "cylinder_profile")),
    }
    if raw.records["roller_profile"].any():
        texts["roller_profiles.csv"] = _csv(_records(raw, "roller_profile"))
    texts["line_load.csv"] = _csv(_records(raw, "line_load"))
    texts["dissipation.csv"] = _csv(_records(raw, "dissipation"))
    return texts


def _of_study(raw: DissipationData) -> dict[str, str]:
    """Return the tables of a study, by the name of the file each goes into."""
    return {
        "realisations.csv": _csv(_realisations(raw)),
        "strips.csv": _csv(
            _study_column(raw, name)
            for name, variable in with_inputs(raw.inputs).variables.items()
            if variable.dims == ("y",)
        ),
    }


def _with_scenario(tables: dict[str, str], raw: RunData | DissipationData) -> dict[str, str]:
    """Return the content of every file to write, by its path in the folder."""
    texts = {**tables, "scenario.toml": raw.scenario_text}
    for path, text in raw.files.items():
        texts[_place(path, texts)] = text
    return texts


def _place(path: str, taken: Iterable[str]) -> str:
    """Return where an input file goes: where the scenario names it, but never out of the folder."""
    pure = PurePosixPath(path.replace("\\", "/"))
    inside = not pure.is_absolute() and ".." not in pure.parts and ":" not in path and pure.name
    if inside and str(pure) not in taken:
        return str(pure)
    name = pure.name.replace("..", "_").replace(":", "_") or "file"
    place, number = f"{_OTHER_INPUTS}/{name}", 1
    while place in taken:
        number += 1
        place = f"{_OTHER_INPUTS}/{number}-{name}"
    return place


def _history(raw: RunData) -> Iterator[Column]:
    for name, variable in VARIABLES.items():
        if variable.kind == "history":
            yield from _columns(name, raw.history[name], variable.dims, name)


def _realisations(raw: DissipationData) -> Iterator[Column]:
    """Yield the number of each realisation, what was drawn for it and what came of it."""
    drawn = [item["key"] for item in raw.inputs]
    layout = with_inputs(raw.inputs).variables
    found = [name for name, item in layout.items() if item.dims == ("realisation",)]
    yield "realisation", np.arange(len(raw.variables["power"]), dtype=np.float64)
    for name in [*drawn, *(name for name in found if name not in drawn)]:
        yield _study_column(raw, name)


def _study_column(raw: DissipationData, name: str) -> Column:
    unit = with_inputs(raw.inputs).variables[name].unit
    engineers, size = _UNITS[unit] if unit == "Pa" else engineers_unit(unit)
    title = name if engineers == "1" else f"{name} [{engineers}]"
    return title, raw.variables[name] / size


def _records(raw: RunData, name: str) -> Iterator[Column]:
    """Yield y, and a column for every record and contact."""
    yield from _columns("y", raw.static["y"], ("y",), "y")
    dims = ("y", *VARIABLES[name].dims[1:-1])
    for passes, array in zip(raw.records["record_passes"], raw.records[name], strict=True):
        title = f"{_DEPTHS.get(name, name)} at {passes:.12g} passes"
        yield from _columns(name, np.moveaxis(array, -1, 0), dims, title)


def _columns(name: str, array: FloatArray, dims: Sequence[str], title: str) -> Iterator[Column]:
    """Yield the columns of an array whose first axis is the rows; other axes go into the titles."""
    unit, size = _unit(name)
    for index in np.ndindex(array.shape[1:]):
        labels = [
            f"{dim} {number + AXES[dim].first}"
            for dim, number, length in zip(dims[1:], index, array.shape[1:], strict=True)
            if length > 1
        ]
        yield " ".join([title, *labels, *unit]), array[(slice(None), *index)] / size


def _unit(name: str) -> tuple[list[str], float]:
    unit = VARIABLES[name].unit
    if unit == "1":
        return [], 1.0
    unit, size = ("mm", 1e-3) if name in _LONG else _UNITS.get(unit, (unit, 1.0))
    return [f"[{unit}]"], size


def _csv(columns: Iterable[Column]) -> str:
    titles, values = zip(*columns, strict=True)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(titles)
    # plus zero, so that no -0 is written
    writer.writerows(
        [f"{value + 0.0:.12g}" for value in row] for row in np.column_stack(values).tolist()
    )
    return text.getvalue()
