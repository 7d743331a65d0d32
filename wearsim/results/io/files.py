"""Reading and writing of results files; what is missing, foreign or damaged gets one line."""

from __future__ import annotations

import json
from collections.abc import Callable, Container, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypeVar

import numpy as np

from wearsim.errors import ResultsFileError
from wearsim.results.content import (
    ABOUT,
    CHECKPOINT,
    ERRORS,
    FILES,
    INPUTS,
    SCENARIO,
    Arrays,
    Schema,
    StudyData,
    axis_lengths,
    with_random_inputs,
)
from wearsim.results.dissipation import (
    DISSIPATION,
    DissipationData,
)
from wearsim.results.ensemble.schema import ENSEMBLE
from wearsim.results.identification import IDENTIFICATION, IdentificationData
from wearsim.results.io.atomic_write import DISK, Storage
from wearsim.results.run import RunData
from wearsim.results.run_schema import CAM_RUN, RUN

if TYPE_CHECKING:
    import h5py


_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_SMALLEST = 96  # bytes: no HDF5 file is shorter
# exceptions of h5py, json and numpy on damaged content
_DAMAGE = (OSError, RuntimeError, ValueError, TypeError, KeyError, AttributeError, OverflowError)
FileKind: TypeAlias = Literal["run", "dissipation", "ensemble", "identification"]
# kind and schema by format
_KINDS: dict[str, tuple[FileKind, Schema]] = {
    RUN.format: ("run", RUN),
    DISSIPATION.format: ("dissipation", DISSIPATION),
    ENSEMBLE.format: ("ensemble", ENSEMBLE),
    IDENTIFICATION.format: ("identification", IDENTIFICATION),
}

Stored = TypeVar("Stored")


def read_results(path: str | Path) -> RunData:
    """Read the results file of a run.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    RunData

    Raises
    ------
    ResultsFileError
        If it is missing, foreign, truncated, damaged, or of another layout.
    """
    return read_file(path, lambda file: _run_data(path, file))


def read_dissipation(path: str | Path) -> DissipationData:
    """Read the file of a dissipation study; see `read_results`."""
    return read_file(path, lambda file: _dissipation_data(path, file))


def read_identification(path: str | Path) -> IdentificationData:
    """Read the file of an identification; see `read_results`."""

    def take(file: h5py.File) -> IdentificationData:
        attributes = read_attributes(path, file, IDENTIFICATION, IdentificationData)
        return IdentificationData(**attributes, variables=_variables(file, IDENTIFICATION))

    return read_file(path, take)


def kind_of(path: str | Path) -> FileKind:
    """Return the kind of a results file.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    {"run", "dissipation", "ensemble", "identification"}

    Raises
    ------
    ResultsFileError
        As `read_results`.
    """
    return read_file(path, lambda file: _kind(path, file)[0])


def as_path(path: str | Path) -> Path:
    """Return the path of a results file.

    Raises
    ------
    TypeError
        If it is no path, as a result.
    """
    if not isinstance(path, str | Path):
        raise TypeError(
            f"a results file must be named by its path, got a {type(path).__name__};"
            " result.path is the file of a result"
        )
    return Path(path)


def read_file(path: str | Path, take: Callable[[h5py.File], Stored]) -> Stored:
    """Open a file and return what `take` reads from it.

    Parameters
    ----------
    path : str or Path
        The file.
    take : callable
        Function of the open file.

    Raises
    ------
    ResultsFileError
        As `read_results`.
    TypeError
        As `as_path`.
    """
    _check_signature(as_path(path))
    try:
        with _opened(path) as file:
            return take(file)
    except _DAMAGE as error:
        if "truncated" in str(error):
            raise ResultsFileError(_truncated(path)) from error
        text = str(error.args[0]) if isinstance(error, KeyError) and error.args else str(error)
        reason = next(iter(text.splitlines()), type(error).__name__)
        raise ResultsFileError(f"{path}: is damaged ({reason})") from error


def _opened(path: str | Path) -> h5py.File:
    """Open a file for reading, also one that another library has opened in this process."""
    import h5py  # noqa: PLC0415  (takes 0.2 s to import)

    # no lock is needed, since a file is replaced whole, but HDF5 requires the flags of locking
    # with which the file is open already, such as those of xarray
    for locking in (False, "best-effort"):
        try:
            return h5py.File(path, "r", locking=locking)
        except OSError as error:
            if "file locking" not in str(error):
                raise
    return h5py.File(path, "r", locking=True)


def _check_signature(path: str | Path) -> None:
    try:
        with Path(path).open("rb") as file:
            start = file.read(_SMALLEST)
    except FileNotFoundError as error:
        raise ResultsFileError(f"{path}: there is no such file") from error
    except OSError as error:
        raise ResultsFileError(f"{path}: cannot be read ({error.strerror})") from error
    if not start:
        raise ResultsFileError(f"{path}: is empty")
    if not (start.startswith(_SIGNATURE) or _SIGNATURE.startswith(start)):
        raise ResultsFileError(f"{path}: is not a results file of wearsim, not even HDF5")
    if len(start) < _SMALLEST:
        raise ResultsFileError(_truncated(path))


