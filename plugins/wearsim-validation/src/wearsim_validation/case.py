"""Cases: the model of their TOML files, and the published values."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias

from pydantic import Field

from wearsim.plugins import Options
from wearsim.types import FloatArray

Verdict: TypeAlias = Literal["reading error", "scatter", "tolerance", "not", "misfit"]
#: the verdicts, the best one first, in the words of the tables
VERDICTS: dict[Verdict, str] = {
    "reading error": "within the reading error",
    "scatter": "within the stated scatter",
    "tolerance": "within the tolerance",
    "misfit": "misfit stated, without threshold",
    "not": "not",
}


class Jump(Options):
    """Steps in which the wear of the first pass of each is multiplied, and a smoothing of it."""

    passes: int = Field(gt=0, description="passes of a step")
    smoothing: float = Field(0.0, ge=0.0, description="standard deviation across the track [m]")


class Variant(Options):
    """Another computation of all series of a case."""

    name: str = Field(description="head of its column")
    set: dict[str, Any] = Field({}, description="changes of the scenario, by dotted key")
    needs: str = Field("", description="contact model that must be installed")
    jump: Jump | None = Field(None, description="wear in jumps instead of an error-controlled run")
    rigid: bool = Field(False, description="closed form of rigid bodies in full slip instead")


class Series(Options):
    """A published column, and what is computed for it."""

    name: str = Field(description="name in tables and figures")
    published: str = Field(description="column of the CSV with the published values")
    x: str = Field(description="column of the CSV that runs from row to row")
    computed: str = Field(description="quantity that is computed")
    set: dict[str, Any] = Field({}, description="changes of the scenario, by dotted key")
    reading_error: float | None = Field(
        None, gt=0.0, description="greatest error of reading, in the unit of the column"
    )
    scatter: tuple[float, float] | None = Field(
        None, description="published relative scatter, [-0.6, 0.6]"
    )
    tolerance: float | None = Field(None, gt=0.0, description="accepted relative difference")
    begins: float | None = Field(None, description="x from which the verdict holds")
    exponent: bool = Field(False, description="compare the exponent of a power law from there on")


class Uncertain(Options):
    """An input that is not published, with its range."""

    name: str = Field(description="what it is, and where the range is from")
    low: dict[str, Any] = Field(description="changes of the scenario at one end, by dotted key")
    high: dict[str, Any] = Field(description="changes of the scenario at the other end")


class Fit(Options):
    """A value of the scenario that is fitted, row by row and for some rows together."""

    key: str = Field(description="dotted key of the value")
    low: float = Field(description="least value")
    high: float = Field(description="greatest value")
    upto: float = Field(description="greatest x of the rows that are fitted")


class CaseFile(Options):
    """The TOML file of a case."""

    title: str = Field(description="one line")
    kind: Literal["run", "contact", "ensemble"] = Field(description="what is computed")
    source: str = Field(description="publication of the values, with DOI")
    read: str = Field(description="how the values were read")
    data: str = Field(description="CSV next to this file, heads with units: 'depth [um]'")
    sha256: str = Field(description="checksum of the CSV")
    verdict: Verdict = Field(description="verdict that is expected")
    reasons: tuple[str, ...] = Field((), description="what explains differences, or does not")
    quick: bool = Field(True, description="whether `--quick` runs it")
    vary: str = Field("", description="key of the scenario that x sets, in SI; kind contact")
    realisations: int = Field(64, ge=16, description="tests; kind ensemble")
    scenario: dict[str, Any] = Field(description="the tables of a scenario")
    series: tuple[Series, ...] = Field(min_length=1, description="what is compared")
    variant: tuple[Variant, ...] = Field((), description="further computations")
    uncertain: tuple[Uncertain, ...] = Field((), description="inputs that are not published")
    fit: Fit | None = Field(None, description="value that is fitted")


@dataclass(frozen=True)
class Column:
    """Published values in the unit of their head.

    Parameters
    ----------
    values : ndarray, shape (rows,)
        NaN where a cell is empty.
    unit : str
        As in the head, "1" if there is none.
    si : float
        Factor from the unit to SI.
    """

    values: FloatArray
    unit: str
    si: float


@dataclass(frozen=True)
class Case:
    """A case as it was read.

    Parameters
    ----------
    name : str
        Name of the file without suffix.
    folder : Path
        Where the file is.
    file : CaseFile
        Its content.
    columns : dict of str to Column
        The published values by the name of their column.
    """

    name: str
    folder: Path
    file: CaseFile
    columns: dict[str, Column]
