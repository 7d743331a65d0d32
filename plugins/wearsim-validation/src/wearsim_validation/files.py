"""Reading of cases: a TOML file with what to compute, and a CSV of published values."""

from __future__ import annotations

import csv
import hashlib
import tomllib
from pathlib import Path

import numpy as np

from wearsim.errors import Mistake, ScenarioError, described
from wearsim.units import QuantityError, conversion
from wearsim_validation.case import Case, CaseFile, Column
from wearsim_validation.compute import KNOWN

SHIPPED = Path(__file__).parent / "cases"


def shipped() -> list[str]:
    """Return the names of the cases of this distribution."""
    return sorted(path.stem for path in SHIPPED.glob("*.toml"))


def read_case(path: Path) -> Case:
    """Read a case.

    Raises
    ------
    ScenarioError
        If a file is missing or was changed, or a key or value cannot be used; one line.
    """
    try:
        file = CaseFile.model_validate(tomllib.loads(_bytes(path).decode("utf-8")))
    except (ValueError, QuantityError) as error:  # pydantic, TOML and text encoding
        raise _mistake(path, described(error)) from error
    data = path.parent / file.data
    content = _bytes(data)
    checksum = hashlib.sha256(content.replace(b"\r\n", b"\n")).hexdigest()
    if checksum != file.sha256:
        raise _mistake(
            data,
            f"the published values have changed: their checksum is {checksum}, and {path.name} has"
            f" {file.sha256[:12]}...; restore the file, or set sha256 if the change is meant",
        )
    columns = _columns(data, content.decode("utf-8"))
    for series in file.series:
        known, wanted = KNOWN[file.kind], [series.computed]
        wanted += [series.x] if file.kind == "run" else []
        for name in wanted:
            if name not in known:
                text = f"series '{series.name}': unknown quantity '{name}', expected one of"
                raise _mistake(path, f"{text} {', '.join(known)}")
        for name in (series.x, series.published):
            if name not in columns:
                heads = ", ".join(columns)
                raise _mistake(path, f"series '{series.name}': no column '{name}' in {file.data},"
                               f" which has {heads}")  # fmt: skip
    return Case(path.stem, path.parent, file, columns)


def _mistake(path: Path, text: str) -> ScenarioError:
    return ScenarioError(str(path), [Mistake("", "", text)])


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise _mistake(path, error.strerror or "cannot be read") from error


def _columns(path: Path, text: str) -> dict[str, Column]:
    """Return the columns of a CSV with heads such as "depth [um]"; lines with # are comments."""
    rows = list(csv.reader(line for line in text.splitlines() if line and line[0] != "#"))
    if len(rows) < 2 or len({len(row) for row in rows}) > 1:
        raise _mistake(path, "needs a line of heads and lines of as many values")
    columns = {}
    for number, head in enumerate(rows[0]):
        name, _, unit = (part.strip() for part in head.rstrip("] ").partition("["))
        try:
            si = {"": 1.0, "%": 0.01}.get(unit) or float(conversion(unit, _si_unit(unit)))
            values = [float(row[number]) if row[number].strip() else np.nan for row in rows[1:]]
        except ValueError as error:
            raise _mistake(path, f"column '{name}': {error}") from error
        columns[name] = Column(np.array(values), unit or "1", si)
    return columns


def _si_unit(unit: str) -> str:
    """Return the SI unit of the dimension of a unit of length, force, power or pressure."""
    for target in ("m", "N", "W", "Pa"):
        try:
            conversion(unit, target)
        except QuantityError:
            continue
        return target
    raise QuantityError(f"unit '{unit}' is not one of a length, force, power or pressure")
