"""Writes a figure, or a text, whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING

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
    with _moved_into(path) as file:
        figure.savefig(file, format=path.suffix[1:].lower(), dpi=DPI)


def save_text(text: str, path: Path) -> None:
    """Write a text in UTF-8 beside its place and move it there.

    Parameters
    ----------
    text : str
    path : Path
        Overwritten where it exists.
    """
    with _moved_into(path) as file:
        file.write(text.encode("utf-8"))


@contextmanager
def _moved_into(path: Path) -> Iterator[IO[bytes]]:
    """Give a file beside a place, and move it there once it is whole."""
    number, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(number, "wb") as file:
            yield file
        mask = os.umask(0)
        os.umask(mask)
        Path(name).chmod(0o666 & ~mask)  # mkstemp makes it private
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
