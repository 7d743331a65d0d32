"""Surfaces of results as closed curves in a plane, in files for CAD and CAM: CSV and DXF."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from wearsim.atomic_write import save_text
from wearsim.errors import PluginError, optional_library
from wearsim.report.csv_files import table_text
from wearsim.report.view import Column
from wearsim.types import FloatArray

CHORD = 1e-6  # m, by default
ENDINGS = (".csv", ".dxf")
_MM = 1e3
_MILLIMETRES = 4  # code of the unit in a DXF file
_DEGREE = 3


@dataclass(frozen=True)
class Sampling:
    """How a surface is represented by points.

    Parameters
    ----------
    chord : float
        Greatest distance of the chords between points from the surface [m].
    points : int, optional
        Number of points of a curve, equally spaced along it, instead.
    position : float, optional
        Position across the track [m]; by default where it is worn deepest.
    """

    chord: float = CHORD
    points: int | None = None
    position: float | None = None


@dataclass(frozen=True)
class Curve:
    """A closed curve: its last point is not the first one again.

    Parameters
    ----------
    name : str
        Name of its layer in a DXF file.
    x, y : ndarray, shape (points,)
        [m].
    """

    name: str
    x: FloatArray
    y: FloatArray


@dataclass(frozen=True)
class Surface:
    """Closed curves of a surface, and the same points as columns of a table.

    Parameters
    ----------
    title : str
    curves : sequence of Curve
    columns : sequence of Column
        With one row for each point.
    deviation : float
        Greatest distance of the chords from the surface [m].
    """

    title: str
    curves: Sequence[Curve]
    columns: Sequence[Column]
    deviation: float

    @property
    def count(self) -> int:
        """Number of points of the longest curve."""
        return max(len(curve.x) for curve in self.curves)

    def save(self, path: str | Path, *, spline: bool = False) -> None:
        """Write the surface to a file; the ending gives the format.

        Parameters
        ----------
        path : path
            Ends in .csv or .dxf; an existing file is replaced.
        spline : bool
            Whether a DXF file has cubic splines through the points instead of polylines.

        Raises
        ------
        ValueError
            If the ending is neither.
        PluginError
            If ezdxf is not installed, which is part of the extra ``wearsim[cad]``.
        ResultsFileError
            If it cannot be written; an existing file is then unchanged.
        """
        path = Path(path)
        if path.suffix.lower() not in ENDINGS:
            raise ValueError(f"'{path}' has no known format, expected {' or '.join(ENDINGS)}")
        is_table = path.suffix.lower() == ".csv"
        save_text("".join(table_text([self.columns])) if is_table else _dxf(self, spline), path)


def dxf_library() -> Any:
    """Return the package ezdxf.

    Raises
    ------
    PluginError
        If it is not installed.
    """
    return optional_library(
        "ezdxf",
        PluginError(
            "DXF needs a package that is not installed (ezdxf); install it with:"
            " pip install 'wearsim[cad]'"
        ),
    )


def _dxf(surface: Surface, spline: bool) -> str:
    """Return the text of a DXF file with a layer for each curve, in mm."""
    import io  # noqa: PLC0415  (only of this format)

    drawing = dxf_library().new("R2010", units=_MILLIMETRES)
    drawing.header["$MEASUREMENT"] = 1  # metric
    space = drawing.modelspace()
    for curve in surface.curves:
        layer = curve.name.upper().replace(", ", "_").replace(" ", "_")
        drawing.layers.add(layer)
        points = _MM * np.stack([curve.x, curve.y], axis=1)
        if spline:
            knots, controls = closed_spline(points)
            entity = space.add_spline(dxfattribs={"layer": layer})
            entity.control_points = np.column_stack([controls, np.zeros(len(controls))])
            entity.knots, entity.dxf.degree, entity.closed = knots.tolist(), _DEGREE, True
        else:
            space.add_lwpolyline(points.tolist(), close=True, dxfattribs={"layer": layer})
    text = io.StringIO()
    drawing.write(text)
    return text.getvalue()


def closed_spline(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return knots and control points of the periodic cubic spline through points.

    It has the knots of a spline that ends at its first point, so that any reader can draw it.

    Parameters
    ----------
    points : ndarray, shape (points, 2)
        Without the first one at the end.
    """
    from scipy.interpolate import make_interp_spline  # noqa: PLC0415  (slow to import)

    closed = np.vstack([points, points[:1]])
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])
    periodic = make_interp_spline(along, closed, k=_DEGREE, bc_type="periodic")
    ends: Any = ([(1, periodic(along[0], 1))],) * 2
    clamped = make_interp_spline(along, closed, k=_DEGREE, bc_type=ends)
    return np.asarray(clamped.t), np.asarray(clamped.c)
