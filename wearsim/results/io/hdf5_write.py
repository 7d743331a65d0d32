"""Writing of HDF5 files in which every byte of data and metadata has a checksum of HDF5.

Arrays are stored in chunks with Fletcher-32 checksums, scalars in the object headers, which have
checksums since version 1.10 of the format.

The checksum of a chunk of zeros is zero, so that it would not show that a block of the file was
overwritten by zeros. An array that has such a chunk carries the attribute `ZEROS`; in others one is
damage.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from itertools import product
from pathlib import Path
from typing import IO, Any

import h5py
import numpy as np
from h5py import h5a, h5d, h5ds, h5f, h5fd, h5g, h5p, h5s, h5t

from wearsim.atomic_write import DISK, Storage, replacement
from wearsim.results.content import (
    ABOUT,
    CHECKPOINT,
    ERRORS,
    FILES,
    INPUTS,
    SCENARIO,
    ZEROS,
    Array,
    Arrays,
    Schema,
    StudyData,
    as_plain,
    axis_lengths,
    only_zeros,
)

#: Most rows of a chunk; who writes as many rows at a time writes each chunk once.
CHUNK_ROWS = 4096
_CHUNK_NUMBERS = 1 << 15

_LABEL_LENGTH = 1000  # an attribute holds 64 kB at most


class _File:
    """A file written by HDF5, which does not recover from errors of a write, even on closing.

    Only the first error is kept; what follows it is not written, and HDF5 does not notice.
    """

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self._place = self._size = 0  # [bytes]
        self.error: BaseException | None = None

    def tell(self) -> int:
        """Return the position, as a file."""
        return self._place

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Set the position, as a file."""
        self._place = offset + (0, self._place, self._size)[whence]  # from start, place or end
        return self._place

    def readinto(self, target: memoryview) -> int:
        """Read at the position, as a file."""
        return self._attempt(self._file.readinto, target, len(target))  # type: ignore[attr-defined]

    def write(self, content: memoryview) -> int:
        """Write at the position, as a file."""
        return self._attempt(self._file.write, content, len(content))

    def truncate(self, size: int) -> int:
        """Set the size, as a file."""
        self._place = self._size = size
        return self._attempt(self._file.truncate, size, 0)

    def flush(self) -> None:
        """Do nothing; the file is synchronised after HDF5 has closed it."""

    def raise_error(self) -> None:
        """Raise the first error of an operation, if there is one."""
        if self.error is not None:
            raise self.error

    def _attempt(self, operation: Callable[[Any], int], argument: object, count: int) -> int:
        """Call an operation at the present position unless one has failed before."""
        if self.error is None:
            try:
                if self._file.tell() != self._place:  # a change empties the buffer
                    self._file.seek(self._place)
                operation(argument)
            except BaseException as error:
                self.error = error
        self._place += count
        self._size = max(self._size, self._place)
        return count


@contextmanager
def new_file(
    path: str | Path, storage: Storage = DISK
) -> Iterator[tuple[h5py.File, Callable[[], None]]]:
    """Return an empty HDF5 file that replaces another at the end of the with statement.

    Parameters
    ----------
    path : str or Path
        The file to replace, which need not exist.
    storage : Storage
        File operations.

    Returns
    -------
    file : h5py.File
    check : callable
        Raises the error of a write, such as a full disk; else it is raised at the end.

    Raises
    ------
    ResultsFileError
        If it cannot be written; an existing file is then unchanged.
    """
    with replacement(path, storage) as stored:
        target = _File(stored)
        try:
            with _created(path, target) as file:
                yield file, target.raise_error
        finally:
            target.raise_error()  # the cause of what HDF5 may have raised


def _created(path: str | Path, target: _File) -> h5py.File:
    creation, access = h5p.create(h5p.FILE_CREATE), h5p.create(h5p.FILE_ACCESS)
    creation.set_link_creation_order(h5p.CRT_ORDER_TRACKED | h5p.CRT_ORDER_INDEXED)
    creation.set_obj_track_times(False)
    try:
        access.set_libver_bounds(h5f.LIBVER_V110, h5f.LIBVER_V110)
        access.set_fclose_degree(h5f.CLOSE_STRONG)
        access.set_fileobj_driver(h5fd.fileobj_driver, target)
        name = str(path).encode("utf-8", ERRORS)
        return h5py.File(h5f.create(name, h5f.ACC_TRUNC, creation, access))
    finally:
        access.close()  # HDF5 crashes at the end of the process if it still refers to an object


def put_variables(
    file: h5py.File, schema: Schema, variables: Arrays, reserved: Arrays | None = None
) -> None:
    """Write axes and variables.

    Parameters
    ----------
    file : h5py.File
        An empty file.
    schema : Schema
        Axes and variables of the file.
    variables : dict of str to ndarray
        Variables by name.
    reserved : dict of str to ndarray, optional
        Those of which only shape and type are described; their rows are written later.

    Raises
    ------
    ValueError
        If the variables differ from the schema, or their shapes are inconsistent.
    """
    arrays = variables | (reserved or {})
    lengths = axis_lengths({n: a.shape for n, a in arrays.items()}, schema.variables)
    scales: dict[str, h5d.DatasetID] = {}
    datasets: dict[str, h5d.DatasetID] = {}
    for axis in schema.axes.values():
        numbers = np.arange(axis.first, axis.first + lengths[axis.name])
        scales[axis.name] = put_array(file, axis.name, numbers)
        put_labels(scales[axis.name], units="1", long_name=axis.long_name)
    for name, variable in schema.variables.items():
        # those that are described only have the fill value until they are written
        put = put_array if name in variables else _put_dataset
        dataset = put(file, name, arrays[name])
        put_labels(dataset, units=variable.unit, long_name=variable.long_name)
        (scales if variable.dims == (name,) else datasets)[name] = dataset
    for name, scale in scales.items():
        h5ds.set_scale(scale, name.encode())
    for name, dataset in datasets.items():
        for position, dim in enumerate(schema.variables[name].dims):
            h5ds.attach_scale(dataset, scales[dim], position)


