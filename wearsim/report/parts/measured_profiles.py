"""Measured profiles, which are drawn over computed ones."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import PurePath

from wearsim.csv_tables import column_names, read_columns
from wearsim.types import FloatArray


@dataclass(frozen=True)
class Measured:
    """A measured profile.

    Parameters
    ----------
    label : str
        Label in the figure.
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
        Content of the file: columns y and either depth (positive downwards) or height.
    file : str
        Name of the file, for messages and the label.

    Returns
    -------
    Measured

    Raises
    ------
    ScenarioError
        With all mistakes in the file.
    """
    names = column_names(text)
    name = "depth" if "depth" in names and "height" not in names else "height"
    columns = read_columns(text, file, {"y": "m", name: "m"})
    height = -columns[name] if name == "depth" else columns[name]
    return Measured(PurePath(file).stem, columns["y"], height)
