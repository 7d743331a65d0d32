"""The pieces of an open HDF5 file, as `hdf5` wrote them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from h5py import h5d, h5s

from wearsim.results.content import Arrays
from wearsim.results.io.hdf5_write import ERRORS


@dataclass(frozen=True)
class Extent:
    """Where an array stands in a file.

    Parameters
    ----------
    offset : int
        Bytes before it.
    shape : tuple of int
        Its length along each axis.
    dtype : dtype
        The type of its numbers, or texts of fixed length.
    """

    offset: int
    shape: tuple[int, ...]
    dtype: np.dtype[Any]

    @property
    def row_shape(self) -> tuple[int, ...]:
        """Length along each axis but the first."""
        return self.shape[1:]

    @property
    def row_bytes(self) -> int:
        """Bytes of all that has one number along the first axis."""
        return math.prod(self.row_shape) * self.dtype.itemsize

    def at(self, row: int) -> int:
        """Return how many bytes stand before a row.

        Parameters
        ----------
        row : int
            Its number along the first axis.
        """
        return self.offset + row * self.row_bytes


@contextmanager
def opened(path: Path) -> Iterator[h5py.File]:
    """Open an HDF5 file for reading; no lock is needed, since its structure never changes.

    Parameters
    ----------
    path : Path
        The file.

    Raises
    ------
    OSError
        If it is not HDF5, or truncated.
    """
    with h5py.File(path, "r", locking=False) as file:
        yield file


def get_text(dataset: h5py.Dataset) -> str:
    """Return a text that `hdf5` wrote.

    Parameters
    ----------
    dataset : h5py.Dataset
        Where it stands.
    """
    kind = dataset.id.get_type()
    content = np.empty((), f"S{kind.get_size()}")
    dataset.id.read(h5s.ALL, h5s.ALL, content, kind)
    return content.tobytes()[:-1].decode("utf-8", ERRORS)  # to the byte, where h5py strips zeros


def get_label(item: h5py.Dataset | h5py.Group, name: str) -> str:
    """Return a text attribute that `hdf5` wrote.

    Parameters
    ----------
    item : h5py.Dataset or h5py.Group
        What it belongs to.
    name : str
        Its name.
    """
    content = item.attrs[name]
    return content if isinstance(content, str) else bytes(content).decode("utf-8", ERRORS)


def get_arrays(group: h5py.Group) -> Arrays:
    """Return all arrays of a group by name, with their types.

    Parameters
    ----------
    group : h5py.Group
        The group; what else it holds is left out.
    """
    items = group.items()
    return {name: np.asarray(item[()]) for name, item in items if isinstance(item, h5py.Dataset)}


def extents(group: h5py.Group, names: Iterable[str]) -> dict[str, Extent]:
    """Return where arrays stand in a file.

    Parameters
    ----------
    group : h5py.Group
        What holds them, such as the file itself.
    names : iterable of str
        The arrays.

    Raises
    ------
    ValueError
        If one does not stand there in one piece.
    """
    return {name: _extent(group[name]) for name in names}


def _extent(dataset: h5py.Dataset) -> Extent:
    creation = dataset.id.get_create_plist()
    offset = dataset.id.get_offset()
    if creation.get_layout() != h5d.CONTIGUOUS or (offset is None and dataset.size):
        raise ValueError(f"{dataset.name} is not in one piece, as after h5repack")
    return Extent(offset or 0, dataset.shape, dataset.dtype)
