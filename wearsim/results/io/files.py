"""Reading and writing of results files; what is missing, foreign or damaged gets one line."""

from __future__ import annotations

import json
from collections.abc import Callable, Container, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

from wearsim.atomic_write import DISK, Storage
from wearsim.errors import ResultsFileError
from wearsim.results.content import (
    ABOUT,
    CHECKPOINT,
    FILES,
    INPUTS,
    SCENARIO,
    Arrays,
    Schema,
    StudyData,
    axis_lengths,
)
from wearsim.results.io.stored_file import StoredFile

if TYPE_CHECKING:
    import h5py


_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_SMALLEST = 96  # bytes: no HDF5 file is shorter
_TRUNCATED = "is truncated: its end is missing, as after a copy that was cut short"
# exceptions of h5py, json and numpy on damaged content
_DAMAGE = (OSError, RuntimeError, ValueError, TypeError, KeyError, AttributeError, OverflowError)
Stored = TypeVar("Stored")


def read_study(path: str | Path, data: type[StudyData]) -> Any:
    """Read a results file.

    Parameters
    ----------
    path : str or Path
        The file.
    data : type of StudyData
        The class of its content.

    Returns
    -------
    StudyData

    Raises
    ------
    ResultsFileError
        If it is missing, foreign, truncated, damaged, of another kind or of another layout.
    """

    def take(file: StoredFile) -> StudyData:
        attributes = read_attributes(path, file, data.base_schema, data)
        schema = data.schema_of(attributes, file)
        check_complete(path, file, schema.variables)
        shapes = {name: file.dataset(name).shape for name in schema.variables}
        axis_lengths(shapes, schema.variables)
        variables = {name: file.array(name) for name in schema.variables}
        checkpoint = {name: file.array(f"{CHECKPOINT}/{name}") for name in file.names(CHECKPOINT)}
        return cast("StudyData", data.from_variables(attributes, variables, checkpoint))

    return read_file(path, take)


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


def read_file(path: str | Path, take: Callable[[StoredFile], Stored]) -> Stored:
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
        As `read_study`.
    TypeError
        As `as_path`.
    """
    _check_signature(as_path(path))
    try:
        with _opened(path) as file:
            return take(StoredFile(file))
    except _DAMAGE as error:
        if "truncated" in str(error):
            raise ResultsFileError(f"{path}: {_TRUNCATED}") from error
        text = str(error.args[0]) if isinstance(error, KeyError) and error.args else str(error)
        reason = next(iter(text.splitlines()), type(error).__name__)
        raise ResultsFileError(f"{path}: is damaged ({reason})") from error


def _opened(path: str | Path) -> h5py.File:
    """Open a file for reading, also one that another library has opened in this process."""
    import h5py  # noqa: PLC0415  (takes 0.2 s to import)

    # no lock is needed, since a file is replaced whole, but HDF5 requires the flags of locking
    # with which the file is open already, such as xarray's
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
    is_hdf5 = start.startswith(_SIGNATURE) or _SIGNATURE.startswith(start)
    mistakes = {
        "is empty": not start,
        "is not a results file of wearsim, not even HDF5": not is_hdf5,
        _TRUNCATED: len(start) < _SMALLEST,
    }
    for what, found in mistakes.items():
        if found:
            raise ResultsFileError(f"{path}: {what}")


def format_of(file: StoredFile) -> str:
    """Return the name of the format of a file, or another text if it has none."""
    try:
        return str(file.attribute("format"))
    except (KeyError, ValueError):
        return ""


def read_attributes(
    path: str | Path, file: StoredFile, schema: Schema, data: type[StudyData]
) -> dict[str, Any]:
    """Return the fields of a file except arrays, after checks of its kind and completeness.

    Parameters
    ----------
    path, file : str or Path, StoredFile
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
    name = format_of(file)
    if name != schema.format:
        if not name.startswith("wearsim-"):
            raise ResultsFileError(f"{path}: is HDF5, but not a results file of wearsim")
        from wearsim.results.viewed import study_kinds  # noqa: PLC0415  (of an error only)

        held = next((kind.holds for kind in study_kinds() if kind.format == name), "results")
        raise ResultsFileError(
            f"{path}: holds {held}; what is needed is {schema.holds}. In Python,"
            " wearsim.open_results opens it"
        )
    check_layout(path, file, schema)
    about, scenario, files = (f"{INPUTS}/{name}" for name in (ABOUT, SCENARIO, FILES))
    check_complete(path, file, [*schema.variables, about, scenario, files, CHECKPOINT])
    attributes: dict[str, Any] = json.loads(file.text(about))
    names = data.attribute_names()
    check_complete(path, attributes, [name for name in names if name not in data.optional])
    known = {name: attributes[name] for name in names if name in attributes} | {
        "scenario_text": file.text(scenario),
        "files": json.loads(file.text(files)),
    }
    data.check_types(known)
    return known


def check_layout(path: str | Path, file: StoredFile, schema: Schema) -> None:
    """Raise a ResultsFileError unless a file has the layout of a schema."""
    version = int(file.attribute("format_version"))
    if version != schema.version:
        older = "repeat the computation, or read it with the version of wearsim that wrote it"
        remedy = older if version < schema.version else "update wearsim to read it"
        raise ResultsFileError(
            f"{path}: has layout {version} of {schema.format}, and this wearsim reads layout"
            f" {schema.version}; {remedy}"
        )


def check_complete(path: str | Path, present: Container[str], names: Iterable[str]) -> None:
    """Raise a ResultsFileError unless all names are present in a file."""
    missing = [name for name in names if name not in present]
    if missing:
        raise ResultsFileError(f"{path}: is damaged (lacks {', '.join(missing)})")


def write_results(path: str | Path, data: StudyData, storage: Storage = DISK) -> None:
    """Write a results file, replacing an existing one.

    Parameters
    ----------
    path : str or Path
        The file.
    data : StudyData
        Content of the file.
    storage : Storage
        File operations.

    Raises
    ------
    ResultsFileError
        If it cannot be written; an existing file is then unchanged.
    ValueError
        If the variables differ from the schema, or their shapes are inconsistent.
    """
    from wearsim.results.io import hdf5_write  # noqa: PLC0415  (h5py takes 0.2 s to import)

    variables: Arrays = data.variables  # type: ignore[attr-defined]
    with hdf5_write.new_file(path, storage) as (file, _):
        hdf5_write.put_variables(file, data.schema, variables)
        hdf5_write.put_texts(file, data.schema, data, getattr(data, "checkpoint", {}))
