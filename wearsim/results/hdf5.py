"""The only module that speaks HDF5: the image of a file, and the pieces of an open one.

The image is made through h5py's low-level calls, which are three times as quick as its objects.
It depends on the content alone (no time stamps), so that equal runs give equal files.
"""

from __future__ import annotations

import itertools
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt
from h5py import h5a, h5d, h5ds, h5f, h5g, h5p, h5s, h5t

from wearsim.results.content import Arrays, Content, as_plain
from wearsim.results.layout import Layout, axis_lengths

SIGNATURE = b"\x89HDF\r\n\x1a\n"
CHECKPOINT, INPUTS, ABOUT, SCENARIO, FILES = "checkpoint", "inputs", "about", "scenario", "files"

_ERRORS = "surrogatepass"  # so that every Python string comes back as it was
_LABEL_LENGTH = 1000  # an attribute holds 64 kB at most
_SCALAR = h5s.create(h5s.SCALAR)
_ORDERED = h5p.CRT_ORDER_TRACKED | h5p.CRT_ORDER_INDEXED
_number = itertools.count()


def file_image(content: Content) -> bytes:
    """Return the bytes of a results file.

    Parameters
    ----------
    content : Content
        What it shall hold.

    Returns
    -------
    bytes

    Raises
    ------
    ValueError
        If the variables are not those of the layout, or do not fit together.
    """
    layout, variables = content.layout, content.variables
    lengths = axis_lengths(variables, layout.variables)
    file = _memory_file()
    try:
        _put_labels(file, content)
        _put_variables(file, variables, layout, lengths)
        _put_inputs(h5g.create(file, INPUTS.encode()), content)
        checkpoint = h5g.create(file, CHECKPOINT.encode())
        for name, array in content.checkpoint.items():
            _put_array(checkpoint, name, array)
        h5f.flush(file)
        image: bytes = file.get_file_image()
    finally:
        file.close()
    return image


def _memory_file() -> Any:
    access = h5p.create(h5p.FILE_ACCESS)
    access.set_fapl_core(1 << 20, False)
    access.set_fclose_degree(h5f.CLOSE_STRONG)
    creation = h5p.create(h5p.FILE_CREATE)
    creation.set_link_creation_order(_ORDERED)
    name = f"wearsim-{os.getpid()}-{next(_number)}"  # of no file: the image stays in memory
    return h5f.create(name.encode(), h5f.ACC_TRUNC, creation, access)


def _put_labels(file: Any, content: Content) -> None:
    """Write what a person, or xarray, should see first; it is read back from the texts."""
    _put_attribute(file, "format", content.layout.format)
    _put_attribute(file, "format_version", content.layout.version)
    for name, value in content.about.items():
        if isinstance(value, str):
            _put_attribute(file, name, value[:_LABEL_LENGTH])
        elif isinstance(value, bool | np.bool_):
            _put_attribute(file, name, int(value))  # netCDF has no booleans
        elif isinstance(value, int | float | np.number):
            _put_attribute(file, name, value)


def _put_variables(
    file: Any, variables: Arrays, layout: Layout, lengths: Mapping[str, int]
) -> None:
    scales = {}
    for axis in layout.axes.values():
        numbers = np.arange(axis.first, axis.first + lengths[axis.name])
        scales[axis.name] = _put_described(file, axis.name, numbers, "1", axis.long_name)
    datasets = {}
    for name, variable in layout.variables.items():
        datasets[name] = _put_described(
            file, name, variables[name], variable.unit, variable.long_name
        )
    scales["y"] = datasets.pop("y")
    for name, scale in scales.items():
        h5ds.set_scale(scale, name.encode())
    for name, dataset in datasets.items():
        for position, dim in enumerate(layout.variables[name].dims):
            h5ds.attach_scale(dataset, scales[dim], position)


def _put_inputs(group: Any, content: Content) -> None:
    _put_text(group, SCENARIO, content.scenario_text)
    _put_text(group, ABOUT, json.dumps(content.about, default=as_plain))
    files = h5g.create(group, FILES.encode())
    for number, (path, text) in enumerate(content.files.items()):
        _put_attribute(_put_text(files, str(number), text), "path", path)


def _put_described(file: Any, name: str, array: npt.NDArray[Any], unit: str, what: str) -> Any:
    dataset = _put_array(file, name, array)
    _put_attribute(dataset, "units", unit)
    _put_attribute(dataset, "long_name", what)
    return dataset


def _put_array(group: Any, name: str, array: npt.NDArray[Any]) -> Any:
    array = np.asarray(array, order="C")
    space = h5s.create_simple(array.shape) if array.ndim else _SCALAR
    dataset = h5d.create(group, name.encode(), _type_of(array.dtype), space, _creation())
    if array.size:
        dataset.write(h5s.ALL, h5s.ALL, array)
    return dataset


def _put_text(group: Any, name: str, text: str) -> Any:
    content, kind = _text(text)
    dataset = h5d.create(group, name.encode(), kind, _SCALAR, _creation())
    dataset.write(h5s.ALL, h5s.ALL, content, kind)
    return dataset


def _put_attribute(target: Any, name: str, value: object) -> None:
    if isinstance(value, str):
        content, kind = _text(value)
    else:
        content = np.asarray(value)
        kind = _type_of(content.dtype)
    h5a.create(target, name.encode(), kind, _SCALAR).write(content, kind)


def _text(text: str) -> tuple[npt.NDArray[Any], Any]:
    """Return a text as an array and its HDF5 type, of fixed length: no heap, no limit but 4 GB."""
    content = text.encode("utf-8", _ERRORS)
    size = len(content) + 1
    return np.array(content, f"S{size}"), _text_type(size)


@lru_cache(maxsize=256)
def _text_type(size: int) -> Any:
    kind = h5t.C_S1.copy()
    kind.set_size(size)
    kind.set_cset(h5t.CSET_UTF8)
    kind.set_strpad(h5t.STR_NULLTERM)
    return kind


@lru_cache(maxsize=256)
def _type_of(dtype: np.dtype[Any]) -> Any:
    if dtype.kind not in "biuf":
        raise ValueError(f"an array of {dtype} cannot be stored")
    return h5t.py_create(dtype, logical=True)


@lru_cache(maxsize=1)
def _creation() -> Any:
    creation = h5p.create(h5p.DATASET_CREATE)
    creation.set_obj_track_times(False)
    return creation


@contextmanager
def opened(path: Path) -> Iterator[h5py.File]:
    """Open an HDF5 file for reading; no lock is needed, since files are only ever replaced.

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
    """Return a text that `file_image` wrote.

    Parameters
    ----------
    dataset : h5py.Dataset
        Where it stands.
    """
    kind = dataset.id.get_type()
    content = np.empty((), f"S{kind.get_size()}")
    dataset.id.read(h5s.ALL, h5s.ALL, content, kind)
    return content.tobytes()[:-1].decode("utf-8", _ERRORS)  # to the byte, where h5py strips zeros


def get_label(item: h5py.Dataset | h5py.Group, name: str) -> str:
    """Return a text attribute that `file_image` wrote.

    Parameters
    ----------
    item : h5py.Dataset or h5py.Group
        What it belongs to.
    name : str
        Its name.
    """
    content = item.attrs[name]
    return content if isinstance(content, str) else bytes(content).decode("utf-8", _ERRORS)


def get_arrays(group: h5py.Group) -> Arrays:
    """Return all arrays of a group by name, with their types.

    Parameters
    ----------
    group : h5py.Group
        The group; what else it holds is left out.
    """
    items = group.items()
    return {name: np.asarray(item[()]) for name, item in items if isinstance(item, h5py.Dataset)}
