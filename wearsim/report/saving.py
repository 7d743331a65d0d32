"""Writes a figure whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 150


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure beside its place and move it there; the suffix decides the format.

    Parameters
    ----------
    figure : Figure
    path : Path
        Ends in .png, .pdf or .svg; overwritten where it exists.
    """
    number, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(number, "wb") as file:
            figure.savefig(file, format=path.suffix[1:].lower(), dpi=DPI)
        mask = os.umask(0)
        os.umask(mask)
        Path(name).chmod(0o666 & ~mask)  # mkstemp makes it private
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
