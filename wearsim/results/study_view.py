"""What the views of all results with a file have in common: origin, random inputs, repetition."""

from __future__ import annotations

import math
import shlex
from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Generic, TypeVar, cast

from wearsim.errors import PluginError, ResultsFileError
from wearsim.report.text import count
from wearsim.report.view import (
    ORIGIN,
    STUDY,
    Column,
    Columns,
    Frame,
    Repetition,
    Row,
    Rows,
    Table,
    View,
)
from wearsim.results.content import StudyResult
from wearsim.types import FloatArray
from wearsim.units import in_engineers_unit
from wearsim.uq.estimation.moments import is_constant

CONSTANT = "constant"
SAMPLING = (
    "Intervals in brackets hold the true value with 95 % confidence for the stated scatter of the"
    " inputs. They do not contain the errors of the contact model or of the wear law."
)
SAME_NUMBERS = (
    "The same version of wearsim gives the same numbers on the same kind of machine, for any number"
    " of workers."
)

Shown = TypeVar("Shown", bound=StudyResult[Any])


class StudyView(View, Generic[Shown]):
    """View of one result that is stored with its scenario.

    Parameters
    ----------
    result : StudyResult
    """

    result: Shown
    verb = ""  # that repeats the study
    basis = SAMPLING

    def study(self) -> Rows:
        """Return rows on the study: how many, with which method, how long."""
        return []

    def details(self) -> list[Table]:
        """Return tables of the kind of study."""
        return []

    def random_inputs(self) -> Rows:
        """Return rows on the random inputs."""
        return []

    def tables(self) -> list[Table]:
        """Return the study, its details, random inputs and origin."""
        tables = [
            Table(STUDY, self.study()),
            *self.details(),
            Table("Random inputs", self.random_inputs()),
            Table(ORIGIN, self._sources()),
        ]
        return [table for table in tables if table.rows]

    def _sources(self) -> Rows:
        """Return rows on scenario, input files, plugins and software."""
        raw = self.result.raw
        return [
            Row("scenario", raw.scenario_file),
            Row("input files", ", ".join(raw.files) or "none"),
            Row(
                "plugins",
                "\n".join(map("{kind} {name} ({distribution} {version})".format_map, raw.plugins)),
            ),
            Row("software", ", ".join(map(" ".join, raw.software.items()))),
            Row("written", raw.created),
        ]

    def origin(self) -> dict[str, Any]:
        """Return scenario, input files, plugins and software of the study for JSON."""
        raw = self.result.raw
        return {
            "scenario_file": raw.scenario_file,
            "scenario_sha256": raw.sha256,
            "scenario": raw.scenario_text,
            "files": list(raw.files),
            "plugins": raw.plugins,
            "software": raw.software,
            "seed": raw.seed,
            "created": raw.created,
        }

    def ending(self) -> dict[str, Any]:
        """Return file, notes and warnings for JSON."""
        return {
            "output": None if self.result.path is None else str(self.result.path),
            "notes": list(self.notes),
            "warnings": list(self.warnings),
        }

    def stored_files(self) -> list[tuple[str, str]]:
        """Return names and texts of the scenario, which is the first, and of its input files."""
        raw = self.result.raw
        return [(raw.scenario_file, raw.scenario_text), *raw.files.items()]

    def options(self) -> Sequence[str]:
        """Return the options of the command that repeats the study."""
        return []

    def repetition(self) -> Repetition:
        """Return command and files that repeat the study."""
        (scenario, text), *files = [(Path(name).name, text) for name, text in self.stored_files()]
        return Repetition(
            shlex.join(["wearsim", self.verb, scenario, *self.options()]),
            {scenario: text, **dict(files)},
            SAME_NUMBERS,
        )


class DesignsView(View):
    """View of returns from the field or of demonstration tests: one table, and its files.

    Attributes
    ----------
    file : str
        Name of the CSV file.
    """

    file: str

    @abstractmethod
    def table(self) -> list[Column]:
        """Return the columns of the table."""

    def columns(self) -> Mapping[str, Columns]:
        """Return the table by the name of its file."""
        return {self.file: [self.table()]}

    def frame(self) -> Frame:
        """Return the table for pandas, with rows from 1 on."""
        columns = [(column.name, column.unit, column.values) for column in self.table()]
        return Frame(columns, "number", range(1, len(columns[0][2]) + 1))

    def stored_files(self) -> list[tuple[str, str]]:
        """Return the scenario of the first design and its input files."""
        return cast("View", self.result.designs[0].view).stored_files()


def columns_of(name: str, ends: Iterable[FloatArray], unit: str = "1") -> list[Column]:
    """Return values and lower and upper ends of their intervals as columns of a CSV file."""
    return [
        Column(*column, unit)
        for column in zip((name, f"{name} low", f"{name} high"), ends, strict=True)
    ]


def drawn_rows(result: StudyResult[Any]) -> Rows:
    """Return rows on the random inputs of a study: mean and standard deviation of the draws."""
    rows = []
    for key, item in drawn_data(result).items():
        mean, std = (
            in_engineers_unit(float(item[name]), item["unit"], 4) for name in ("mean", "std")
        )
        scatter = f", std {std}" if math.isfinite(item["std"]) else ""
        is_fixed = is_constant(float(item["mean"]), float(item["std"]))
        rows.append(
            Row(f"drawn {key}", f"{CONSTANT} {mean}" if is_fixed else f"mean {mean}{scatter}")
        )
    return rows


def drawn_data(result: StudyResult[Any]) -> dict[str, Any]:
    """Return mean and standard deviation of the draws by key, in SI units."""
    drawn = [(item, result.inputs[item["key"]]) for item in result.raw.inputs if result.count]
    return {
        item["key"]: {
            "unit": item["unit"],
            "mean": values.mean(),
            "std": float(values.std(ddof=1)) if values.size > 1 else math.nan,
        }
        for item, values in drawn
    }


def varying_inputs(result: StudyResult[Any], drawn: Mapping[str, Any] | None) -> dict[str, str]:
    """Return descriptions of the random inputs that are not given by one drawn value, by name.

    These are fields, processes and inputs drawn at every pass. They are read from the stored
    scenario; if one of its plugins is not installed, the reason is returned instead.

    Parameters
    ----------
    result : StudyResult
    drawn : mapping of str to object, optional
        Drawn values by key; by default fields and processes are returned.
    """
    try:
        random = result.scenario.random
    except (PluginError, ResultsFileError) as error:
        return {"inputs": f"unknown, since the scenario cannot be read here: {error}"}
    return {
        item.name: item.describe()
        for item in random
        if (
            item.role in {"field", "process"} if drawn is None else not set(item.keys) <= set(drawn)
        )
    }


def varying_rows(varying: Mapping[str, str]) -> Rows:
    """Return rows on random inputs with a description each."""
    return [Row(f"random {name}", text) for name, text in varying.items()]


def progress_text(done: int, failed: int, requested: int, finished: bool) -> str:
    """Return "24 done, 0 failed, of 24", with "unfinished" if it is not."""
    text = f"{count(done)} done, {count(failed)} failed, of {count(requested)}"
    return text if finished else f"{text}, unfinished"
