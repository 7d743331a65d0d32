"""Export of results as CSV tables in engineering units, which are named in the headers."""

from __future__ import annotations

import csv
import io
import itertools
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from importlib import import_module
from pathlib import Path, PurePosixPath
from typing import Literal, TypeAlias

import numpy as np

from wearsim.errors import ResultsFileError
from wearsim.results.content import ERRORS, Array
from wearsim.results.dissipation import DissipationData, DissipationResult
from wearsim.results.ensemble.data import Band, EnsembleData
from wearsim.results.ensemble.result import EnsembleResult
from wearsim.results.ensemble.schema import ALL_OBSERVABLES, FAILED, LIFE, PENDING
from wearsim.results.identification import IdentificationResult
from wearsim.results.io.atomic_write import replacement
from wearsim.results.run import Result, RunData
from wearsim.results.run_schema import ALL_VARIABLES, AXES
from wearsim.types import FloatArray
from wearsim.units import engineers_unit

Column: TypeAlias = tuple[str, FloatArray]  # title and values
Unit: TypeAlias = tuple[str, float]  # name and size in SI

# engineering units by SI unit
_UNITS = {
    "m": ("um", 1e-6),
    "m^3": ("mm^3", 1e-9),
    "s": ("min", 60.0),
    "Pa": ("MPa", 1e6),
    "N/m": ("N/mm", 1e3),
    "rad": ("deg", math.radians(1.0)),
}
_IN_MM = {"y", "width", "width_error", "half_length"}  # other lengths are written in um
_SCALARS = ("steps", "solves", "depth_error", "volume_error", "control")
_NUMBER = re.compile(r"-?\d+(\.\d+)?(e[+-]\d+)?")
_BLOCK = 16384  # realisations in memory at a time


def _unit(name: str, unit: str) -> Unit:
    """Return the unit in which a computed variable is written."""
    return ("mm", 1e-3) if name in _IN_MM else _UNITS.get(unit, (unit, 1.0))


def _drawn_unit(unit: str) -> Unit:
    """Return the unit in which drawn values are written."""
    return _UNITS[unit] if unit == "Pa" else engineers_unit(unit)


def _column(name: str, values: FloatArray, unit: Unit) -> Column:
    return (name if unit[0] == "1" else f"{name} [{unit[0]}]"), values / unit[1]


def _table(columns: Iterable[Column]) -> str:
    titles, values = zip(*columns, strict=True)
    return _csv([titles]) + _rows(np.column_stack(values))


def _rows(numbers: Array) -> str:
    # adding zero avoids -0
    return _csv([f"{value + 0.0:.12g}" for value in row] for row in numbers.tolist())


