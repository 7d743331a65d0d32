"""Outcomes of realisations as the rows of a file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from wearsim.results.content import Arrays
from wearsim.results.ensemble.data import Outcome
from wearsim.results.ensemble.schema import DONE, ERROR_BYTES, FAILED, is_row
from wearsim.results.schema import Schema

if TYPE_CHECKING:
    from wearsim.results.io.hdf5_read import Extent

_CUT = "…"  # ends a text that is too long


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of realisations that follow each other.

    Parameters
    ----------
    first : int
        Number of the first.
    status : ndarray
        DONE or FAILED of each.
    errors : ndarray
        Text of each, empty where it is done.
    arrays : dict of str to ndarray
        Their rows by variable; fewer where not all are kept.
    """

    first: int
    status: npt.NDArray[np.uint8]
    errors: npt.NDArray[np.bytes_]
    arrays: Arrays


def runs(outcomes: Sequence[Outcome]) -> Iterator[list[Outcome]]:
    """Yield outcomes in lists whose numbers follow each other, ascending.

    Parameters
    ----------
    outcomes : sequence of Outcome
        In any order.
    """
    run: list[Outcome] = []
    for outcome in sorted(outcomes, key=lambda outcome: outcome.number):
        if run and outcome.number != run[-1].number + 1:
            yield run
            run = []
        run.append(outcome)
    if run:
        yield run


def rows_of(run: Sequence[Outcome], schema: Schema, extents: Mapping[str, Extent]) -> Rows:
    """Return outcomes as the rows of a file.

    Parameters
    ----------
    run : sequence of Outcome
        Their numbers follow each other.
    schema : Schema
        Of the file.
    extents : mapping of str to Extent
        Where its variables stand.

    Returns
    -------
    Rows

    Raises
    ------
    ValueError
        If an outcome lacks a number, has one too many, or one of another shape.
    """
    first = run[0].number
    arrays = {
        name: np.full((len(run), *extents[name].row_shape), np.nan)
        for name, variable in schema.variables.items()
        if is_row(variable) and name not in {"status", "error"}
    }
    kept = extents["depth_profile"].shape[0]
    for place, outcome in enumerate(run):
        values = outcome.values
        unknown = sorted(values.keys() - arrays.keys())
        spared = {"depth_profile"} if outcome.number >= kept else set()
        missing = [] if outcome.error else sorted(arrays.keys() - values.keys() - spared)
        if unknown or missing:
            raise ValueError(
                f"realisation {outcome.number}: missing values {missing}, unknown values {unknown}"
            )
        for name, value in values.items():
            _place(arrays[name][place : place + 1], outcome.number, name, value)
    arrays["depth_profile"] = arrays["depth_profile"][: max(kept - first, 0)]
    return Rows(
        first,
        np.array([FAILED if outcome.error else DONE for outcome in run], np.uint8),
        np.array([_text(outcome.error) for outcome in run], np.bytes_),
        arrays,
    )


def _place(row: npt.NDArray[Any], number: int, name: str, value: Any) -> None:
    if np.shape(value) != row.shape[1:]:
        raise ValueError(
            f"realisation {number}: {name} has the shape {np.shape(value)}, expected"
            f" {row.shape[1:]}"
        )
    row[0] = value


def _text(error: str) -> bytes:
    """Return a text as it is stored, cut between two characters where it is too long."""
    content = error.encode("utf-8", "replace")
    most = ERROR_BYTES - 1
    if len(content) <= most:
        return content
    end = _CUT.encode()
    return content[: most - len(end)].decode("utf-8", "ignore").encode() + end
