"""Conformance tests of kinds of studies: every display of a result, and its file."""

from __future__ import annotations

import csv
import json
import tempfile
from dataclasses import dataclass
from functools import cached_property
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np

from wearsim.plugins import StudyKind
from wearsim.report.figures import figure_of, png_of
from wearsim.report.notebook import view_html
from wearsim.report.page.page import page_of
from wearsim.report.panels import Mark, Sheet
from wearsim.report.text import plain
from wearsim.report.view import View
from wearsim.results.content import StudyResult
from wearsim.results.kinds import kind_of, open_study
from wearsim.results.viewed import kind_of_result
from wearsim.studies.opening import export_csv
from wearsim.testing.checks import Checks, require

_TIMES = {"wall_seconds", "solve_seconds"}
_PNG = b"\x89PNG"
_VIEW, _KIND = "wearsim.report.view.View", "wearsim.plugins.StudyKind"
STUDY_KIND: Checks[StudyKindFixture] = Checks()


@dataclass(frozen=True)
class StudyKindFixture:
    """A result of a kind of study.

    Parameters
    ----------
    spec : StudyKind
    result : object
        A small result; with the path of its file if the kind has one.
    """

    spec: StudyKind
    result: Any

    def __str__(self) -> str:
        return f"study kind '{self.spec.name}'"

    @cached_property
    def view(self) -> View:
        """View of the result."""
        return self.spec.load("view")(self.result)  # type: ignore[no-any-return]

    @cached_property
    def sheet(self) -> Sheet:
        """Panels of the view."""
        return self.view.panels()


@STUDY_KIND.specified_in(_KIND)
def result_is_of_the_kind(fixture: StudyKindFixture) -> None:
    """The class of the result leads to the kind, so that `plot` and notebooks find the view."""
    kind = kind_of_result(fixture.result)
    require(kind.name == fixture.spec.name, f"the result is of the kind '{kind.name}'")


@STUDY_KIND.specified_in(_KIND)
def short_text_names_the_result(fixture: StudyKindFixture) -> None:
    """The short text of a result is one line of at most 300 characters."""
    text = repr(fixture.result)
    require(len(text) <= 300 and "\n" not in text, f"repr has {len(text)} characters: {text[:80]}")


@STUDY_KIND.specified_in(f"{_VIEW}.rows")
def rows_have_labels_and_texts(fixture: StudyKindFixture) -> None:
    """There is an answer, and every row has a label and a text with its unit."""
    rows = fixture.view.rows()
    require(bool(rows), "there is no row")
    for row in rows:
        require(bool(row.label.strip()) and bool(row.text.strip()), f"row {row} is empty")


@STUDY_KIND.specified_in(_VIEW)
def question_and_title_are_stated(fixture: StudyKindFixture) -> None:
    """The view has a title and the question that its first row answers."""
    require(bool(fixture.view.title), "there is no title")
    question = fixture.view.question
    require(question.endswith("?"), f"the question is {question!r}")


@STUDY_KIND.specified_in(f"{_VIEW}.data")
def data_are_plain_numbers(fixture: StudyKindFixture) -> None:
    """The data can be written as JSON without numbers that are not finite."""
    require(len(json.dumps(plain(fixture.view.data()), allow_nan=False)) > 2, "there are no data")


@STUDY_KIND.specified_in(f"{_VIEW}.line")
def line_is_one_line(fixture: StudyKindFixture) -> None:
    """The footer is a single line, which may be empty."""
    require("\n" not in fixture.view.line(), f"the footer is {fixture.view.line()!r}")


@STUDY_KIND.specified_in(f"{_VIEW}.tables")
def tables_are_rectangular(fixture: StudyKindFixture) -> None:
    """Every row of a table with heads has as many cells as there are heads."""
    for table in fixture.view.tables():
        for row in table.rows:
            fits = not table.heads or len(row) == len(table.heads)
            require(fits, f"{len(table.heads)} heads, and a row of {len(row)} cells: {row}")


