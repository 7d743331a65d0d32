"""Results as datasets of xarray and tables of pandas, in SI."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from wearsim.errors import optional_library

if TYPE_CHECKING:
    import pandas
    import xarray


def as_dataset(
    schema: Any, variables: Mapping[str, Any], labels: Mapping[str, Any]
) -> xarray.Dataset:
    """Return variables with their axes, as xarray reads them from a results file.

    Parameters
    ----------
    schema : Schema
        Axes and variables of the file.
    variables : mapping of str to ndarray
        Variables by name.
    labels : mapping of str to object
        Attributes of the dataset.
    """
    data = {
        name: (
            item.dims,
            np.asarray(variables[name]),
            {"units": item.unit, "long_name": item.long_name},
        )
        for name, item in schema.variables.items()
    }
    lengths = {
        dim: n for dims, array, _ in data.values() for dim, n in zip(dims, array.shape, strict=True)
    }
    axes = {
        axis.name: (
            axis.name,
            np.arange(axis.first, axis.first + lengths[axis.name]),
            {"units": "1", "long_name": axis.long_name},
        )
        for axis in schema.axes.values()
    }
    return cast("xarray.Dataset", _library("xarray").Dataset({**axes, **data}, attrs=dict(labels)))


def dataset_of(
    variables: Mapping[str, tuple[tuple[str, ...], Any]], axes: Mapping[str, list[str]]
) -> xarray.Dataset:
    """Return arrays with the names of their axes as a dataset of xarray."""
    return cast("xarray.Dataset", _library("xarray").Dataset(dict(variables), coords=dict(axes)))


def concatenated(
    datasets: Sequence[xarray.Dataset], name: str, values: Sequence[Any], unit: str
) -> xarray.Dataset:
    """Return datasets along a new coordinate with one value for each, in a unit.

    Attributes are kept where they are equal.
    """
    library = _library("xarray")
    coordinate = library.IndexVariable(name, list(values), {"units": unit} if unit else {})
    return cast(
        "xarray.Dataset",
        library.concat(
            list(datasets), coordinate, join="outer", data_vars="all",
            combine_attrs="drop_conflicts",
        ),
    )  # fmt: skip


def as_frame(
    columns: Iterable[tuple[str, str, Any]], axis: str, numbers: Iterable[int]
) -> pandas.DataFrame:
    """Return columns as a table.

    Parameters
    ----------
    columns : iterable of (str, str, ndarray)
        Name, unit and values; an array with one column per roller becomes as many columns, "name.1"
        for the first one.
    axis : str
        Name of the rows.
    numbers : iterable of int
        Number of each row.
    """
    arrays: dict[str, Any] = {}
    units: dict[str, str] = {}
    for name, unit, values in columns:
        several = enumerate(values.T, 1) if np.ndim(values) > 1 else ()
        parts = {f"{name}.{number}": part for number, part in several} or {name: values}
        arrays |= parts
        units |= dict.fromkeys(parts, unit)
    library = _library("pandas")
    frame: pandas.DataFrame = library.DataFrame(
        arrays, index=library.Index(list(numbers), name=axis)
    )
    frame.attrs["units"] = units
    return frame


def _library(name: str) -> Any:
    text = f"{name} is not installed; install it with: pip install 'wearsim[data]'"
    return optional_library(name, ModuleNotFoundError(text, name=name))
