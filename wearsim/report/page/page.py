"""One self-contained page on views, for a browser."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearsim.atomic_write import replacement
from wearsim.errors import PluginError
from wearsim.levelling import Measured
from wearsim.report.measured import residual_text
from wearsim.report.panels import Panel
from wearsim.report.view import Row, Table, View

if TYPE_CHECKING:
    from wearsim.report.panels import Sheet


@dataclass(frozen=True)
class PagePart:
    """Part of a page: a view with its panels drawn.

    Parameters
    ----------
    view : View
    rows : list of Row
        Answers; the first one is the answer to the question.
    tables : list of Table
    remarks : list of str
        Failures, warnings and notes.
    panels : list of (Panel, bokeh figure)
    steps : list of str
        Text of each position of the slider, if the panels have records.
    """

    view: View
    rows: list[Row]
    tables: list[Table]
    remarks: list[str]
    panels: list[tuple[Panel, Any]]
    steps: list[str]


@dataclass(frozen=True)
class First:
    """First screen of a page, for the person who decides.

    Parameters
    ----------
    groups : mapping of str to list of Row
        Short answers by title.
    excluded : list of str
        What the results do not contain.
    picture : str
        A PNG file in base64, or empty.
    caption : str
        What it shows.
    """

    groups: Mapping[str, list[Row]]
    excluded: list[str]
    picture: str
    caption: str


def first_of(views: Sequence[View]) -> First:
    """Return the first screen of views: each group from the first view that has it."""
    from wearsim.report.figures import png_of_panel  # noqa: PLC0415  (imports matplotlib)

    overviews = [views[0].overview()]
    if not overviews[0].alone:
        overviews += [view.overview() for view in views[1:]]
    groups: dict[str, list[Row]] = {}
    for overview in overviews:
        groups = {**overview.groups, **groups}
    # what one of the results contains is included
    lists = [overview.excluded for overview in overviews if overview.excluded]
    excluded = [text for text in lists[0] if all(text in texts for texts in lists)] if lists else []
    panel = next((item.picture for item in overviews if item.picture is not None), None)
    if panel is None:
        return First(groups, excluded, "", "")
    picture = png_of_panel(panel, 130, 5.4 if panel.equal else 3.8)
    caption = f"{panel.title}. {panel.caption}"
    return First(groups, excluded, b64encode(picture).decode(), caption)


def save_page(views: Sequence[View], path: Path, measured: Sequence[Measured] = ()) -> None:
    """Write a page on views; it loads nothing from a network.

    Parameters
    ----------
    views : sequence of View
    path : Path
        An existing file is replaced.
    measured : sequence of Measured
        Profiles drawn over computed ones.

    Raises
    ------
    PluginError
        If bokeh or jinja2 is not installed, which are part of the extra ``wearsim[report]``.
    ResultsFileError
        If the page cannot be written.
    """
    save_text(page_of(views, measured), path)


def save_text(text: str, path: Path) -> None:
    """Write a text in UTF-8.

    Parameters
    ----------
    text : str
    path : Path
        An existing file is replaced.

    Raises
    ------
    ResultsFileError
        If it cannot be written; an existing file is then unchanged.
    """
    with replacement(path) as file:
        file.write(text.encode("utf-8"))


def page_of(views: Sequence[View], measured: Sequence[Measured] = ()) -> str:
    """Return the page as HTML; parameters and errors as of `save_page`."""
    try:
        from bokeh.embed import components  # noqa: PLC0415  (optional)
        from bokeh.resources import Resources  # noqa: PLC0415
        from jinja2 import Environment, PackageLoader  # noqa: PLC0415
    except ImportError as error:
        raise PluginError(
            f"a page needs packages that are not installed ({error}); install them with:"
            " pip install 'wearsim[report]'"
        ) from error
    parts = [part_of(view, measured) for view in views]
    drawn = [figure for part in parts for _, figure in part.panels]
    script, divisions = components(drawn) if drawn else ("", ())
    figures = iter(divisions)
    with_divisions = [(part, [(*item, next(figures)) for item in part.panels]) for part in parts]
    template = Environment(
        loader=PackageLoader("wearsim.report.page", "."), autoescape=True, trim_blocks=True
    ).get_template("page.html.jinja")
    resources = Resources(mode="inline", components=["bokeh"], log_level="fatal")
    return template.render(
        title=parts[0].view.title,
        first=first_of(views),
        parts=with_divisions,
        script=script,
        resources=resources.render(),
    )


def page_style() -> str:
    """Return the style sheet of pages, light and dark."""
    return Path(__file__).with_name("page.css").read_text(encoding="utf-8")


def part_of(view: View, measured: Sequence[Measured] = ()) -> PagePart:
    """Return a view as a part of a page, with its panels drawn."""
    from wearsim.report.page.plots import plots_of  # noqa: PLC0415  (imports bokeh)

    sheet: Sheet = view.panels(measured)
    tables, computed = view.tables(), view.profile()
    if measured and computed is not None:
        residuals = [
            Row(profile.label, residual_text(profile, view.profile(profile.angle) or computed))
            for profile in measured
        ]
        tables.insert(-1, Table("Measured profiles", residuals))
    remarks = [*filter(None, [view.failures]), *view.warnings, *view.notes]
    return PagePart(view, view.rows(), tables, remarks, *plots_of(sheet))
