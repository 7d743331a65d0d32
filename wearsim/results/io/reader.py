"""A results file read back; whatever is wrong with it is said in a line."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypeVar

import numpy as np

from wearsim.errors import ResultsFileError
from wearsim.results.content import Arrays, StudyData
from wearsim.results.dissipation.data import DissipationData
from wearsim.results.dissipation.schema import DISSIPATION, with_inputs
from wearsim.results.ensemble.schema import ENSEMBLE
from wearsim.results.run.data import RunData
from wearsim.results.run.schema import RUN
from wearsim.results.schema import Layout, axis_lengths

if TYPE_CHECKING:
    import h5py

_SMALLEST = 96  # bytes: no HDF5 file is shorter
# what h5py, json and numpy raise on content that is not as it was written
_DAMAGE = (OSError, RuntimeError, ValueError, TypeError, KeyError, AttributeError, OverflowError)
FileKind: TypeAlias = Literal["replay", "dissipation", "ensemble"]
_KINDS: dict[str, FileKind] = {
    RUN.format: "replay",
    DISSIPATION.format: "dissipation",
    ENSEMBLE.format: "ensemble",
}
_OPENERS: dict[FileKind, str] = {
    "replay": "open_results",
    "dissipation": "open_dissipation",
    "ensemble": "open_ensemble",
}
_LAYOUTS = {layout.format: layout for layout in (RUN, DISSIPATION, ENSEMBLE)}

Stored = TypeVar("Stored")


def read_results(path: str | Path) -> RunData:
    """Read a results file.

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
    """Read the file of a study of the dissipation of a contact; see `read_results`."""
    return read_file(path, lambda file: _dissipation_data(path, file))


def kind_of(path: str | Path) -> FileKind:
    """Return what a results file holds; raises as `read_results`.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    {"replay", "dissipation", "ensemble"}
    """
    return read_file(path, lambda file: _KINDS[_layout_of(path, file).format])


def is_dissipation(path: str | Path) -> bool:
    """Tell whether a results file holds a study of a contact; raises as `read_results`."""
    return kind_of(path) == "dissipation"


def read_file(path: str | Path, take: Callable[[h5py.File], Stored]) -> Stored:
    """Open a file and take from it; whatever goes wrong becomes a ResultsFileError.

    Parameters
    ----------
    path : str or Path
        The file.
    take : callable
        Returns what is wanted of the open file.
    """
    from wearsim.results.io import hdf5_read, hdf5_write  # noqa: PLC0415  (h5py takes 0.2 s to import)

    _check_signature(path, hdf5_write.SIGNATURE)
    try:
        with hdf5_read.opened(Path(path)) as file:
            return take(file)
    except _DAMAGE as error:
        if "truncated" in str(error):
            raise ResultsFileError(truncated(path)) from error
        raise ResultsFileError(f"{path}: is damaged ({_first_line(error)})") from error


def _check_signature(path: str | Path, signature: bytes) -> None:
    try:
        with Path(path).open("rb") as file:
            start = file.read(_SMALLEST)
    except FileNotFoundError as error:
        raise ResultsFileError(f"{path}: there is no such file") from error
    except OSError as error:
        raise ResultsFileError(f"{path}: cannot be read ({error.strerror})") from error
    if not start:
        raise ResultsFileError(f"{path}: is empty")
    if start.startswith(signature) and len(start) == _SMALLEST:
        return
    if start.startswith(signature) or signature.startswith(start):
        raise ResultsFileError(truncated(path))
    raise ResultsFileError(f"{path}: is not a results file of wearsim, not even HDF5")


def truncated(path: str | Path) -> str:
    """Return what is said of a file whose end is missing."""
    return f"{path}: is truncated: its end is missing, as after a copy that was cut short"


def _first_line(error: Exception) -> str:
    text = str(error.args[0]) if isinstance(error, KeyError) and error.args else str(error)
    lines = text.splitlines()
    return lines[0] if lines else type(error).__name__


def _layout_of(path: str | Path, file: h5py.File) -> Layout:
    name = file.attrs.get("format")
    text = name.decode(errors="replace") if isinstance(name, bytes) else name
    if not isinstance(text, str) or text not in _LAYOUTS:
        raise ResultsFileError(f"{path}: is HDF5, but not a results file of wearsim")
    return _LAYOUTS[text]