def _truncated(path: str | Path) -> str:
    return f"{path}: is truncated: its end is missing, as after a copy that was cut short"


def _kind(path: str | Path, file: h5py.File) -> tuple[FileKind, Schema]:
    found = _KINDS.get(format_of(file))
    if found is None:
        raise ResultsFileError(f"{path}: is HDF5, but not a results file of wearsim")
    return found


def format_of(file: h5py.File) -> str:
    """Return the name of the format of a file, or another text if it has none."""
    name = file.attrs.get("format")
    return name.decode(errors="replace") if isinstance(name, bytes) else str(name)


def _run_data(path: str | Path, file: h5py.File) -> RunData:
    attributes = read_attributes(path, file, RUN, RunData)
    schema = CAM_RUN if "station_angle" in file else RUN
    check_complete(path, file, schema.variables)
    variables = _variables(file, schema)

    def of_kind(kind: str) -> Arrays:
        return {n: variables[n] for n, item in schema.variables.items() if item.kind == kind}

    return RunData(
        **attributes,
        static=of_kind("static"),
        history=of_kind("history"),
        records=of_kind("record"),
        checkpoint={name: np.asarray(item[()]) for name, item in file[CHECKPOINT].items()},
    )


def _dissipation_data(path: str | Path, file: h5py.File) -> DissipationData:
    attributes = read_attributes(path, file, DISSIPATION, DissipationData)
    schema = with_random_inputs(DISSIPATION, attributes["inputs"])
    check_complete(path, file, schema.variables)
    return DissipationData(**attributes, variables=_variables(file, schema))


def _variables(file: h5py.File, schema: Schema) -> Arrays:
    variables = {name: np.asarray(file[name][()]) for name in schema.variables}
    axis_lengths(variables, schema.variables)
    return variables


def read_attributes(
    path: str | Path, file: h5py.File, schema: Schema, data: type[StudyData]
) -> dict[str, Any]:
    """Return the fields of a file except arrays, after checks of its kind and completeness.

    Parameters
    ----------
    path, file : str or Path, h5py.File
        The file.
    schema : Schema
        The required kind of file.
    data : type of StudyData
        The class with these fields.

    Raises
    ------
    ResultsFileError
        If the file is of another kind or layout, or incomplete.
    """
    _, found = _kind(path, file)
    if found is not schema:
        raise ResultsFileError(
            f"{path}: holds {found.holds}; what is needed is {schema.holds}. In Python,"
            " wearsim.open_results opens it"
        )
    check_layout(path, file, schema)
    about, scenario, files = (f"{INPUTS}/{name}" for name in (ABOUT, SCENARIO, FILES))
    check_complete(path, file, [*schema.variables, about, scenario, files, CHECKPOINT])
    attributes: dict[str, Any] = json.loads(read_text(file[about]))
    names = data.attribute_names()
    check_complete(path, attributes, [name for name in names if name not in data.optional])
    return {name: attributes[name] for name in names if name in attributes} | {
        "scenario_text": read_text(file[scenario]),
        "files": json.loads(read_text(file[files])),
    }


def check_layout(path: str | Path, file: h5py.File, schema: Schema) -> None:
    """Raise a ResultsFileError unless a file has the layout of a schema."""
    version = int(file.attrs["format_version"])
    if version == schema.version:
        return
    remedy = "update wearsim to read it"
    if version < schema.version:
        remedy = "repeat the computation, or read it with the version of wearsim that wrote it"
    raise ResultsFileError(
        f"{path}: has layout {version} of {schema.format}, and this wearsim reads layout"
        f" {schema.version}; {remedy}"
    )


def read_text(dataset: h5py.Dataset) -> str:
    """Return a text written by `hdf5_write.put_text`."""
    content: bytes = dataset[:].tobytes()  # a single element would lose zeros at its end
    return content[:-1].decode("utf-8", ERRORS)


def check_complete(path: str | Path, present: Container[str], names: Iterable[str]) -> None:
    """Raise a ResultsFileError unless all names are present in a file."""
    missing = [name for name in names if name not in present]
    if missing:
        raise ResultsFileError(f"{path}: is damaged (lacks {', '.join(missing)})")


def write_results(
    path: str | Path,
    data: RunData | DissipationData | IdentificationData,
    storage: Storage = DISK,
) -> None:
    """Write a results file, replacing an existing one.

    Parameters
    ----------
    path : str or Path
        The file.
    data : RunData, DissipationData or IdentificationData
        Content of the file.
    storage : Storage
        File operations.

    Raises
    ------
    ResultsFileError
        If it cannot be written; an existing file is then unchanged.
    ValueError
        If the variables are not those of the schema, or their shapes are inconsistent.
    """
    from wearsim.results.io import hdf5_write  # noqa: PLC0415  (h5py takes 0.2 s to import)

    checkpoint = data.checkpoint if isinstance(data, RunData) else {}
    with hdf5_write.new_file(path, storage) as (file, _):
        hdf5_write.put_variables(file, data.schema, data.variables)
        hdf5_write.put_texts(file, data.schema, data, checkpoint)
