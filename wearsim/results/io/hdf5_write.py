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
from pathlib import Path
from typing import IO, Any

import h5py
import numpy as np
from h5py import h5d, h5f, h5fd, h5g, h5p, h5s, h5t

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
        start = {io.SEEK_SET: 0, io.SEEK_CUR: self._place, io.SEEK_END: self._size}[whence]
        self._place = start + offset
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
    lengths = axis_lengths(arrays, schema.variables)
    scales: dict[str, h5py.Dataset] = {}
    datasets: dict[str, h5py.Dataset] = {}
    for axis in schema.axes.values():
        numbers = np.arange(axis.first, axis.first + lengths[axis.name])
        scales[axis.name] = put_array(file, axis.name, numbers)
        put_labels(scales[axis.name], units="1", long_name=axis.long_name)
    for name, variable in schema.variables.items():
        if name in variables:
            dataset = put_array(file, name, arrays[name])
        else:  # described only: values that are not written are the fill value
            like = arrays[name]
            dataset = file.create_dataset(name, like.shape, like.dtype, **_stored_as(like))
        put_labels(dataset, units=variable.unit, long_name=variable.long_name)
        (scales if variable.dims == (name,) else datasets)[name] = dataset
    for name, scale in scales.items():
        scale.make_scale(name)
    for name, dataset in datasets.items():
        for position, dim in enumerate(schema.variables[name].dims):
            dataset.dims[position].attach_scale(scales[dim])


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
    put_labels(file, **data.labels)
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
    group.create_dataset(name, data=[_text(text)], chunks=(1,), fletcher32=True)


def put_array(group: h5py.Group, name: str, array: Array) -> h5py.Dataset:
    """Write an array with checksums.

    Raises
    ------
    ValueError
        If it holds neither numbers nor texts of fixed length.
    """
    array = np.asarray(array)
    if array.dtype.kind not in "biufS":
        raise ValueError(f"an array of {array.dtype} cannot be stored")
    if array.ndim == 0:  # there are no chunks, and no checksums outside the object header
        creation = h5p.create(h5p.DATASET_CREATE)
        creation.set_layout(h5d.COMPACT)
        creation.set_obj_track_times(False)
        kind, space = h5t.py_create(array.dtype, logical=True), h5s.create(h5s.SCALAR)
        dataset = h5py.Dataset(h5d.create(group.id, name.encode(), kind, space, creation))
        dataset[()] = array
        return dataset
    if array.size == 0:
        return group.create_dataset(name, data=array)
    dataset = group.create_dataset(name, data=array, **_stored_as(array))
    _mark_zeros(dataset, 0, array)
    return dataset


def put_rows(dataset: h5py.Dataset, start: int, rows: Array) -> None:
    """Write consecutive rows of a dataset that is described only."""
    dataset[start : start + len(rows)] = rows
    _mark_zeros(dataset, start, rows)


def _mark_zeros(dataset: h5py.Dataset, start: int, rows: Array) -> None:
    """Mark a dataset if one of the chunks that rows were written to has zeros only."""
    chosen = (slice(start, start + len(rows)), *map(slice, [0] * (rows.ndim - 1), rows.shape[1:]))
    for first, *others in dataset.iter_chunks(chosen):
        if only_zeros(rows[(slice(first.start - start, first.stop - start), *others)]):
            dataset.attrs[ZEROS] = 1
            return


def _stored_as(array: Array) -> dict[str, Any]:
    """Return chunks, filters and fill value of an array."""
    left, chunks = _CHUNK_NUMBERS, []
    for length, most in zip(array.shape, (CHUNK_ROWS, *array.shape[1:]), strict=True):
        chunks.append(max(min(length, most, left), 1))
        left //= chunks[-1]
    return {
        "chunks": tuple(chunks),
        "fletcher32": True,
        "fillvalue": np.nan if array.dtype.kind == "f" else None,
    }


def put_labels(
    item: h5py.File | h5py.Dataset, **labels: str | float | np.number[Any] | np.bool_
) -> None:
    """Write short texts and numbers as attributes."""
    for name, value in labels.items():
        if isinstance(value, str):
            item.attrs[name] = _text(value[:_LABEL_LENGTH])
        else:
            is_bool = isinstance(value, bool | np.bool_)  # netCDF has none
            item.attrs[name] = int(value) if is_bool else value


def _text(text: str) -> Array:
    """Return a text as an array of fixed length with a final zero, which needs no heap."""
    content = text.encode("utf-8", ERRORS) + b"\0"
    return np.array(content, h5py.string_dtype("utf-8", len(content)))
