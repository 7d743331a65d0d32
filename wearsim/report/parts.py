"""Parts that figures share: style, saving, contact patches, convergence."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from wearsim.report.measured import Measured
from wearsim.report.text import PER_SI, count, pass_unit
from wearsim.results import EnsembleResult
from wearsim.results.io.atomic_write import replacement
from wearsim.types import BoolArray, FloatArray, IntArray

RECORDS = "viridis"
MARKS = ("o", "s", "^", "D", "v")
PRESSURE = "magma"
BLUE, ORANGE, GREEN, RED, GREY = "#2066a8", "#d1701c", "#3a8a5c", "#b3282d", "#8a8a8a"

_SETTINGS: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "lines.linewidth": 1.3,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "figure.titlesize": 11.0,
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
}


@contextmanager
def figure_style() -> Iterator[None]:
    """Apply the settings of wearsim to the figures drawn in the context."""
    with mpl.rc_context(_SETTINGS):
        yield


class _Figure(Figure):
    """Figure that notebooks show; those of pyplot are shown without this."""

    def _repr_png_(self) -> bytes:
        content = io.BytesIO()
        self.savefig(content, format="png", dpi=DPI)
        return content.getvalue()


@contextmanager
def titled_figure(width: float, height: float, title: str | None = None) -> Iterator[Figure]:
    """Return a figure of a width and height in inches, drawn with the settings of wearsim."""
    with figure_style():
        figure = _Figure(figsize=(width, height), layout="constrained")
        if title is not None:
            figure.suptitle(title, fontsize=10.5)
        yield figure


def name_axes(axes: Axes, title: str, x: str, y: str) -> None:
    """Set the title of a panel and the labels of its axes."""
    axes.set(title=title, xlabel=x, ylabel=y)


def evenly_spaced(count: int, most: int) -> IntArray:
    """Return at most `most` evenly spaced indices of `count` items, with the first and the last."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))


def write_message(axes: Axes, title: str, lines: Sequence[str]) -> None:
    """Write lines of text into a panel that has nothing to draw."""
    axes.text(0.5, 0.5, "\n".join(lines), ha="center", va="center", transform=axes.transAxes)
    axes.set_title(title)
    axes.set_axis_off()


def set_depth_axes(
    axes: Axes, passes: FloatArray, depth: FloatArray
) -> tuple[BoolArray, float, str]:
    """Set the scales of a panel of depth against passes, logarithmic from two decades of passes on.

    Parameters
    ----------
    axes : Axes
    passes, depth : ndarray, shape (points,)
        Points to be drawn [1, m].

    Returns
    -------
    drawn : ndarray of bool, shape (points,)
        Points that can be drawn on these scales.
    unit : float
        Unit of the axis of passes.
    name : str
        Label of the axis of passes.
    """
    drawn, logarithmic, unit, name = depth_scales(passes, depth)
    if logarithmic:
        axes.set(xscale="log", yscale="log")
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    return drawn, unit, name


def depth_scales(passes: FloatArray, depth: FloatArray) -> tuple[BoolArray, bool, float, str]:
    """Return drawn points, whether scales are logarithmic, and unit and label of the passes.

    Parameters as of `set_depth_axes`.
    """
    worn = (passes > 0.0) & (depth > 0.0)
    if worn.sum() > 3 and passes[worn][-1] > 100.0 * passes[worn][0]:
        return worn, True, 1.0, "roller passes"
    return passes >= 0.0, False, *pass_unit(float(passes[-1]))


