"""Views: what a result shows as rows, JSON, one line, panels, tables and columns.

A view is the only thing that displays know of a result. The terminal (`wearsim.cli.render`), pages
(`page`), notebooks (`notebook`), CSV files (`csv_files`) and tables of pandas (`frames`) render
views, and figures (`figures`) the panels of a view.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias, cast

import numpy as np

from wearsim.report.text import by_roller, shown, with_error, with_interval
from wearsim.uq.estimation.intervals import Interval

if TYPE_CHECKING:
    from wearsim.levelling import ComputedProfile, Measured
    from wearsim.report.animation import Animation
    from wearsim.report.panels import Panel, Sheet
    from wearsim.report.surfaces import Sampling, Surface

STUDY = "Study"  # title of the table on the computation, which stands first
ORIGIN = "Origin"  # title of the table on scenario, files and software
_FIRST = 9  # answers that a page shows first, by default


class Row(NamedTuple):
    """A quantity with its label.

    Parameters
    ----------
    label : str
    quantity : str, float, ndarray or Interval
        In words, or in SI; an array has one value for each roller.
    unit : str
        Unit that is shown, a key of `PER_SI`.
    error : float, optional
        Half-width of the interval that holds the true value [SI].
    answers : mapping of str to (float, str), optional
        The numbers that the row states: value in SI and unit that is shown, by the name under which
        other studies ask for them, {"outer_radius": (0.031, "mm")}.
    """

    label: str
    quantity: Any
    unit: str = "1"
    error: float | None = None
    answers: Mapping[str, tuple[float | None, str]] = {}

    @classmethod
    def answer(
        cls, label: str, name: str, value: float, unit: str, error: float | None = None
    ) -> Row:
        """Return the row of one number [SI] that other studies ask for by a name."""
        return cls(label, value, unit, error, {name: (value, unit)})

    @property
    def text(self) -> str:
        """The quantity with its unit and error."""
        if isinstance(self.quantity, str):
            return self.quantity
        if isinstance(self.quantity, Interval):
            return with_interval(self.quantity, self.unit)
        if self.error is None:
            return by_roller(self.quantity, self.unit)
        return with_error(np.asarray(self.quantity), self.error, self.unit)


Rows: TypeAlias = list[Row]


class Answer(NamedTuple):
    """A number that a view states.

    Parameters
    ----------
    value : float
        In SI; not a number where it is not known.
    unit : str
        Unit that is shown, a key of `PER_SI`.
    label : str
        Label of its row.
    """

    value: float
    unit: str
    label: str


def width_row(width: Any, threshold: float) -> Row:
    """Return the row of the widths [m], or of the depth that a groove has not reached [m]."""
    answers = {"width": (float(np.max(width)), "mm")}
    if not np.any(width):
        return Row("width", f"0 mm, not deeper than {shown(threshold, 'um')}", answers=answers)
    return Row("width", width, "mm", answers=answers)


class Table(NamedTuple):
    """A table with a title: rows of quantities, or cells under heads.

    Parameters
    ----------
    title : str
    rows : list of Row, or of sequences of str
        Quantities, or the cells of each row if there are heads.
    heads : sequence of str
        Heads of the columns; empty for rows of quantities.
    """

    title: str
    rows: Sequence[Any]
    heads: Sequence[str] = ()


class Column(NamedTuple):
    """A column of a CSV file: name, values in SI or texts, unit, and its size in SI.

    The source of constants behind the values stands as a comment above the table.
    """

    name: str
    values: Any
    unit: str = "1"
    size: float = 1.0
    source: str = ""


Columns: TypeAlias = Iterable[Sequence[Column]]  # in blocks of rows


class Frame(NamedTuple):
    """Columns of a table of pandas: name, SI unit and values; name and numbers of its rows."""

    columns: Sequence[tuple[str, str, Any]]
    axis: str
    numbers: Iterable[int]


class Overview(NamedTuple):
    """What a page shows first, for the person who decides.

    Parameters
    ----------
    picture : Panel, optional
        What was studied.
    groups : mapping of str to list of Row
        Short answers by title, such as "Loads" and "Limits".
    excluded : sequence of str
        What the results do not contain.
    alone : bool
        Whether the overviews of further views on the page do not belong to it.
    """

    picture: Panel | None
    groups: Mapping[str, Rows]
    excluded: Sequence[str] = ()
    alone: bool = False


class Repetition(NamedTuple):
    """How a study is repeated: command, files by name, and a remark."""

    command: str = ""
    files: Mapping[str, str] = {}
    remark: str = ""


class View(ABC):
    """What one result, or several compared results, show.

    Attributes
    ----------
    result : object
        What is shown.
    title : str
    question : str
        What was asked, in a sentence.
    basis : str
        What the stated errors contain.
    heading : str
        Title of the rows.
    group : str
        Title of the rows that a page shows first.
    notes, warnings : sequence of str
    """

    result: Any
    title: str
    #: function of the result and of measured profiles, "module:name"; imported for figures only
    sheet: str
    question: str = ""
    basis: str = ""
    heading: str = "results"
    group: str = "Results"
    notes: Sequence[str] = ()
    warnings: Sequence[str] = ()
    failures: str = ""  # remark on realisations that failed
    has_angles: bool = False  # whether the worn profile depends on the angle of a cam

    def __init__(self, result: Any) -> None:
        self.result, self.title = result, result.title
        self.notes, self.warnings = result.notes, result.warnings

    @abstractmethod
    def rows(self) -> Rows:
        """Return the answers with their errors, the most important first."""

    @abstractmethod
    def data(self) -> dict[str, Any]:
        """Return all numbers for JSON, in SI units."""

    def answers(self) -> dict[str, Answer]:
        """Return the numbers that rows and tables state, by the name of the quantity.

        Studies that choose a design ask for them, as objectives and constraints.
        """
        return {
            name: Answer(math.nan if value is None else float(value), unit, row.label)
            for row in self.rows()
            for name, (value, unit) in row.answers.items()
        }

    def panels(self, measured: Sequence[Measured] = ()) -> Sheet:
        """Return the panels; measured profiles are drawn over computed ones."""
        return cast("Sheet", resolve_name(self.sheet)(self.result, measured))

    def overview(self) -> Overview:
        """Return what a page shows first; by default the main panel and the first answers."""
        sheet = self.panels()
        return Overview(sheet.first if sheet.panels else None, {self.group: self.rows()[1:_FIRST]})

    def line(self) -> str:
        """Return method, numerical or sampling error and time on one line, or an empty text."""
        return ""

    def tables(self) -> list[Table]:
        """Return further tables: the study, its details, random inputs and origin."""
        return []

    def columns(self) -> Mapping[str, Columns]:
        """Return the tables of CSV files by name of the file."""
        return {}

    def frame(self) -> Frame:
        """Return the columns of a table of pandas.

        Raises
        ------
        TypeError
            If the result has none.
        """
        raise TypeError(f"{self.title}: there is no table of this result")

    def stored_files(self) -> list[tuple[str, str]]:
        """Return names and texts of the scenario, which is the first, and of its input files."""
        raise TypeError(f"{self.title}: it has no scenario that could be written")

    def repetition(self) -> Repetition:
        """Return command and files that repeat the study."""
        return Repetition()

    def origin(self) -> dict[str, Any]:
        """Return scenario, files, plugins and software for JSON, if they are stored."""
        return {}

    def surface(self, sampling: Sampling) -> Surface | None:
        """Return the surface of a body as closed curves, for CAD and CAM, if there is one.

        Parameters
        ----------
        sampling : Sampling
            Chord tolerance or number of points, and position across the track.
        """
        return None

    def animation(self) -> Animation | None:
        """Return the animation of what moves, if anything does."""
        return None

    def profile(self, angle: float | None = None) -> ComputedProfile | None:
        """Return the worn profile with which measured ones are compared, if there is one.

        Parameters
        ----------
        angle : float, optional
            Angle of the run of a cam [rad]; by default where it is worn deepest.
        """
        return None
