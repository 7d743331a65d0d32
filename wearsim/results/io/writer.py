"""Atomic writing of results files: after a kill either the old or the new file is complete."""

from __future__ import annotations

from pathlib import Path

from wearsim.results.dissipation import DissipationData
from wearsim.results.io.atomic_write import DISK, Storage
from wearsim.results.run import RunData


def write_results(
    path: str | Path, data: RunData | DissipationData, storage: Storage = DISK
) -> None:
    """Write a results file, replacing an existing one.

    Parameters
    ----------
    path : str or Path
        The file.
    data : RunData or DissipationData
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
