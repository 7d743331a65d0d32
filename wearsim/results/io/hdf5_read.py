"""Reading the items of an HDF5 file written by `hdf5_write`."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import h5py
import numpy as np
from h5py import h5d, h5s

from wearsim.results.content import Arrays
from wearsim.results.io.hdf5_write import ERRORS


@dataclass(frozen=True)
class Extent:
    """Position, shape and type of a contiguous array in a file.

    Parameters
    ----------
    offset : int
        Position of its first byte.
    shape : tuple of int
        Length of each axis.
    dtype : dtype
        Type of its numbers, or of texts of fixed length.
    """

    offset: int
    shape: tuple[int, ...]
    dtype: np.dtype[Any]

    @property
    def row_shape(self) -> tuple[int, ...]:
        """Length of each axis except the first."""
        return self.shape[1:]

    @property
    def row_bytes(self) -> int:
        """Size of one row along the first axis in bytes."""
        return math.prod(self.row_shape) * self.dtype.itemsize

    def at(self, row: int) -> int:
        """Return the position of a row in the file."""
        return self.offset + row * self.row_bytes


def get_text(dataset: h5py.Dataset) -> str:
    """Return a text dataset written by `hdf5_write`.

    Parameters
    ----------
    dataset : h5py.Dataset
        The dataset.

    Returns
    -------
    str
    """
    kind = dataset.id.get_type()
    content = np.empty((), f"S{kind.get_size()}")
    dataset.id.read(h5s.ALL, h5s.ALL, content, kind)
    return content.tobytes()[:-1].decode("utf-8", ERRORS)  # h5py would strip zeros


def get_label(item: h5py.Dataset | h5py.Group, name: str) -> str:
    """Return a text attribute written by `hdf5_write`.

    Parameters
    ----------
    item : h5py.Dataset or h5py.Group
        Owner of the attribute.
    name : str
        Name of the attribute.

    Returns
    -------
    str
    """
    content = item.attrs[name]
    return content if isinstance(content, str) else bytes(content).decode("utf-8", ERRORS)


def get_arrays(group: h5py.Group) -> Arrays:
    """Return all arrays of a group by name.

    Parameters
    ----------
    group : h5py.Group
        The group.

    Returns
    -------
    dict of str to ndarray
    """
    items = group.items()
    return {name: np.asarray(item[()]) for name, item in items if isinstance(item, h5py.Dataset)}


def extents(group: h5py.Group, names: Iterable[str]) -> dict[str, Extent]:
    """Return the positions of arrays in a file.

    Parameters
    ----------
    group : h5py.Group
        The group of the arrays, such as the file itself.
    names : iterable of str
        The arrays.

    Raises
    ------
    ValueError
        If an array is not contiguous.
    """
    return {name: _extent(group[name]) for name in names}


def _extent(dataset: h5py.Dataset) -> Extent:
    creation = dataset.id.get_create_plist()
    offset = dataset.id.get_offset()
    if creation.get_layout() != h5d.CONTIGUOUS or (offset is None and dataset.size):
        raise ValueError(f"{dataset.name} is not in one piece, as after h5repack")
    return Extent(offset or 0, dataset.shape, dataset.dtype)
