"""Reading of results files, with one-line messages on missing, foreign or damaged files."""

from __future__ import annotations

import json
from collections.abc import Callable, Container, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypeVar

import numpy as np

from wearsim.errors import ResultsFileError
from wearsim.results.content import Arrays, StudyData
from wearsim.results.dissipation.data import DissipationData
from wearsim.results.dissipation.schema import DISSIPATION, dissipation_schema
from wearsim.results.ensemble.schema import ENSEMBLE
from wearsim.results.run.data import RunData
from wearsim.results.run.schema import RUN
from wearsim.results.schema import Schema, axis_lengths

if TYPE_CHECKING:
    import h5py

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_SMALLEST = 96  # bytes: no HDF5 file is shorter
# exceptions of h5py, json and numpy on damaged content
_DAMAGE = (OSError, RuntimeError, ValueError, TypeError, KeyError, AttributeError, OverflowError)
FileKind: TypeAlias = Literal["run", "dissipation", "ensemble"]
# kind, schema and Python function for opening, by format
_KINDS: dict[str, tuple[FileKind, Schema, str]] = {
    RUN.format: ("run", RUN, "open_results"),
    DISSIPATION.format: ("dissipation", DISSIPATION, "open_dissipation"),
    ENSEMBLE.format: ("ensemble", ENSEMBLE, "open_ensemble"),
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
        If it is missing, foreign, truncated, damaged, or written by a newer wearsim.
    """
    return read_file(path, lambda file: _run_data(path, file))


def read_dissipation(path: str | Path) -> DissipationData:
    """Read the file of a dissipation study; see `read_results`."""
    return read_file(path, lambda file: _dissipation_data(path, file))


def kind_of(path: str | Path) -> FileKind:
    """Return the kind of a results file.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    {"run", "dissipation", "ensemble"}

    Raises
    ------
    ResultsFileError
        As `read_results`.
    """
    return read_file(path, lambda file: _kind(path, file)[0])


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
    """
    import h5py  # noqa: PLC0415  (takes 0.2 s to import)

    _check_signature(path)
    try:
        # no lock is needed: the structure of a file never changes
        with h5py.File(path, "r", locking=False) as file:
            return take(file)
    except _DAMAGE as error:
        if "truncated" in str(error):
            raise ResultsFileError(truncated(path)) from error
        text = str(error.args[0]) if isinstance(error, KeyError) and error.args else str(error)
        reason = next(iter(text.splitlines()), type(error).__name__)
        raise ResultsFileError(f"{path}: is damaged ({reason})") from error


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
        raise ResultsFileError(truncated(path))


def truncated(path: str | Path) -> str:
    """Return the error message on a truncated file."""
    return f"{path}: is truncated: its end is missing, as after a copy that was cut short"


def _kind(path: str | Path, file: h5py.File) -> tuple[FileKind, Schema, str]:
    name = file.attrs.get("format")
    text = name.decode(errors="replace") if isinstance(name, bytes) else name
    if not isinstance(text, str) or text not in _KINDS:
        raise ResultsFileError(f"{path}: is HDF5, but not a results file of wearsim")
    return _KINDS[text]


def _run_data(path: str | Path, file: h5py.File) -> RunData:
    from wearsim.results.io import hdf5_read, hdf5_write  # noqa: PLC0415

    # early files of layout 1, without random inputs, have no "drawn"
    group = hdf5_write.CHECKPOINT
    attributes = read_attributes(path, file, RUN, RunData, groups=[group], optional=["drawn"])
    variables = _variables(file, RUN)

    def of_kind(kind: str) -> Arrays:
        return {name: variables[name] for name, item in RUN.variables.items() if item.kind == kind}

    return RunData(
        **attributes,
        static=of_kind("static"),
        history=of_kind("history"),
        records=of_kind("record"),
        checkpoint=hdf5_read.get_arrays(file[group]),
    )


def _dissipation_data(path: str | Path, file: h5py.File) -> DissipationData:
    attributes = read_attributes(path, file, DISSIPATION, DissipationData)
    schema = dissipation_schema(attributes["inputs"])
    check_complete(path, file, schema.variables)
    return DissipationData(**attributes, variables=_variables(file, schema))


def _variables(file: h5py.File, schema: Schema) -> Arrays:
    variables = {name: np.asarray(file[name][()]) for name in schema.variables}
    axis_lengths(variables, schema.variables)
    return variables


def read_attributes(
    path: str | Path,
    file: h5py.File,
    schema: Schema,
    data: type[StudyData],
    groups: Sequence[str] = (),
    optional: Sequence[str] = (),
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
    groups : sequence of str
        Required groups.
    optional : sequence of str
        Fields that may be missing, as in files of older versions.

    Raises
    ------
    ResultsFileError
        If the file is of another kind, written by a newer wearsim, or incomplete.
    """
    from wearsim.results.io import hdf5_read, hdf5_write  # noqa: PLC0415

    _, found, opener = _kind(path, file)
    if found is not schema:
        raise ResultsFileError(
            f"{path}: holds {found.holds}; what is needed is {schema.holds}. In Python,"
            f" wearsim.{opener} opens it"
        )
    version = int(file.attrs["format_version"])
    if version > schema.version:
        raise ResultsFileError(
            f"{path}: was written by a newer wearsim (format {version}, this one reads up to"
            f" {schema.version}); update wearsim to read it"
        )
    about, scenario, files = (
        f"{hdf5_write.INPUTS}/{name}"
        for name in (hdf5_write.ABOUT, hdf5_write.SCENARIO, hdf5_write.FILES)
    )
    check_complete(path, file, [*schema.variables, about, scenario, files, *groups])
    attributes: dict[str, Any] = json.loads(hdf5_read.get_text(file[about]))
    names = data.attribute_names()
    check_complete(path, {*attributes, *optional}, names)
    return {name: attributes[name] for name in names if name in attributes} | {
        "scenario_text": hdf5_read.get_text(file[scenario]),
        "files": {
            hdf5_read.get_label(item, "path"): hdf5_read.get_text(item)
            for number in range(len(file[files]))
            for item in [file[f"{files}/{number}"]]
        },
    }


def check_complete(path: str | Path, present: Container[str], names: Iterable[str]) -> None:
    """Raise a ResultsFileError unless all names are present in a file."""
    missing = [name for name in names if name not in present]
    if missing:
        raise ResultsFileError(f"{path}: is damaged (lacks {', '.join(missing)})")
