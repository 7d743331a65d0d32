"""A run, a study or an ensemble as CSV in engineers' units, the units in the headers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path, PurePosixPath

import numpy as np

from wearsim.errors import ResultsFileError
from wearsim.results.content import StudyData
from wearsim.results.csv_text import Column, table, title, unit_of, unit_of_drawn
from wearsim.results.data import RunData
from wearsim.results.dissipation_data import DissipationData
from wearsim.results.dissipation_layout import with_inputs
from wearsim.results.dissipation_result import DissipationResult
from wearsim.results.ensemble_export import ensemble_tables
from wearsim.results.ensemble_result import EnsembleResult
from wearsim.results.layout import AXES, VARIABLES
from wearsim.results.result import Result
from wearsim.results.writer import write_pieces
from wearsim.types import FloatArray

_DEPTHS = {"cylinder_profile": "depth", "roller_profile": "depth"}
_OTHER_INPUTS = "inputs"  # where input files go that cannot stand where the scenario names them


def export_csv(
    result: Result | DissipationResult | EnsembleResult, folder: str | Path
) -> list[Path]:
    """Write a run, a study or an ensemble as CSV, and the scenario with the files it names.

    Parameters
    ----------
    result : Result, DissipationResult or EnsembleResult
        Of a run, its history and its records; of a study, its realisations and its strips; of an
        ensemble, its realisations, the courses of its tests and the profile at their end.
    folder : str or Path
        Where to; it is made where it does not exist.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    ResultsFileError
        If the folder is a file, or a file exists already (then none is written), or cannot be
        written.
    """
    folder = Path(folder)
    if folder.exists() and not folder.is_dir():
        raise ResultsFileError(
            f"{folder}: is a file; tables go into a folder, name one with -o, which is made where"
            " there is none"
        )
    contents = _with_scenario(_tables(result), result.raw)
    pieces = {folder / name: content for name, content in contents.items()}
    existing = [str(path) for path in pieces if path.exists()]
    if existing:
        raise ResultsFileError(
            f"{', '.join(existing)}: already exists; remove it, or choose another folder with -o"
        )
    for path, content in pieces.items():
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ResultsFileError(f"{path.parent}: cannot be made ({error.strerror})") from error
        write_pieces(path, _placed(content))
    return list(pieces)


def _tables(result: Result | DissipationResult | EnsembleResult) -> dict[str, Iterable[str]]:
    """Return the tables of a result in pieces, by the name of the file each goes into."""
    if isinstance(result, EnsembleResult):
        return dict(ensemble_tables(result))
    texts = _of_run(result.raw) if isinstance(result, Result) else _of_study(result.raw)
    return {name: [text] for name, text in texts.items()}


def _placed(content: Iterable[str]) -> Iterator[tuple[int, bytes]]:
    """Yield pieces of a text, each with the number of bytes that stand before it."""
    before = 0
    for piece in content:
        data = piece.encode("utf-8", "surrogatepass")
        yield before, data
        before += len(data)


def _of_run(raw: RunData) -> dict[str, str]:
    """Return the tables of a run, by the name of the file each goes into."""
    texts = {
        "history.csv": table(_history(raw)),
        "cylinder_profiles.csv": table(_records(raw, "cylinder_profile")),
    }
    if raw.records["roller_profile"].any():
        texts["roller_profiles.csv"] = table(_records(raw, "roller_profile"))
    texts["line_load.csv"] = table(_records(raw, "line_load"))
    texts["dissipation.csv"] = table(_records(raw, "dissipation"))
    return texts


def _of_study(raw: DissipationData) -> dict[str, str]:
    """Return the tables of a study, by the name of the file each goes into."""
    return {
        "realisations.csv": table(_realisations(raw)),
        "strips.csv": table(
            _study_column(raw, name)
            for name, variable in with_inputs(raw.inputs).variables.items()
            if variable.dims == ("y",)
        ),
    }


def _with_scenario(tables: dict[str, Iterable[str]], raw: StudyData) -> dict[str, Iterable[str]]:
    """Return the content of every file to write, by its path in the folder."""
    texts = {**tables, "scenario.toml": [raw.scenario_text]}
    for path, text in raw.files.items():
        texts[_place(path, texts)] = [text]
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
    unit, size = unit_of_drawn(with_inputs(raw.inputs).variables[name].unit)
    return title(name, unit), raw.variables[name] / size


def _records(raw: RunData, name: str) -> Iterator[Column]:
    """Yield y, and a column for every record and contact."""
    yield from _columns("y", raw.static["y"], ("y",), "y")
    dims = ("y", *VARIABLES[name].dims[1:-1])
    for passes, array in zip(raw.records["record_passes"], raw.records[name], strict=True):
        told = f"{_DEPTHS.get(name, name)} at {passes:.12g} passes"
        yield from _columns(name, np.moveaxis(array, -1, 0), dims, told)


def _columns(name: str, array: FloatArray, dims: Sequence[str], told: str) -> Iterator[Column]:
    """Yield the columns of an array whose first axis is the rows; other axes go into the titles."""
    unit, size = unit_of(name, VARIABLES[name].unit)
    for index in np.ndindex(array.shape[1:]):
        labels = [
            f"{dim} {number + AXES[dim].first}"
            for dim, number, length in zip(dims[1:], index, array.shape[1:], strict=True)
            if length > 1
        ]
        yield title(" ".join([told, *labels]), unit), array[(slice(None), *index)] / size
