"""A results file read back; whatever is wrong with it is said in a line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.errors import ResultsFileError
from wearsim.results.data import ABOUT, Arrays, RunData
from wearsim.results.layout import FORMAT, VARIABLES, VERSION, axis_lengths

if TYPE_CHECKING:
    import h5py

_SMALLEST = 96  # bytes: no HDF5 file is shorter
# what h5py, json and numpy raise on content that is not as it was written
_DAMAGE = (OSError, RuntimeError, ValueError, TypeError, KeyError, AttributeError, OverflowError)


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
    from wearsim.results import hdf5  # noqa: PLC0415  (h5py takes 0.2 s to import)

    _check_signature(path, hdf5.SIGNATURE)
    try:
        with hdf5.opened(Path(path)) as file:
            _check_format(path, file)
            return _run_data(path, file)
    except _DAMAGE as error:
        if "truncated" in str(error):
            raise ResultsFileError(_truncated(path)) from error
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
        raise ResultsFileError(_truncated(path))
    raise ResultsFileError(f"{path}: is not a results file of wearsim, not even HDF5")


def _truncated(path: str | Path) -> str:
    return f"{path}: is truncated: its end is missing, as after a copy that was cut short"


def _first_line(error: Exception) -> str:
    text = str(error.args[0]) if isinstance(error, KeyError) and error.args else str(error)
    lines = text.splitlines()
    return lines[0] if lines else type(error).__name__


def _check_format(path: str | Path, file: h5py.File) -> None:
    name = file.attrs.get("format")
    if not isinstance(name, str | bytes) or name not in {FORMAT, FORMAT.encode()}:
        raise ResultsFileError(f"{path}: is HDF5, but not a results file of wearsim")
    version = int(file.attrs["format_version"])
    if version > VERSION:
        raise ResultsFileError(
            f"{path}: was written by a newer wearsim (format {version}, this one reads up to"
            f" {VERSION}); update wearsim to read it"
        )


def _run_data(path: str | Path, file: h5py.File) -> RunData:
    from wearsim.results import hdf5  # noqa: PLC0415

    about_at, scenario_at = f"{hdf5.INPUTS}/{hdf5.ABOUT}", f"{hdf5.INPUTS}/{hdf5.SCENARIO}"
    files_at = f"{hdf5.INPUTS}/{hdf5.FILES}"
    needed = (*VARIABLES, about_at, scenario_at, files_at, hdf5.CHECKPOINT)
    _check_complete(path, [name for name in needed if name not in file])
    about: dict[str, Any] = json.loads(hdf5.get_text(file[about_at]))
    _check_complete(path, [name for name in ABOUT if name not in about])
    variables = {name: np.asarray(file[name][()]) for name in VARIABLES}
    axis_lengths(variables)
    return RunData(
        **{name: about[name] for name in ABOUT},
        scenario_text=hdf5.get_text(file[scenario_at]),
        files=_files(file[files_at]),
        static=_of_kind("static", variables),
        history=_of_kind("history", variables),
        records=_of_kind("record", variables),
        checkpoint=hdf5.get_arrays(file[hdf5.CHECKPOINT]),
    )


def _check_complete(path: str | Path, missing: list[str]) -> None:
    if missing:
        raise ResultsFileError(f"{path}: is damaged (lacks {', '.join(missing)})")


def _files(group: h5py.Group) -> dict[str, str]:
    from wearsim.results import hdf5  # noqa: PLC0415

    datasets = [group[str(number)] for number in range(len(group))]
    return {hdf5.get_label(item, "path"): hdf5.get_text(item) for item in datasets}


def _of_kind(kind: str, variables: Arrays) -> Arrays:
    return {name: array for name, array in variables.items() if VARIABLES[name].kind == kind}
