"""Variables of an ensemble, read from its file and its parts when they are needed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from wearsim.results.ensemble.schema import is_row
from wearsim.results.schema import Schema

if TYPE_CHECKING:
    import h5py

    from wearsim.results.ensemble.parts import Part

    Array = npt.NDArray[Any]


class Reader(Protocol):
    """A function that opens a file and returns what another function takes from it."""

    def __call__(self, take: Callable[[h5py.File], Array]) -> Array:
        """Return what `take` reads from the open file."""


class StoredRows(Mapping[str, "Array"]):
    """Variables of an ensemble by name; there may be gigabytes.

    Parameters
    ----------
    read : Reader
        Access to the file of the ensemble.
    schema : Schema
        Its schema.
    parts : list of Part
        Its parts, oldest first. A row in a later one counts.
    """

    def __init__(self, read: Reader, schema: Schema, parts: list[Part]) -> None:
        self._read, self._schema, self.parts = read, schema, parts

    def __len__(self) -> int:
        return len(self._schema.variables)

    def __iter__(self) -> Iterator[str]:
        return iter(self._schema.variables)

    def __contains__(self, name: object) -> bool:
        return name in self._schema.variables

    def __getitem__(self, name: str) -> Array:
        return self.rows(name, 0, None)

    def rows(self, name: str, start: int, stop: int | None, *rest: slice) -> Array:
        """Return some rows of a variable, and read no others.

        Parameters
        ----------
        name : str
            The variable.
        start, stop : int
            The first row, and the one after the last; None for all that follow.
        *rest : slice
            The entries of each row along further axes, by default all.

        Returns
        -------
        ndarray

        Raises
        ------
        ResultsFileError
            If the file or a part is damaged, or was changed since it was opened.
        """
        found = self._read(lambda file: np.asarray(file[name][(slice(start, stop), *rest)]))
        if is_row(self._schema.variables[name]):
            for part in self.parts:
                part.put_rows(found, name, start, *rest)
        return found
