"""The arrays of an ensemble's file, read when they are asked for: there may be gigabytes."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from wearsim.errors import ResultsFileError
from wearsim.results.io.reader import truncated

if TYPE_CHECKING:
    from wearsim.results.io.hdf5_read import Extent

_BLOCK = 1 << 20  # bytes that are read at a time


class StoredArrays(Mapping[str, npt.NDArray[Any]]):
    """Arrays of a file by name, each read anew whenever it is asked for.

    Parameters
    ----------
    path : Path
        The file.
    identity : stat_result
        Of the file when it was opened, so that another in its place is told apart.
    extents : mapping of str to Extent
        Where each array stands.
    """

    def __init__(self, path: Path, identity: os.stat_result, extents: Mapping[str, Extent]) -> None:
        self._path = path
        self._identity = identity
        self.extents = extents

    def __len__(self) -> int:
        return len(self.extents)

    def __iter__(self) -> Iterator[str]:
        return iter(self.extents)

    def __contains__(self, name: object) -> bool:
        return name in self.extents

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        return self.rows(name, 0, self.extents[name].shape[0])

    def rows(self, name: str, start: int, stop: int) -> npt.NDArray[Any]:
        """Return some rows of an array, and read no others.

        Parameters
        ----------
        name : str
            The array.
        start, stop : int
            The first row, and the one after the last.

        Returns
        -------
        ndarray

        Raises
        ------
        ResultsFileError
            If the file cannot be read any more, or is another by now.
        """
        extent = self.extents[name]
        shape = (max(stop - start, 0), *extent.row_shape)
        count = math.prod(shape)
        try:
            with self._path.open("rb") as file:
                if not os.path.samestat(os.fstat(file.fileno()), self._identity):
                    raise ResultsFileError(f"{self._path}: was replaced by another; open it again")
                found = np.fromfile(file, extent.dtype, count, offset=extent.at(start))
        except OSError as error:
            raise ResultsFileError(f"{self._path}: cannot be read ({error.strerror})") from error
        if found.size != count:
            raise ResultsFileError(truncated(self._path))
        return found.reshape(shape)

    def columns(self, name: str, places: slice) -> npt.NDArray[Any]:
        """Return some entries of every row, with no more than a few rows read at a time.

        Parameters
        ----------
        name : str
            An array with two axes.
        places : slice
            Which entries.

        Returns
        -------
        ndarray
            Shape (rows, entries).
        """
        extent = self.extents[name]
        rows, width = extent.shape[0], len(range(*places.indices(extent.row_shape[0])))
        step = max(_BLOCK // extent.row_bytes, 1)
        found = np.empty((rows, width), extent.dtype)
        for start in range(0, rows, step):
            stop = min(start + step, rows)
            found[start:stop] = self.rows(name, start, stop)[:, places]
        return found
