"""Atomic writing of results files: after a kill either the old or the new file is complete."""

from __future__ import annotations

from pathlib import Path

from wearsim.results.dissipation.data import DissipationData
from wearsim.results.io.atomic_write import write_pieces
from wearsim.results.run.data import RunData


def write_results(path: str | Path, data: RunData | DissipationData) -> None:
    """Write a results file, replacing an existing one.

    Parameters
    ----------
    path : str or Path
        The file.
    data : RunData or DissipationData
        Content of the file.

    Raises
    ------
    ResultsFileError
        If it cannot be written; an existing file is then unchanged.
    ValueError
        If the variables are not those of the schema, or their shapes are inconsistent.
    """
    from wearsim.results.io import hdf5_write  # noqa: PLC0415  (h5py takes 0.2 s to import)

    write_pieces(path, [(0, hdf5_write.file_image(data.content))])
