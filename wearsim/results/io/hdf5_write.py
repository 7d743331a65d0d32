"""Content of a results file as HDF5, written to memory."""

from __future__ import annotations

import io
import itertools
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
from h5py import h5a, h5d, h5ds, h5f, h5fd, h5g, h5p, h5s, h5t

from wearsim.results.content import Content, as_plain
from wearsim.results.schema import axis_lengths

_PAGE = 1 << 16


class SparseImage:
    """In-memory file without storage for holes, with the file methods that HDF5 calls.

    The image is then written to the disk without HDF5, which does not recover from a full disk.
    """

    def __init__(self) -> None:
        self._pages: dict[int, bytearray] = {}
        self._place = 0
        self.size = 0  # in bytes, holes included

    def pieces(self) -> Iterator[tuple[int, bytes]]:
        """Yield the written bytes, each piece with its offset."""
        for number in sorted(self._pages):
            start = number * _PAGE
            yield start, bytes(self._pages[number][: self.size - start])

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Set the position, as a file."""
        start = {io.SEEK_SET: 0, io.SEEK_CUR: self._place, io.SEEK_END: self.size}[whence]
        self._place = start + offset
        return self._place

    def tell(self) -> int:
        """Return the position, as a file."""
        return self._place

    def truncate(self, size: int) -> int:
        """Set the size, as a file."""
        self.size = size
        return size

    def flush(self) -> None:
        """Do nothing, since there is no disk."""

    def write(self, content: bytes | memoryview) -> int:
        """Write at the position, as a file."""
        view = memoryview(content).cast("B")
        for page, inside, done in self._spans(len(view)):
            piece = view[done : done + _PAGE - inside]
            self._pages.setdefault(page, bytearray(_PAGE))[inside : inside + len(piece)] = piece
        self._place += len(view)
        self.size = max(self.size, self._place)
        return len(view)

    def readinto(self, target: memoryview) -> int:
        """Read at the position, as a file."""
        view = memoryview(target).cast("B")
        for page, inside, done in self._spans(len(view)):
            piece = self._pages.get(page, bytes(_PAGE))[inside : inside + len(view) - done]
            view[done : done + len(piece)] = piece
        self._place += len(view)
        return len(view)

    def _spans(self, count: int) -> Iterator[tuple[int, int, int]]:
        """Yield page number, offset in the page and bytes done, for bytes at the position."""
        done = 0
        while done < count:
            page, inside = divmod(self._place + done, _PAGE)
            yield page, inside, done
            done += _PAGE - inside


CHECKPOINT, INPUTS, ABOUT, SCENARIO, FILES = "checkpoint", "inputs", "about", "scenario", "files"

ERRORS = "surrogatepass"  # so that every Python string can be stored

_LABEL_LENGTH = 1000  # an attribute holds 64 kB at most

_SCALAR = h5s.create(h5s.SCALAR)

_number = itertools.count()


def file_image(content: Content) -> bytes:
    """Return the bytes of a results file.

    Parameters
    ----------
    content : Content
        Content of the file.

    Returns
    -------
    bytes

    Raises
    ------
    ValueError
        If the variables are not those of the schema, or their shapes are inconsistent.
    """
    access = h5p.create(h5p.FILE_ACCESS)
    access.set_fapl_core(1 << 20, False)
    name = f"wearsim-{os.getpid()}-{next(_number)}"  # the image stays in memory
    with _new_file(name.encode(), access) as file:
        _put_content(file, content)
        h5f.flush(file)
        return bytes(file.get_file_image())


def sparse_image(content: Content) -> SparseImage:
    """Return a results file whose reserved variables are holes, so that it may have any size.

    Every variable is contiguous, at the offset returned by `hdf5_read.extents`, so that its rows
    can be written later by plain writes, which leave the HDF5 structure unchanged.

    Parameters
    ----------
    content : Content
        Content of the file.

    Returns
    -------
    SparseImage

    Raises
    ------
    ValueError
        If the variables are not those of the schema, or their shapes are inconsistent.
    """
    image = SparseImage()
    access = h5p.create(h5p.FILE_ACCESS)
    access.set_fileobj_driver(h5fd.fileobj_driver, image)
    with _new_file(b"sparse", access) as file:
        _put_content(file, content)
    return image


@contextmanager
def _new_file(name: bytes, access: Any) -> Iterator[Any]:
    access.set_fclose_degree(h5f.CLOSE_STRONG)
    creation = h5p.create(h5p.FILE_CREATE)
    creation.set_link_creation_order(h5p.CRT_ORDER_TRACKED | h5p.CRT_ORDER_INDEXED)
    creation.set_obj_track_times(False)
    file = h5f.create(name, h5f.ACC_TRUNC, creation, access)
    try:
        yield file
    finally:
        file.close()


def _put_content(file: Any, content: Content) -> None:
    lengths = axis_lengths(content.variables, content.schema.variables)
    _put_labels(file, content)
    _put_variables(file, content, lengths)
    _put_inputs(_group(file, INPUTS), content)
    checkpoint = _group(file, CHECKPOINT)
    for name, array in content.checkpoint.items():
        _put_array(checkpoint, name, array)


def _put_labels(file: Any, content: Content) -> None:
    """Write short values as HDF5 attributes for other programs; wearsim reads them from JSON."""
    _put_attribute(file, "format", content.schema.format)
    _put_attribute(file, "format_version", content.schema.version)
    for name, value in content.attributes.items():
        if isinstance(value, str):
            _put_attribute(file, name, value[:_LABEL_LENGTH])
        elif isinstance(value, int | float | np.number | np.bool_):
            is_bool = isinstance(value, bool | np.bool_)
            _put_attribute(file, name, int(value) if is_bool else value)  # netCDF has no booleans


def _put_variables(file: Any, content: Content, lengths: Mapping[str, int]) -> None:
    schema = content.schema
    scales: dict[str, Any] = {}
    datasets: dict[str, Any] = {}
    for axis in schema.axes.values():
        numbers = np.arange(axis.first, axis.first + lengths[axis.name])
        scales[axis.name] = _put_array(
            file, axis.name, numbers, units="1", long_name=axis.long_name
        )
    for name, variable in schema.variables.items():
        dataset = _put_array(
            file,
            name,
            content.variables[name],
            name in content.reserved,
            units=variable.unit,
            long_name=variable.long_name,
        )
        (scales if variable.dims == (name,) else datasets)[name] = dataset
    for name, scale in scales.items():
        h5ds.set_scale(scale, name.encode())
    for name, dataset in datasets.items():
        for position, dim in enumerate(schema.variables[name].dims):
            h5ds.attach_scale(dataset, scales[dim], position)


def _put_inputs(group: Any, content: Content) -> None:
    _put_array(group, SCENARIO, _text(content.scenario_text))
    _put_array(group, ABOUT, _text(json.dumps(content.attributes, default=as_plain)))
    files = _group(group, FILES)
    for number, (path, text) in enumerate(content.files.items()):
        _put_array(files, str(number), _text(text), path=path)


def _group(group: Any, name: str) -> Any:
    creation = h5p.create(h5p.GROUP_CREATE)
    creation.set_obj_track_times(False)
    return h5g.create(group, name.encode(), gcpl=creation)


def _put_array(
    group: Any, name: str, array: npt.NDArray[Any], reserved: bool = False, **labels: str
) -> Any:
    """Write an array, or only allocate its space, which leaves a hole in the file."""
    kind = _type_of(array.dtype)
    space = h5s.create_simple(array.shape) if array.ndim else _SCALAR
    dataset = h5d.create(group, name.encode(), kind, space, _creation(reserved))
    if array.size and not reserved:
        dataset.write(h5s.ALL, h5s.ALL, np.asarray(array, order="C"), kind)
    for label, text in labels.items():
        _put_attribute(dataset, label, text)
    return dataset


def _put_attribute(target: Any, name: str, value: object) -> None:
    content = _text(value) if isinstance(value, str) else np.asarray(value)
    kind = _type_of(content.dtype)
    h5a.create(target, name.encode(), kind, _SCALAR).write(content, kind)


def _text(text: str) -> npt.NDArray[Any]:
    """Return a text as an array of fixed length, which needs no heap and may have up to 4 GB."""
    content = text.encode("utf-8", ERRORS)
    return np.array(content, f"S{len(content) + 1}")


@lru_cache(maxsize=256)
def _type_of(dtype: np.dtype[Any]) -> Any:
    if dtype.kind == "S":
        kind = h5t.C_S1.copy()
        kind.set_size(dtype.itemsize)
        kind.set_cset(h5t.CSET_UTF8)
        kind.set_strpad(h5t.STR_NULLTERM)
        return kind
    if dtype.kind not in "biuf":
        raise ValueError(f"an array of {dtype} cannot be stored")
    return h5t.py_create(dtype, logical=True)


@lru_cache(maxsize=2)
def _creation(reserved: bool) -> Any:
    creation = h5p.create(h5p.DATASET_CREATE)
    creation.set_obj_track_times(False)
    if reserved:
        creation.set_alloc_time(h5d.ALLOC_TIME_EARLY)
        creation.set_fill_time(h5d.FILL_TIME_NEVER)
    return creation
