"""Files written whole or not at all: a kill at any moment leaves the old one or the new one."""

from __future__ import annotations

from pathlib import Path

from wearsim.results.dissipation.data import DissipationData
from wearsim.results.io.atomic_write import write_whole
from wearsim.results.run.data import RunData


def write_results(path: str | Path, data: RunData | DissipationData) -> None:
    """Write a results file, in place of any that stands there.

    Parameters
    ----------
    path : str or Path
        The file.
    data : RunData or DissipationData
        What it shall hold.

    Raises
    ------
    ResultsFileError
        If it cannot be written; a file that stood there is untouched.
    ValueError
        If the variables are not those of the layout, or do not fit together.
    """
    from wearsim.results.io import hdf5_write  # noqa: PLC0415  (h5py takes 0.2 s to import)

    write_whole(path, hdf5_write.file_image(data.content))