def _csv(cells: Iterable[Sequence[str]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(cells)
    return text.getvalue()


def _with_decimal_comma(pieces: Iterable[str]) -> Iterator[str]:
    """Yield a table with decimal commas, and semicolons between the cells."""
    for piece in pieces:
        text = io.StringIO()
        writer = csv.writer(text, delimiter=";", lineterminator="\n")
        for cells in csv.reader(io.StringIO(piece)):
            writer.writerow([c.replace(".", ",") if _NUMBER.fullmatch(c) else c for c in cells])
        yield text.getvalue()


def export_csv(
    result: Result | DissipationResult | EnsembleResult | IdentificationResult,
    folder: str | Path,
    *,
    force: bool = False,
    decimal: Literal[".", ","] = ".",
) -> list[Path]:
    """Write a result of any kind as CSV, and the scenario with its files.

    Parameters
    ----------
    result : Result, DissipationResult, EnsembleResult or IdentificationResult
        Of a run, its history and records are written; of a dissipation study, its realisations
        and strips; of an ensemble, its realisations, the estimates at all records, and the profile
        and lift error at the end; of an identification, its tests and traces.
    folder : str or Path
        Target folder, which is created if it does not exist.
    force : bool
        Overwrite existing files.
    decimal : {".", ","}
        Decimal sign of the tables. With a comma, semicolons separate the cells.

    Returns
    -------
    list of Path
        The written files.

    Raises
    ------
    ResultsFileError
        If the folder is a file or cannot be written, or if one of the files exists and `force` is
        false; then no file is written.
    ValueError
        If the decimal sign is neither a point nor a comma.
    """
    if decimal not in {".", ","}:
        raise ValueError(f"the decimal sign is {decimal!r}, expected '.' or ','")
    folder = Path(folder)
    if folder.exists() and not folder.is_dir():
        raise ResultsFileError(
            f"{folder}: is a file; tables are written to a folder, which is created if it does not"
            " exist",
            shell="name one with -o",
        )
    contents: dict[str, Iterable[str]]
    if isinstance(result, EnsembleResult):
        contents = _ensemble_tables(result)
    elif isinstance(result, Result):
        contents = _run_tables(result.raw)
        if "station_angle" in result.raw.static:
            # by name, since the kinematics of a cam belong to a layer above
            table = import_module("wearsim.studies.cam.export").worn_cam(result)
            contents["worn_cam.csv"] = [_table(table.items())]
    elif isinstance(result, IdentificationResult):
        contents = _identification_tables(result)
    else:
        contents = _study_tables(result.raw)
    if decimal == ",":
        contents = {name: _with_decimal_comma(pieces) for name, pieces in contents.items()}
    contents["scenario.toml"] = [result.raw.scenario_text]
    for name, text in result.raw.files.items():
        contents[_path_in_folder(name, contents)] = [text]
    existing = [str(folder / name) for name in contents if (folder / name).exists()]
    if existing and not force:
        raise ResultsFileError(
            f"{', '.join(existing)}: already exists",
            python="choose another folder, or force=True",
            shell="choose another folder with -o, or --force",
        )
    for name, content in contents.items():
        parent = (folder / name).parent
        try:
            parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ResultsFileError(f"{parent}: cannot be made ({error.strerror})") from error
        with replacement(folder / name) as file:
            file.writelines(piece.encode("utf-8", ERRORS) for piece in content)
    return [folder / name for name in contents]


def _path_in_folder(path: str, used: Iterable[str]) -> str:
    """Return the path of an input file as in the scenario, or another inside the folder."""
    pure = PurePosixPath(path.replace("\\", "/"))
    inside = not pure.is_absolute() and ".." not in pure.parts and ":" not in path and pure.name
    if inside and str(pure) not in used:
        return str(pure)
    name = pure.name.replace("..", "_").replace(":", "_") or "file"
    prefixes = itertools.chain([""], (f"{number}-" for number in itertools.count(2)))
    return next(new for prefix in prefixes if (new := f"inputs/{prefix}{name}") not in used)


def _ensemble_tables(result: EnsembleResult) -> dict[str, Iterable[str]]:
    tables: dict[str, Iterable[str]] = {"realisations.csv": _ensemble_realisations(result.raw)}
    if result.count:
        tables["courses.csv"] = [_table(_courses(result))]
        tables["profile.csv"] = [_table(_profile(result))]
    if result.count and result.raw.cam:
        tables["lift_error.csv"] = [_table(_lift_error(result))]
    if result.failed:
        errors = [(str(number), text) for number, text in result.errors.items()]
        tables["failures.csv"] = [_csv([("realisation", "error"), *errors])]
    return tables


def _ensemble_realisations(raw: EnsembleData) -> Iterator[str]:
    """Yield drawn values and results of all realisations except pending ones, in blocks."""
    for start in range(0, raw.requested, _BLOCK):
        stop = min(start + _BLOCK, raw.requested)
        titles, values = zip(*_block(raw, start, stop), strict=True)
        if start == 0:
            yield _csv([titles])
        yield _rows(np.column_stack(values)[raw.status[start:stop] != PENDING])


def _block(raw: EnsembleData, start: int, stop: int) -> Iterator[Column]:
    failed = raw.status[start:stop] == FAILED
    yield "realisation", np.arange(start, stop, dtype=np.float64)
    yield "failed", failed.astype(np.float64)
    for item in raw.inputs:
        key, values = item["key"], raw.rows(item["key"], start, stop)
        if values.ndim == 1:
            yield _column(key, values, _drawn_unit(item["unit"]))
        else:
            for number, column in enumerate(values.T, 1):
                yield _column(f"{key} roller {number}", column, _drawn_unit(item["unit"]))
    for name in (*ALL_OBSERVABLES, *_SCALARS, *LIFE):
        if name in raw.schema.variables:
            values = raw.rows(name, start, stop)
            final = np.where(failed, np.nan, values[:, -1] if values.ndim > 1 else values)
            yield _column(name, final, _unit(name, raw.schema.variables[name].unit))


def _courses(result: EnsembleResult) -> Iterator[Column]:
    """Yield the estimates of each observable at every record."""
    yield "passes", result.record_passes
    yield _column("time", result.record_time, _UNITS["s"])
    for name in result.observables:
        course, variable = result.course(name), ALL_OBSERVABLES[name]
        columns = {
            "mean": course.mean,
            "mean low": course.mean_low,
            "mean high": course.mean_high,
            "std": course.std,
            **{f"{100.0 * p:g} %": values for p, values in course.quantiles.items()},
        }
        for ending, values in columns.items():
            yield _column(f"{name} {ending}", values, _unit(name, variable.unit))


def _profile(result: EnsembleResult) -> Iterator[Column]:
    """Yield mean and band of the worn depth at the end over the strips."""
    band = result.band()
    yield _column("y", band.y, _unit("y", "m"))
    yield from _band("depth", band)


def _lift_error(result: EnsembleResult) -> Iterator[Column]:
    """Yield mean and band of the lift error at the end over the angle."""
    band = result.band("lift_error_curve")
    yield _column("angle", band.y, _UNITS["rad"])
    yield from _band("lift error", band)


def _band(what: str, band: Band) -> Iterator[Column]:
    for name in ("mean", "std", "low", "high"):
        yield _column(f"{what} {name}", getattr(band, name), _UNITS["m"])


def _run_tables(raw: RunData) -> dict[str, Iterable[str]]:
    records = {
        "cylinder_depth_profiles.csv": "cylinder_depth_profile",
        "roller_depth_profiles.csv": "roller_depth_profile",
        "line_load.csv": "line_load",
        "dissipation.csv": "dissipation",
    }
    if not raw.records["roller_depth_profile"].any():
        del records["roller_depth_profiles.csv"]
    history = [
        column
        for name, variable in raw.schema.variables.items()
        if variable.kind == "history"
        for column in _columns(name, raw.history[name], variable.dims, name)
    ]
    tables = {file: [_table(_records(raw, name))] for file, name in records.items()}
    return {"history.csv": [_table(history)], **tables}


def _records(raw: RunData, name: str) -> Iterator[Column]:
    """Yield y, and a column for every record and contact."""
    yield from _columns("y", raw.static["y"], ("y",), "y")
    dims = ("y", *ALL_VARIABLES[name].dims[1:-1])
    quantity = "depth" if name.endswith("depth_profile") else name
    for passes, array in zip(raw.records["record_passes"], raw.records[name], strict=True):
        title = f"{quantity} at {passes:.12g} passes"
        yield from _columns(name, np.moveaxis(array, -1, 0), dims, title)


def _columns(name: str, array: FloatArray, dims: Sequence[str], title: str) -> Iterator[Column]:
    """Yield the columns of an array with rows along the first axis, the others in the titles."""
    for index in np.ndindex(array.shape[1:]):
        labels = [
            f"{dim} {number + AXES[dim].first}"
            for dim, number, length in zip(dims[1:], index, array.shape[1:], strict=True)
            if length > 1
        ]
        values = array[(slice(None), *index)]
        yield _column(" ".join([title, *labels]), values, _unit(name, ALL_VARIABLES[name].unit))


def _study_tables(raw: DissipationData) -> dict[str, Iterable[str]]:
    variables = raw.schema.variables

    def columns(dim: str) -> dict[str, Column]:
        return {
            name: _column(name, raw.variables[name], _drawn_unit(variable.unit))
            for name, variable in variables.items()
            if variable.dims == (dim,)
        }

    numbers = ("realisation", np.arange(len(raw.variables["power"]), dtype=np.float64))
    found = columns("realisation")
    drawn = {item["key"]: found[item["key"]] for item in raw.inputs}  # before the results
    return {
        "realisations.csv": [_table([numbers, *(drawn | found).values()])],
        "strips.csv": [_table(columns("y").values())],
    }


def _identification_tables(result: IdentificationResult) -> dict[str, Iterable[str]]:
    """Return the tables of an identification: tests, and all traces below each other."""
    depths = ("depth [um]", "model_depth [um]")
    heads = ("file", "specimen", "passes", *depths, "K/H [1/Pa]", "low [1/Pa]", "high [1/Pa]")
    rows = [
        [
            test["file"],
            test["specimen"],
            f"{test['passes']:.12g}",
            "" if test["depth_m"] is None else f"{1e6 * test['depth_m']:.12g}",
            f"{1e6 * test['model_depth_m']:.12g}",
            *(f"{test['k_over_h_per_Pa'][name]:.12g}" for name in ("value", "low", "high")),
        ]
        for test in result.tests
    ]
    names = ("height", "fitted", "low", "high")
    columns = [result.values(f"trace_{name}") for name in ("y", *names)]
    known = np.isfinite(columns[0])
    number = np.broadcast_to(np.arange(1.0, len(known) + 1.0)[:, None], known.shape)
    traces = [_column("test", number[known], ("1", 1.0))]
    traces += [_column("y", columns[0][known], ("mm", 1e-3))]
    traces += [
        _column(name, column[known], ("um", 1e-6))
        for name, column in zip(names, columns[1:], strict=True)
    ]
    return {"tests.csv": [_csv([heads, *rows])], "traces.csv": [_table(traces)]}
