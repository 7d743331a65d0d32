"""Reading the file of an ensemble, finished or not, also while it is being written."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from wearsim.results.ensemble import state_slots
from wearsim.results.ensemble.data import EnsembleData
from wearsim.results.ensemble.schema import ENSEMBLE, FAILED, ensemble_schema, type_of
from wearsim.results.ensemble.stored_arrays import StoredArrays
from wearsim.results.io.reader import check_complete, read_attributes, read_file
from wearsim.results.schema import axis_lengths

if TYPE_CHECKING:
    import h5py

    from wearsim.results.io.hdf5_read import Extent


class EnsembleFileParts(NamedTuple):
    """Content of a file, and what is needed to continue writing it.

    Parameters
    ----------
    data : EnsembleData
        Content of the file.
    extents : mapping of str to Extent
        Positions of its variables and of the two slots of its state.
    state_number : int
        Sequence number of the last written state.
    """

    data: EnsembleData
    extents: Mapping[str, Extent]
    state_number: int


def read_ensemble(path: str | Path) -> EnsembleData:
    """Read the file of an ensemble; its arrays are read on access.

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
        If it is missing, foreign, truncated, damaged, or written by a newer wearsim.
    """
    return read_parts(path).data


def read_parts(path: str | Path) -> EnsembleFileParts:
    """Read the file of an ensemble to continue writing it; see `read_ensemble`."""
    return read_file(path, lambda file: _parts(Path(path), file))


def _parts(path: Path, file: h5py.File) -> EnsembleFileParts:
    from wearsim.results.io import hdf5_read, hdf5_write  # noqa: PLC0415  (h5py takes 0.2 s to import)

    slots = [f"{hdf5_write.CHECKPOINT}/{name}" for name in state_slots.PLACES]
    attributes = read_attributes(path, file, ENSEMBLE, EnsembleData, groups=slots)
    schema = ensemble_schema(attributes["inputs"], attributes["control"])
    check_complete(path, file, schema.variables)
    extents = hdf5_read.extents(file, schema.variables)
    rows = axis_lengths(extents, schema.variables)["realisation"]
    if rows != attributes["asked"]:
        raise ValueError(f"{rows} rows for {attributes['asked']} realisations")
    for name, variable in schema.variables.items():
        if extents[name].dtype != type_of(variable):
            raise ValueError(f"{name} is stored as {extents[name].dtype}")
    arrays = StoredArrays(path, os.fstat(file.id.get_vfd_handle()), extents)
    # the state first, so that the status read after a "finished" state is complete
    number, state = state_slots.newest([file[slot][()].tobytes() for slot in slots])
    status = arrays["status"]
    if (status > FAILED).any():
        raise ValueError(f"a realisation has the status {status.max()}")
    errors = {
        row: bytes(arrays.rows("error", row, row + 1)[0]).decode("utf-8", "replace")
        for row in np.flatnonzero(status == FAILED).tolist()
    }
    data = EnsembleData(**attributes, **state, variables=arrays, status=status, errors=errors)
    return EnsembleFileParts(
        data,
        extents | hdf5_read.extents(file[hdf5_write.CHECKPOINT], state_slots.PLACES),
        number,
    )
