"""Animations of panels: GIF, and MP4 where ffmpeg is installed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter

from wearsim.atomic_write import replacement
from wearsim.errors import PluginError
from wearsim.report.figures import draw, titled_figure
from wearsim.report.panels import Panel

ENDINGS = (".gif", ".mp4")
_DPI, _WIDTH = 100, 6.6  # in
_ASIDE, _ABOVE = 0.7, 0.9  # in, for labels and title


@dataclass(frozen=True)
class Animation:
    """A panel that changes with time.

    Parameters
    ----------
    frame : callable
        Returns the panel of a frame by its number; all have the same limits of the axes.
    count : int
        Number of frames.
    per_second : int
        Frames per second.
    """

    frame: Callable[[int], Panel]
    count: int
    per_second: int


def check_animation(path: Path) -> None:
    """Check that the format of an animation can be written.

    Raises
    ------
    PluginError
        If ffmpeg is needed and not installed.
    """
    if path.suffix.lower() == ".mp4" and not FFMpegWriter.isAvailable():
        raise PluginError(f"{path}: MP4 needs the program ffmpeg, which is not installed; use .gif")


def save_animation(animation: Animation, path: Path) -> None:
    """Write an animation; the ending gives the format.

    Parameters
    ----------
    animation : Animation
    path : Path
        Ends in .gif or .mp4; an existing file is replaced.

    Raises
    ------
    PluginError
        As of `check_animation`.
    ResultsFileError
        If it cannot be written; an existing file is then unchanged.
    """
    check_animation(path)
    kind = PillowWriter if path.suffix.lower() == ".gif" else FFMpegWriter
    writer: AbstractMovieWriter = kind(fps=animation.per_second)
    first = animation.frame(0)
    width, height = (float(np.ptp(np.array(axis.limits, float))) for axis in (first.x, first.y))
    with (
        TemporaryDirectory() as folder,
        titled_figure(_WIDTH, round(_ABOVE + (_WIDTH - _ASIDE) * height / width, 1)) as figure,
        replacement(path) as target,
    ):
        part = Path(folder) / path.name
        axes = figure.subplots()
        with writer.saving(figure, str(part), _DPI):
            for number in range(animation.count):
                axes.clear()
                draw(axes, animation.frame(number))
                if number == 0:  # all frames have the layout of the first
                    figure.draw_without_rendering()
                    figure.set_layout_engine("none")
                writer.grab_frame()
        target.write(part.read_bytes())