def put_texts(
    file: h5py.File, schema: Schema, data: StudyData, checkpoint: Arrays | None = None
) -> None:
    """Write everything except variables.

    Short values are also written as HDF5 attributes, for other programs.

    Parameters
    ----------
    file : h5py.File
        The file.
    schema : Schema
        Its format.
    data : StudyData
        Attributes and texts.
    checkpoint : dict of str to ndarray, optional
        State for resuming.
    """
    put_labels(file.id, **data.labels)
    inputs = _put_group(file, INPUTS)
    put_text(inputs, SCENARIO, data.scenario_text)
    put_text(inputs, ABOUT, json.dumps(data.attributes, default=as_plain))
    put_text(inputs, FILES, json.dumps(data.files))
    group = _put_group(file, CHECKPOINT)
    for name, array in (checkpoint or {}).items():
        put_array(group, name, array)


def _put_group(parent: h5py.Group, name: str) -> h5py.Group:
    """Return a new group without time stamps."""
    creation = h5p.create(h5p.GROUP_CREATE)
    creation.set_obj_track_times(False)
    return h5py.Group(h5g.create(parent.id, name.encode(), gcpl=creation))


def put_text(group: h5py.Group, name: str, text: str) -> None:
    """Write a text of up to 4 GB."""
    put_array(group, name, _text(text)[None])


def put_array(group: h5py.Group, name: str, array: Array) -> h5d.DatasetID:
    """Write an array with checksums.

    Raises
    ------
    ValueError
        If it holds neither numbers nor texts of fixed length.
    """
    array = np.asarray(array, order="C")
    if array.dtype.kind not in "biufS":
        raise ValueError(f"an array of {array.dtype} cannot be stored")
    dataset = _put_dataset(group, name, array)
    if array.size:
        dataset.write(h5s.ALL, h5s.ALL, array, _kind_of(array.dtype))
        if array.ndim:
            _mark_zeros(dataset, 0, array)
    return dataset


def _put_dataset(group: h5py.Group, name: str, like: Array) -> h5d.DatasetID:
    """Create a dataset with the shape and type of an array, of which nothing is written.

    With h5py.Group.create_dataset, for all kinds of datasets, a file takes a fifth longer to write.
    """
    creation = h5p.create(h5p.DATASET_CREATE)
    creation.set_obj_track_times(False)
    if like.ndim == 0:  # there are no chunks, and no checksums outside the object header
        creation.set_layout(h5d.COMPACT)
    elif like.size:
        creation.set_chunk(_chunks_of(like.shape))
        creation.set_fletcher32()
        if like.dtype.kind == "f":
            creation.set_fill_value(np.array(np.nan))
    kind, space = _kind_of(like.dtype), h5s.create_simple(like.shape)
    return h5d.create(group.id, name.encode(), kind, space, creation)


def put_rows(dataset: h5py.Dataset, start: int, rows: Array) -> None:
    """Write consecutive rows of a dataset that is described only."""
    dataset[start : start + len(rows)] = rows
    _mark_zeros(dataset.id, start, rows)


def _mark_zeros(dataset: h5d.DatasetID, start: int, rows: Array) -> None:
    """Mark a dataset if one of the chunks that rows were written to has zeros only."""
    lengths, marked = _chunks_of(dataset.shape), ZEROS.encode()
    firsts = [
        range(-(start % lengths[0]), len(rows), lengths[0]),
        *(range(0, n, step) for n, step in zip(rows.shape[1:], lengths[1:], strict=True)),
    ]
    for corner in product(*firsts):
        chunk = (slice(max(c, 0), c + length) for c, length in zip(corner, lengths, strict=True))
        if only_zeros(rows[tuple(chunk)]):
            if not h5a.exists(dataset, marked):
                put_labels(dataset, **{ZEROS: 1})
            return


def _chunks_of(shape: tuple[int, ...]) -> tuple[int, ...]:
    """Return the lengths of the chunks of an array."""
    left, chunks = _CHUNK_NUMBERS, []
    for length, most in zip(shape, (CHUNK_ROWS, *shape[1:]), strict=True):
        chunks.append(max(min(length, most, left), 1))
        left //= chunks[-1]
    return tuple(chunks)


def put_labels(
    item: h5d.DatasetID | h5g.GroupID, **labels: str | float | np.number[Any] | np.bool_
) -> None:
    """Write short texts and numbers as attributes."""
    space = h5s.create(h5s.SCALAR)
    for name, value in labels.items():
        number = int(value) if isinstance(value, bool | np.bool_) else value  # netCDF has no bools
        content = _text(value[:_LABEL_LENGTH]) if isinstance(value, str) else np.asarray(number)
        kind = _kind_of(content.dtype)
        h5a.create(item, name.encode(), kind, space).write(content, kind)


def _kind_of(dtype: np.dtype[Any]) -> h5t.TypeID:
    """Return the type in the file of a type of numpy."""
    return _kind(dtype.str, dtype.metadata is not None)


@cache
def _kind(name: str, is_unicode: bool) -> h5t.TypeID:
    kind = np.dtype(name)
    utf8 = h5py.string_dtype("utf-8", kind.itemsize)
    return h5t.py_create(utf8 if is_unicode else kind, logical=True)


def _text(text: str) -> Array:
    """Return a text as an array of fixed length with a final zero, which needs no heap."""
    content = text.encode("utf-8", ERRORS) + b"\0"
    return np.array(content, h5py.string_dtype("utf-8", len(content)))