@STUDY_KIND.specified_in("wearsim.report.panels.Panel")
def panels_have_axes_and_captions(fixture: StudyKindFixture) -> None:
    """Every panel of a page has a title, a caption and named axes, and something to draw."""
    for name, panel in fixture.sheet.panels.items():
        if panel.figure_only:
            continue
        require(bool(panel.title and panel.caption), f"panel '{name}' has no title or no caption")
        require(all(isinstance(mark, Mark) for mark in panel.marks), f"panel '{name}' has no marks")


@STUDY_KIND.specified_in("wearsim.report.panels.Sheet")
def figure_arranges_known_panels(fixture: StudyKindFixture) -> None:
    """The figure has every panel that its rows name, and can be drawn."""
    missing = {name for row in fixture.sheet.rows for name in row} - set(fixture.sheet.panels)
    require(not missing, f"there is no panel {missing}")
    require(png_of(figure_of(fixture.sheet), 50).startswith(_PNG), "the figure is no PNG")


@STUDY_KIND.specified_in("wearsim.report.notebook.view_html")
def notebook_shows_all_rows(fixture: StudyKindFixture) -> None:
    """A notebook shows the label of every row."""
    html = unescape(view_html(fixture.view))
    missing = [row.label for row in fixture.view.rows() if f">{row.label}</th>" not in html]
    require(not missing, f"rows are missing: {missing}")


@STUDY_KIND.specified_in("wearsim.report.page.page.page_of")
def page_shows_the_answer(fixture: StudyKindFixture) -> None:
    """A page has the question, and a figure for every panel with a caption."""
    page = page_of([fixture.view])
    panels = [panel for panel in fixture.sheet.panels.values() if not panel.figure_only]
    require(
        page.count("<figcaption>") == len(panels), f"the page lacks one of {len(panels)} panels"
    )


@STUDY_KIND.specified_in(f"{_VIEW}.frame")
def frame_has_a_unit_for_each_column(fixture: StudyKindFixture) -> None:
    """The table of pandas has rows, and a unit for each column."""
    frame = fixture.view.frame()
    lengths = {len(np.asarray(values)) for _, _, values in frame.columns}
    require(lengths == {len(list(frame.numbers))}, f"columns have the lengths {lengths}")


@STUDY_KIND.specified_in(_KIND)
def file_is_opened_again(fixture: StudyKindFixture) -> None:
    """A file leads to its kind, and gives the same data as the result that wrote it."""
    if not fixture.spec.format:
        return
    path = fixture.result.path
    require(kind_of(path).name == fixture.spec.name, f"{path} is of the kind {kind_of(path).name}")
    data = [plain(result.view.data()) for result in (fixture.result, open_study(path))]
    differing = [name for name in data[0] if data[0][name] != data[1][name] and name not in _TIMES]
    require(not differing, f"the file gives other {', '.join(differing)} than the result")


@STUDY_KIND.specified_in("wearsim.report.csv_files")
def csv_files_have_heads_and_rows(fixture: StudyKindFixture) -> None:
    """Each CSV file has as many cells in its rows as in its head."""
    if not fixture.spec.format:
        return
    with tempfile.TemporaryDirectory() as folder:
        paths = [p for p in export_csv(fixture.result, Path(folder) / "csv") if p.suffix == ".csv"]
        for name in fixture.view.columns():
            lines = (Path(folder) / "csv" / name).read_text(encoding="utf-8").splitlines()
            cells = {len(line) for line in csv.reader(lines) if not line[0].startswith("#")}
            require(len(cells) == 1, f"the rows of {name} have {sorted(cells)} cells")
    require(bool(paths), "there is no CSV file")


@STUDY_KIND.specified_in("wearsim.results.content.StudyResult")
def dataset_has_the_variables_of_the_file(fixture: StudyKindFixture) -> None:
    """The dataset of xarray has every variable of the schema."""
    if not isinstance(fixture.result, StudyResult):
        return
    missing = set(fixture.result.raw.schema.variables) - set(fixture.result.to_xarray().variables)
    require(not missing, f"the dataset lacks {sorted(missing)}")
