"""Reading of an ensemble, finished or not, also while it is being written."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from wearsim.errors import ResultsFileError
from wearsim.results.ensemble.data import EnsembleData
from wearsim.results.ensemble.parts import read_parts, text_of
from wearsim.results.ensemble.schema import ENSEMBLE, FAILED, ensemble_schema, type_of
from wearsim.results.ensemble.stored_rows import StoredRows
from wearsim.results.io.reader import check_complete, read_attributes, read_file
from wearsim.results.schema import axis_lengths

if TYPE_CHECKING:
    import h5py


def read_ensemble(path: str | Path) -> EnsembleData:
    """Read an ensemble from its file and its parts; arrays are read on access.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    EnsembleData

    Raises
    ------
    ResultsFileError
        If the file or a part is missing, foreign, truncated, damaged, or of another layout.
    """
    try:
        return _read(Path(path))
    except ResultsFileError:  # its parts may have been merged since the file was opened
        return _read(Path(path))


def _read(path: Path) -> EnsembleData:
    data, stored = read_file(path, lambda file: _merged(path, file))
    stored.parts += read_parts(path, data)
    status, errors = data.status, data.errors
    for part in stored.parts:
        status[part.numbers] = part.status
        errors |= part.errors
    failed = np.flatnonzero(status == FAILED).tolist()
    changed = {"finished": False, **stored.parts[-1].state} if stored.parts else {}
    return replace(data, errors={number: errors[number] for number in failed}, **changed)


def _merged(path: Path, file: h5py.File) -> tuple[EnsembleData, StoredRows]:
    """Return what the file of an ensemble holds without its parts."""
    attributes = read_attributes(path, file, ENSEMBLE, EnsembleData)
    schema = ensemble_schema(attributes["inputs"], attributes["control"])
    check_complete(path, file, schema.variables)
    datasets = {name: file[name] for name in schema.variables}
    rows = axis_lengths(datasets, schema.variables)["realisation"]
    if rows != attributes["requested"]:
        raise ValueError(f"{rows} rows for {attributes['requested']} realisations")
    for name, variable in schema.variables.items():
        if datasets[name].dtype != type_of(variable):
            raise ValueError(f"{name} is stored as {datasets[name].dtype}")
    status = datasets["status"][:]
    if (status > FAILED).any():
        raise ValueError(f"a realisation has the status {status.max()}")
    failed = np.flatnonzero(status == FAILED).tolist()
    errors = {number: text_of(datasets["error"][number]) for number in failed}
    identity = os.fstat(file.id.get_vfd_handle())
    stored = StoredRows(partial(_read_unchanged, path, identity), schema, [])
    return EnsembleData(**attributes, variables=stored, status=status, errors=errors), stored


def _read_unchanged(
    path: Path, identity: os.stat_result, take: Callable[[h5py.File], npt.NDArray[Any]]
) -> npt.NDArray[Any]:
    """Return what `take` reads from a file, which must be the one that was opened before."""

    def checked(file: h5py.File) -> npt.NDArray[Any]:
        if not os.path.samestat(os.fstat(file.id.get_vfd_handle()), identity):
            raise ResultsFileError(f"{path}: was replaced by another; open it again")
        return take(file)

    return read_file(path, checked)