DPI = 150


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure; the suffix gives the format.

    Parameters
    ----------
    figure : Figure
    path : Path
        Ends in .png, .pdf or .svg; an existing file is replaced.

    Raises
    ------
    ResultsFileError
        If it cannot be written; an existing file is then unchanged.
    """
    with replacement(path) as file:
        figure.savefig(file, format=path.suffix[1:].lower(), dpi=DPI)


def save_text(text: str, path: Path) -> None:
    """Write a text in UTF-8.

    Parameters
    ----------
    text : str
    path : Path
        An existing file is replaced.

    Raises
    ------
    ResultsFileError
        As `save_figure`.
    """
    with replacement(path) as file:
        file.write(text.encode("utf-8"))


def patch_edges(y: FloatArray, half_length: FloatArray) -> tuple[float, float] | None:
    """Return the axial positions of the two edges of the contact [m], or None without contact.

    Near an edge the square of the half-length decreases linearly; the edge is its zero,
    extrapolated from the two outermost strips by at most one strip width.

    Parameters
    ----------
    y : ndarray, shape (strips,)
        Axial position of the strips [m].
    half_length : ndarray, shape (strips,)
        Half-length a(y) of the contact [m].
    """
    touching = np.flatnonzero(half_length > 0.0)
    if len(touching) == 0:
        return None
    first, last = int(touching[0]), int(touching[-1])
    spacing = float(y[1] - y[0])
    return (
        float(y[first]) - spacing * _beyond(half_length, first, 1),
        float(y[last]) + spacing * _beyond(half_length, last, -1),
    )


def patches(half_length: FloatArray) -> list[slice]:
    """Return the range of strips of each patch of a contact.

    Parameters
    ----------
    half_length : ndarray, shape (strips,)
        Half-length a(y) of the contact [m].
    """
    touching = np.concatenate([[False], half_length > 0.0, [False]])
    ends = np.flatnonzero(np.diff(touching.astype(np.int8)))
    return [slice(int(i), int(j)) for i, j in zip(ends[::2], ends[1::2], strict=True)]


def _beyond(half_length: FloatArray, strip: int, inwards: int) -> float:
    """Return the distance of the edge from the centre of the outermost strip, in strips."""
    inner = strip + inwards
    if not 0 <= inner < len(half_length):
        return 0.5
    outer_square, inner_square = half_length[strip] ** 2, half_length[inner] ** 2
    if inner_square <= outer_square:
        return 0.5
    return float(np.clip(outer_square / (inner_square - outer_square), 0.0, 1.0))


_SCALED_FROM = 10  # realisations from which an estimate sets the scale of the panel,
_SCALED_PART = 1 / 30  # or this part of all realisations
_LINEAR_UP_TO = 20  # realisations
_DECADES_FROM = 3000  # realisations from which powers of ten suffice as ticks


def draw_convergence(
    axes: Axes, counts: IntArray, value: FloatArray, low: FloatArray, high: FloatArray
) -> None:
    """Draw an estimate against the number of realisations, and its interval as a band.

    Parameters
    ----------
    axes : Axes
    counts : ndarray of int, shape (points,)
        Numbers of realisations, ascending.
    value, low, high : ndarray, shape (points,)
        Estimate and ends of its interval, nan or infinite where unknown.
    """
    known = np.isfinite(low) & np.isfinite(high)
    if np.isfinite(value[-1]) and not np.any(known & (high > low)):
        top = 2.0 * float(value[-1]) or 1.0
        axes.set_ylim(-0.05 * top, top)  # keeps a line at zero off the axis
    lower, upper = (np.where(known, end, np.nan) for end in (low, high))
    axes.fill_between(counts, lower, upper, color=BLUE, alpha=0.25, lw=0)
    axes.plot(counts, value, color=BLUE, marker="o" if len(counts) == 1 else "")
    last = int(counts[-1])
    if last > _LINEAR_UP_TO:
        axes.set_xscale("log")
        if last < _DECADES_FROM:
            axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.xaxis.set_major_formatter(FuncFormatter(lambda number, _: count(number)))
    else:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    scaling = (counts >= min(max(_SCALED_FROM, _SCALED_PART * last), last)) & known
    if scaling.any() and (high - low)[scaling].max() > 0.0:
        least, greatest = low[scaling].min(), high[scaling].max()
        margin = 0.05 * (greatest - least)
        axes.set_ylim(least - margin, greatest + margin)
        axes.axhline(value[-1], color=GREY, lw=0.8, ls="--")
    axes.set_xlim(0.5 * _SCALED_FROM if last > _LINEAR_UP_TO else 1.0, max(2.0, 1.05 * last))


def lift_curves(result: EnsembleResult) -> tuple[FloatArray, FloatArray]:
    """Return angles [deg], and lift errors of cams less their means over a turn, (kept, angles)."""
    curves = result.kept_values("lift_error_curve")
    means = curves[:, :-1].mean(axis=1, keepdims=True)  # the last angle is the first one
    return np.degrees(np.asarray(result.raw.variables["angle"])), curves - means


def draw_measured(axes: Axes, measured: Sequence[Measured]) -> None:
    """Draw measured profiles as points."""
    for number, profile in enumerate(measured):
        axes.plot(
            profile.y * PER_SI["mm"], profile.height * PER_SI["um"], MARKS[number % len(MARKS)],
            ms=3.2, mew=0.7, mfc="white", mec=RED, label=f"measured: {profile.label}", zorder=5,
        )  # fmt: skip
