"""Part of a page, its tables, files and command."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from wearsim.report import summary
from wearsim.report.measured import Measured, computed_profile, residual_text
from wearsim.results import DissipationResult, EnsembleResult, Result
from wearsim.results.identification import IdentificationResult

if TYPE_CHECKING:
    from wearsim.report.page.plots import Plot

Reported: TypeAlias = Result | EnsembleResult | DissipationResult | IdentificationResult
NO_STEPPING_ERROR = "Every roller pass is solved: there is no stepping error."
NOT_MODEL = (
    "The stated error is that of the steps in time. It does not contain the errors of the contact"
    " model, of the wear law or of the inputs."
)
SAMPLING = (
    "Intervals in brackets hold the true value with 95 % confidence for the stated scatter of the"
    " inputs. They do not contain the errors of the contact model or of the wear law."
)
SAME_NUMBERS = (
    "The same version of wearsim gives the same numbers on the same kind of machine, for any number"
    " of workers."
)


@dataclass(frozen=True)
class Part:
    """Part of a page: a question, its answer, figures and tables.

    Parameters
    ----------
    title : str
    question : str
        What was asked, in a sentence.
    answer : list of (str, str)
        Name and value; the first one is the answer, the others complete it.
    error : str
        What the stated errors contain.
    plots : list of Plot
    tables : list of (str, list of (str, str))
        Title and rows.
    warnings : list of str
    steps : list of str
        Text of each position of the slider, if the figures have records.
    files : list of (str, str)
        Name and text of the scenario and the input files.
    command : str
        Command that repeats the computation.
    remark : str
        What the command gives, and what it needs besides the files.
    """

    title: str
    question: str
    answer: summary.Rows
    error: str
    plots: list[Plot]
    tables: list[tuple[str, summary.Rows]]
    warnings: list[str] = field(default_factory=list)
    steps: list[str] = field(default_factory=list)
    files: list[tuple[str, str]] = field(default_factory=list)
    command: str = ""
    remark: str = SAME_NUMBERS


def tables_of(
    result: Reported,
    first: tuple[str, summary.Rows],
    inputs: summary.Rows,
    measured: Sequence[Measured] = (),
) -> list[tuple[str, summary.Rows]]:
    """Return the tables of a part: the study, its inputs, measured profiles, and its origin."""
    residuals = []
    if measured and isinstance(result, Result | EnsembleResult):
        residuals = [
            (one.label, residual_text(one, computed_profile(result, one.angle))) for one in measured
        ]
    origin = summary.sources(result.raw)
    return [first, ("Random inputs", inputs), ("Measured profiles", residuals), ("Origin", origin)]


def files_of(result: Reported) -> list[tuple[str, str]]:
    """Return names and texts of the scenario and of its input files."""
    raw = result.raw
    files = {raw.scenario_file: raw.scenario_text, **raw.files}
    return [(Path(name).name, text) for name, text in files.items()]


def command_of(result: Reported, verb: str, *options: str) -> str:
    """Return the command that repeats a computation from the files of the page."""
    return shlex.join(["wearsim", verb, Path(result.raw.scenario_file).name, *options])
