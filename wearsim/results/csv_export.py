"""Tables as CSV in engineers' units, the units in the headers."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from wearsim.errors import ResultsFileError
from wearsim.results.content import StudyData
from wearsim.results.dissipation.data import DissipationData
from wearsim.results.dissipation.result import DissipationResult
from wearsim.results.dissipation.schema import with_inputs
from wearsim.results.ensemble.data import EnsembleData
from wearsim.results.ensemble.result import EnsembleResult
from wearsim.results.ensemble.schema import FAILED, OBSERVABLES, PENDING
from wearsim.results.io.atomic_write import write_pieces
from wearsim.results.run.data import RunData
from wearsim.results.run.result import Result
from wearsim.results.run.schema import AXES, VARIABLES
from wearsim.types import FloatArray
from wearsim.units import engineers_unit

Column: TypeAlias = tuple[str, FloatArray]

# unit a column is written in, and its size in SI
_UNITS = {"m": ("um", 1e-6), "m^3": ("mm^3", 1e-9), "s": ("min", 60.0), "Pa": ("MPa", 1e6)} | {
    "N/m": ("N/mm", 1e3)
}

_LONG = {"y", "width", "half_length"}  # lengths that are written in mm


def unit_of(name: str, unit: str) -> tuple[str, float]:
    """Return the unit in which a computed variable is written, and its size in SI.

    Parameters
    ----------
    name : str
        Of the variable.
    unit : str
        Its SI unit.
    """
    return ("mm", 1e-3) if name in _LONG else _UNITS.get(unit, (unit, 1.0))


def unit_of_drawn(unit: str) -> tuple[str, float]:
    """Return the unit in which a drawn value is written, and its size in SI; see `unit_of`."""
    return _UNITS[unit] if unit == "Pa" else engineers_unit(unit)


def title(name: str, unit: str) -> str:
    """Return the head of a column; plain numbers have no unit."""
    return name if unit == "1" else f"{name} [{unit}]"


def table(columns: Iterable[Column]) -> str:
    """Return a table from its columns, the head first."""
    titles, values = zip(*columns, strict=True)
    return head(titles) + rows(np.column_stack(values))


def head(titles: Sequence[str]) -> str:
    """Return the first line of a table."""
    return _lines([titles])


def rows(numbers: npt.NDArray[Any]) -> str:
    """Return rows of a table, shape (rows, columns)."""
    # plus zero, so that no -0 is written
    return _lines([f"{value + 0.0:.12g}" for value in row] for row in numbers.tolist())


def _lines(cells: Iterable[Sequence[str]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(cells)
    return text.getvalue()


def text_table(titles: Sequence[str], cells: Iterable[Sequence[str]]) -> str:
    """Return a table of texts."""
    return _lines([titles, *cells])


_BLOCK = 16384  # realisations in memory at a time

_OF_EACH = ("steps", "solves", "depth_error", "volume_error", "control")


def ensemble_tables(result: EnsembleResult) -> Mapping[str, Iterator[str]]:
    """Return the tables of an ensemble in pieces, by the name of the file each goes into.

    Parameters
    ----------
    result : EnsembleResult

    Returns
    -------
    mapping of str to iterator of str
    """
    tables = {"realisations.csv": _ensemble_realisations(result.raw)}
    if result.count:
        tables["courses.csv"] = iter([table(_courses(result))])
        tables["profile.csv"] = iter([table(_profile(result))])
    if result.failed:
        cells = [(str(number), text) for number, text in result.errors.items()]
        tables["failures.csv"] = iter([text_table(("realisation", "error"), cells)])
    return tables


def _ensemble_realisations(raw: EnsembleData) -> Iterator[str]:
    """Yield what was drawn for each realisation and what came of it, those that failed with nan."""
    for start in range(0, raw.asked, _BLOCK):
        stop = min(start + _BLOCK, raw.asked)
        titles, values = zip(*_block(raw, start, stop), strict=True)
        if start == 0:
            yield head(titles)
        yield rows(np.column_stack(values)[raw.status[start:stop] != PENDING])


def _block(raw: EnsembleData, start: int, stop: int) -> Iterator[Column]:
    failed = raw.status[start:stop] == FAILED
    yield "realisation", np.arange(start, stop, dtype=np.float64)
    yield "failed", failed.astype(np.float64)
    for item in raw.inputs:
        values = raw.rows(item["key"], start, stop)
        unit, size = unit_of_drawn(item["unit"])
        for name, column in _per_roller(item["key"], values):
            yield title(name, unit), column / size
    for name, variable in OBSERVABLES.items():
        unit, size = unit_of(name, variable.unit)
        yield (
            title(name, unit),
            _of_good(raw.rows(name, start, stop)[:, -1] / size, failed),
        )
    for name in _OF_EACH:
        if name in raw.layout.variables:
            unit, size = unit_of(name, raw.layout.variables[name].unit)
            yield title(name, unit), _of_good(raw.rows(name, start, stop) / size, failed)


def _of_good(values: FloatArray, failed: FloatArray) -> FloatArray:
    return np.where(failed, np.nan, values)


def _per_roller(name: str, values: FloatArray) -> Iterator[Column]:
    if values.ndim == 1:
        yield name, values
        return
    for roller in range(values.shape[1]):
        yield f"{name} roller {roller + 1}", values[:, roller]


def _courses(result: EnsembleResult) -> Iterator[Column]:
    """Yield what the realisations tell of each observable at every record."""
    yield "passes", result.record_passes
    yield "time [min]", result.record_time / 60.0
    for name, variable in OBSERVABLES.items():
        unit, size = unit_of(name, variable.unit)
        course = result.course(name)
        columns = {
            "mean": course.mean,
            "mean low": course.mean_low,
            "mean high": course.mean_high,
            "std": course.std,
            **{f"{100.0 * p:g} %": values for p, values in course.quantiles.items()},
        }
        for ending, values in columns.items():
            yield title(f"{name} {ending}", unit), values / size


def _profile(result: EnsembleResult) -> Iterator[Column]:
    """Yield mean and band of the worn depth at the end over the strips."""
    band = result.band()
    yield "y [mm]", band.y / 1e-3
    for name in ("mean", "std", "low", "high"):
        yield f"depth {name} [um]", getattr(band, name) / 1e-6


_DEPTHS = {"cylinder_depth_profile": "depth", "roller_depth_profile": "depth"}

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
        "cylinder_depth_profiles.csv": table(_records(raw, "cylinder_depth_profile")),
    }
    if raw.records["roller_depth_profile"].any():
        texts["roller_depth_profiles.csv"] = table(_records(raw, "roller_depth_profile"))
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
