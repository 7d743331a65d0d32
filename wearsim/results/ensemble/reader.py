"""The file of an ensemble read back, finished or not, and while it is being written."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from wearsim.results.ensemble import state_slots
from wearsim.results.ensemble.data import EnsembleData
from wearsim.results.ensemble.schema import ENSEMBLE, FAILED, layout_of, type_of
from wearsim.results.ensemble.stored_arrays import StoredArrays
from wearsim.results.io.reader import check_complete, read_file, told
from wearsim.results.schema import Layout, axis_lengths

if TYPE_CHECKING:
    import h5py

    from wearsim.results.io.hdf5_read import Extent


class EnsembleFileParts(NamedTuple):
    """A file read back, and what it takes to go on writing it.

    Parameters
    ----------
    data : EnsembleData
        What it holds.
    extents : mapping of str to Extent
        Where its variables stand, and the two places of its state.
    state_number : int
        Number of the last writing of the state.
    """

    data: EnsembleData
    extents: Mapping[str, Extent]
    state_number: int


def read_ensemble(path: str | Path) -> EnsembleData:
    """Read the file of an ensemble; its arrays are read when they are asked for.

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
    """Read the file of an ensemble to go on with it; see `read_ensemble`."""
    return read_file(path, lambda file: _parts(Path(path), file))


def _parts(path: Path, file: h5py.File) -> EnsembleFileParts:
    from wearsim.results.io import hdf5_read, hdf5_write  # noqa: PLC0415  (h5py takes 0.2 s to import)

    places = [f"{hdf5_write.CHECKPOINT}/{name}" for name in state_slots.PLACES]
    found = told(path, file, ENSEMBLE, EnsembleData, groups=places)
    layout = layout_of(found["inputs"], found["control"])
    check_complete(path, [name for name in layout.variables if name not in file])
    extents = hdf5_read.extents(file, layout.variables)
    _check(layout, extents, found["asked"])
    identity = os.fstat(file.id.get_vfd_handle())
    arrays = StoredArrays(path, identity, extents)
    # the state first: where it says that all is done, the status read after it says so too
    number, state = state_slots.newest([file[place][()].tobytes() for place in places])
    status = arrays["status"]
    if (status > FAILED).any():
        raise ValueError(f"a realisation has the status {status.max()}")
    data = EnsembleData(
        **found,
        **state,
        variables=arrays,
        status=status,
        errors=_errors(arrays, np.flatnonzero(status == FAILED).tolist()),
    )
    of_state = hdf5_read.extents(file[hdf5_write.CHECKPOINT], state_slots.PLACES)
    return EnsembleFileParts(data, extents | of_state, number)


def _check(layout: Layout, extents: Mapping[str, Extent], asked: int) -> None:
    lengths = axis_lengths(extents, layout.variables)
    if lengths["realisation"] != asked:
        raise ValueError(f"{lengths['realisation']} rows for {asked} realisations")
    for name, variable in layout.variables.items():
        if extents[name].dtype != type_of(variable):
            raise ValueError(f"{name} is stored as {extents[name].dtype}")


def _errors(arrays: StoredArrays, failed: list[int]) -> dict[int, str]:
    return {number: _text(arrays.rows("error", number, number + 1)[0]) for number in failed}


def _text(content: Any) -> str:
    return bytes(content).decode("utf-8", "replace")
