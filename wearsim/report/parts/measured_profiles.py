"""Measured profiles, to be drawn over computed ones."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import PurePath

from wearsim.csv_tables import read_columns
from wearsim.types import FloatArray


@dataclass(frozen=True)
class Measured:
    """A measured profile.

    Parameters
    ----------
    label : str
        What it is.
    y : ndarray, shape (points,)
        Axial position [m].
    height : ndarray, shape (points,)
        Height above the nominal surface [m]; worn material is negative.
    """

    label: str
    y: FloatArray
    height: FloatArray


def read_measured(text: str, file: str) -> Measured:
    """Return the measured profile in a CSV.

    Parameters
    ----------
    text : str
        The file's content, with the columns y, and depth or height; depth counts downwards.
    file : str
        Its name, for messages and the label.

    Returns
    -------
    Measured

    Raises
    ------
    ScenarioError
        With every mistake in the file.
    """
    deep = _has_depth(text)
    name = "depth" if deep else "height"
    columns = read_columns(text, file, {"y": "m", name: "m"})
    height = -columns[name] if deep else columns[name]
    return Measured(PurePath(file).stem, columns["y"], height)


def _has_depth(text: str) -> bool:
    """Tell whether the header has a column depth and none of height."""
    lines = (line.strip() for line in text.lstrip("\ufeff").splitlines())
    header = next((line for line in lines if line and not line.startswith("#")), "")
    for mark in "\t;":
        header = header.replace(mark, ",")
    names = {cell.split("[")[0].strip() for cell in header.split(",")}
    return "depth" in names and "height" not in names
