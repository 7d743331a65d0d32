"""Atomic writing of figures and texts: a new file replaces the old one when complete."""

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
    """Write a figure; the suffix gives the format.

    Parameters
    ----------
    figure : Figure
    path : Path
        Ends in .png, .pdf or .svg; an existing file is replaced.
    """
    with _replacing(path) as file:
        figure.savefig(file, format=path.suffix[1:].lower(), dpi=DPI)


def save_text(text: str, path: Path) -> None:
    """Write a text in UTF-8.

    Parameters
    ----------
    text : str
    path : Path
        An existing file is replaced.
    """
    with _replacing(path) as file:
        file.write(text.encode("utf-8"))


@contextmanager
def _replacing(path: Path) -> Iterator[IO[bytes]]:
    """Open a temporary file in the same folder and rename it to `path` when it is complete."""
    number, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(number, "wb") as file:
            yield file
        mask = os.umask(0)
        os.umask(mask)
        Path(name).chmod(0o666 & ~mask)  # mkstemp restricts it to the owner
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