def _check_format(path: str | Path, file: h5py.File, wanted: Layout) -> None:
    found = _layout_of(path, file)
    if found is not wanted:
        raise ResultsFileError(
            f"{path}: holds {found.holds}; what is needed is {wanted.holds}. In Python,"
            f" wearsim.{_OPENERS[_KINDS[found.format]]} opens it"
        )
    version = int(file.attrs["format_version"])
    if version > wanted.version:
        raise ResultsFileError(
            f"{path}: was written by a newer wearsim (format {version}, this one reads up to"
            f" {wanted.version}); update wearsim to read it"
        )


def _run_data(path: str | Path, file: h5py.File) -> RunData:
    # nothing is drawn in files of version 0.1.0, which do not say so
    found = told(path, file, RUN, RunData, groups=["checkpoint"], optional=["drawn"])
    variables = _variables(file, RUN)
    return RunData(
        **found,
        static=_of_kind("static", variables),
        history=_of_kind("history", variables),
        records=_of_kind("record", variables),
        checkpoint=_checkpoint(file),
    )


def _dissipation_data(path: str | Path, file: h5py.File) -> DissipationData:
    found = told(path, file, DISSIPATION, DissipationData)
    layout = with_inputs(found["inputs"])
    check_complete(path, [name for name in layout.variables if name not in file])
    return DissipationData(**found, variables=_variables(file, layout))


def told(
    path: str | Path,
    file: h5py.File,
    layout: Layout,
    kind: type[StudyData],
    groups: Sequence[str] = (),
    optional: Sequence[str] = (),
) -> dict[str, Any]:
    """Return all that a file tells besides arrays, having checked that these are there too.

    Parameters
    ----------
    path, file : str or Path, h5py.File
        The file.
    layout : Layout
        The kind of file that it must be.
    kind : type of StudyData
        What is made of it.
    groups : sequence of str
        Groups that must be there.
    optional : sequence of str
        What may be missing, as in files of older versions.
    """
    from wearsim.results.io import hdf5_read, hdf5_write  # noqa: PLC0415

    _check_format(path, file, layout)
    about_at, scenario_at = (
        f"{hdf5_write.INPUTS}/{hdf5_write.ABOUT}",
        f"{hdf5_write.INPUTS}/{hdf5_write.SCENARIO}",
    )
    files_at = f"{hdf5_write.INPUTS}/{hdf5_write.FILES}"
    wanted = (*layout.variables, about_at, scenario_at, files_at, *groups)
    check_complete(path, [name for name in wanted if name not in file])
    about: dict[str, Any] = json.loads(hdf5_read.get_text(file[about_at]))
    names = kind.told()
    check_complete(path, [name for name in names if name not in {*about, *optional}])
    texts = {
        "scenario_text": hdf5_read.get_text(file[scenario_at]),
        "files": _files(file[files_at]),
    }
    return {name: about[name] for name in names if name in about} | texts


def _variables(file: h5py.File, layout: Layout) -> Arrays:
    variables = {name: np.asarray(file[name][()]) for name in layout.variables}
    axis_lengths(variables, layout.variables)
    return variables


def _checkpoint(file: h5py.File) -> Arrays:
    from wearsim.results.io import hdf5_read, hdf5_write  # noqa: PLC0415

    return hdf5_read.get_arrays(file[hdf5_write.CHECKPOINT])


def check_complete(path: str | Path, missing: list[str]) -> None:
    """Refuse a file that lacks something; see `read_file`."""
    if missing:
        raise ResultsFileError(f"{path}: is damaged (lacks {', '.join(missing)})")


def _files(group: h5py.Group) -> dict[str, str]:
    from wearsim.results.io.hdf5_read import get_label, get_text  # noqa: PLC0415

    datasets = [group[str(number)] for number in range(len(group))]
    return {get_label(item, "path"): get_text(item) for item in datasets}


def _of_kind(kind: str, variables: Arrays) -> Arrays:
    return {name: array for name, array in variables.items() if RUN.variables[name].kind == kind}
