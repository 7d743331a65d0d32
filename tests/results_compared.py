"""Comparison of runs bit for bit."""

from __future__ import annotations

from typing import Any

import numpy.typing as npt

from wearsim.studies.run.result import RunData

ARRAYS = ("static", "history", "records", "checkpoint")


def differences(one: RunData, other: RunData) -> list[str]:
    """Return the names of all fields and arrays in which two runs differ, bit for bit.

    Parameters
    ----------
    one, other : RunData
        The runs.

    Returns
    -------
    list of str
        Names such as "history.depth"; empty for identical runs.
    """
    names = [
        name
        for name in (*RunData.attribute_names(), "scenario_text", "files")
        if getattr(one, name) != getattr(other, name)
    ]
    for kind in ARRAYS:
        first, second = getattr(one, kind), getattr(other, kind)
        names += [
            f"{kind}.{name}"
            for name in sorted(first.keys() | second.keys())
            if not _identical(first.get(name), second.get(name))
        ]
    return names


def _identical(one: npt.NDArray[Any] | None, other: npt.NDArray[Any] | None) -> bool:
    return (
        one is not None
        and other is not None
        and one.dtype == other.dtype
        and one.shape == other.shape
        and one.tobytes() == other.tobytes()
    )
