"""CSV files of views, in engineering units, which are named in the headers."""

from __future__ import annotations

import csv
import io
import itertools
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any, Literal

import numpy as np

from wearsim.atomic_write import replacement
from wearsim.errors import ResultsFileError
from wearsim.report.view import Column, Columns, View
from wearsim.units import engineers_unit

# engineering units by SI unit
_UNITS = {
    "m": ("um", 1e-6),
    "m^3": ("mm^3", 1e-9),
    "s": ("min", 60.0),
    "Pa": ("MPa", 1e6),
    "N/m": ("N/mm", 1e3),
    "rad": ("deg", math.radians(1.0)),
}
_IN_MM = {"y", "width", "width_error", "half_length"}  # other lengths are written in um
_NUMBER = re.compile(r"-?\d+(\.\d+)?(e[+-]\d+)?")


def computed(title: str, values: Any, unit: str, name: str = "") -> Column:
    """Return a column of a computed variable in SI; some lengths, by name, are written in mm."""
    size = ("mm", 1e-3) if (name or title) in _IN_MM else _UNITS.get(unit, (unit, 1.0))
    return Column(title, values, *size)


def drawn(title: str, values: Any, unit: str) -> Column:
    """Return a column of drawn values in SI."""
    return Column(title, values, *(_UNITS[unit] if unit == "Pa" else engineers_unit(unit)))


def table_text(columns: Columns, decimal: Literal[".", ","] = ".") -> Iterator[str]:
    """Yield the text of a CSV file by blocks, with semicolons between cells for decimal commas."""
    for number, block in enumerate(columns):
        if number == 0:
            for source in dict.fromkeys(column.source for column in block if column.source):
                yield "".join(f"# {line}\n" for line in source.splitlines())
            yield _csv(
                [[c.name if c.unit == "1" else f"{c.name} [{c.unit}]" for c in block]], decimal
            )
        yield _csv(zip(*map(_cells, block), strict=True), decimal)


def _cells(column: Column) -> Iterable[str]:
    values = np.asarray(column.values)
    if values.dtype.kind in "OUS":
        return [str(value) for value in column.values]
    # adding zero avoids -0
    return [f"{value + 0.0:.12g}" for value in (values / column.size).tolist()]


def _csv(rows: Iterable[Sequence[str]], decimal: str) -> str:
    text = io.StringIO()
    if decimal == ",":
        rows = ([c.replace(".", ",") if _NUMBER.fullmatch(c) else c for c in row] for row in rows)
    csv.writer(text, delimiter=";" if decimal == "," else ",", lineterminator="\n").writerows(rows)
    return text.getvalue()


def write_csv(
    view: View, folder: str | Path, *, force: bool = False, decimal: Literal[".", ","] = "."
) -> list[Path]:
    """Write the columns of a view as CSV, and the files that repeat the study.

    Parameters and errors as of `wearsim.studies.opening.export_csv`.
    """
    if decimal not in {".", ","}:
        raise ValueError(f"the decimal sign is {decimal!r}, expected '.' or ','")
    contents: dict[str, Iterable[str]] = {
        name: table_text(columns, decimal) for name, columns in view.columns().items()
    }
    (_, contents["scenario.toml"]), *files = view.stored_files()
    for name, text in files:
        contents[path_in_folder(name, contents)] = [text]
    return write_files(Path(folder), contents, force=force)


def write_files(
    folder: Path, contents: Mapping[str, Iterable[str]], *, force: bool = False
) -> list[Path]:
    """Write files into a folder, which is created if it does not exist.

    Parameters
    ----------
    folder : Path
    contents : mapping of str to iterable of str
        Text of each file, in pieces, by path in the folder.
    force : bool
        Overwrite existing files.

    Returns
    -------
    list of Path
        The written files.

    Raises
    ------
    ResultsFileError
        As `write_csv`.
    """
    if folder.exists() and not folder.is_dir():
        raise ResultsFileError(
            f"{folder}: is a file; tables are written to a folder, which is created if it does not"
            " exist",
            shell="name one with -o",
        )
    existing = [str(folder / name) for name in contents if (folder / name).exists()]
    if existing and not force:
        raise ResultsFileError(
            f"{', '.join(existing)}: already exists",
            python="choose another folder, or force=True",
            shell="choose another folder, or --force",
        )
    for name, content in contents.items():
        parent = (folder / name).parent
        try:
            parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ResultsFileError(f"{parent}: cannot be made ({error.strerror})") from error
        with replacement(folder / name) as file:
            file.writelines(piece.encode("utf-8", "surrogatepass") for piece in content)
    return [folder / name for name in contents]


def path_in_folder(path: str, used: Iterable[str]) -> str:
    """Return the path of an input file as in the scenario, or another inside the folder."""
    pure = PurePosixPath(path.replace("\\", "/"))
    inside = not pure.is_absolute() and ".." not in pure.parts and ":" not in path and pure.name
    if inside and str(pure) not in used:
        return str(pure)
    name = pure.name.replace("..", "_").replace(":", "_") or "file"
    numbered = (f"inputs/{number}-{name}" for number in itertools.count(2))
    return next(new for new in itertools.chain([f"inputs/{name}"], numbered) if new not in used)
