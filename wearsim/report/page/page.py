"""One self-contained page on views, for a browser."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from wearsim.atomic_write import save_text
from wearsim.errors import PluginError
from wearsim.levelling import Measured
from wearsim.report.measured import residual_text
from wearsim.report.view import Row, Table, View


def first_of(views: Sequence[View]) -> dict[str, Any]:
    """Return the content of the top of a page: short answers and the main figure.

    Returns
    -------
    dict of str to object
        Short answers by title, "groups", each from the first view that has it; "excluded", what the
        results do not contain; "picture", a PNG file in base64, or empty, with its "caption".
    """
    from wearsim.report.figures import png_of_panel  # noqa: PLC0415  (imports matplotlib)

    overviews = [views[0].overview()]
    if not overviews[0].alone:
        overviews += [view.overview() for view in views[1:]]
    # of groups with one title, that of the first view is shown
    groups = {
        title: rows for overview in reversed(overviews) for title, rows in overview.groups.items()
    }
    # what one of the results contains is included
    lists = [overview.excluded for overview in overviews if overview.excluded]
    excluded = [text for text in lists[0] if all(text in texts for texts in lists)] if lists else []
    first: dict[str, Any] = {"groups": groups, "excluded": excluded}
    if panel := next((item.picture for item in overviews if item.picture is not None), None):
        first |= {
            "picture": b64encode(png_of_panel(panel, 130, 5.4 if panel.equal else 3.8)).decode(),
            "caption": f"{panel.title}. {panel.caption}",
        }
    return first


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


def page_of(views: Sequence[View], measured: Sequence[Measured] = ()) -> str:
    """Return the page as HTML; parameters and errors as of `save_page`."""
    try:
        from bokeh.document import Document  # noqa: PLC0415  (optional)
        from bokeh.embed import components  # noqa: PLC0415
        from bokeh.resources import Resources  # noqa: PLC0415
        from jinja2 import Environment, PackageLoader  # noqa: PLC0415
    except ImportError as error:
        raise PluginError(
            f"a page needs packages that are not installed ({error}); install them with:"
            " pip install 'wearsim[report]'"
        ) from error
    parts = [part_of(view, measured) for view in views]
    drawn = {figure.id: figure for part in parts for _, figure in part["panels"]}
    document = Document()
    with document.models.freeze():  # else Bokeh searches all figures again after each of them
        for figure in drawn.values():
            document.add_root(figure)
    script, divisions = components(drawn) if drawn else ("", {})
    environment = Environment(
        loader=PackageLoader("wearsim.report.page", "."), autoescape=True, trim_blocks=True
    )
    return environment.get_template("page.html.jinja").render(
        title=views[0].title,
        first=first_of(views),
        parts=parts,
        divisions=divisions,
        script=script,
        resources=Resources(mode="inline", components=["bokeh"], log_level="fatal").render(),
    )


def page_style() -> str:
    """Return the style sheet of pages, light and dark."""
    return Path(__file__).with_name("page.css").read_text(encoding="utf-8")


def part_of(view: View, measured: Sequence[Measured] = ()) -> dict[str, Any]:
    """Return a view as a part of a page.

    Returns
    -------
    dict of str to object
        The "view"; its "rows", the first of which is the answer to the question, and "tables";
        "remarks", failures, warnings and notes; "panels", each with its figure; "steps", the texts
        of the slider.
    """
    from wearsim.report.page.plots import draw, panels_of  # noqa: PLC0415  (imports bokeh)

    tables, computed = view.tables(), view.profile()
    if measured and computed is not None:
        residuals = [
            Row(profile.label, residual_text(profile, view.profile(profile.angle) or computed))
            for profile in measured
        ]
        tables.insert(-1, Table("Measured profiles", residuals))
    panels, steps = panels_of(view.panels(measured))
    return {
        "view": view,
        "rows": view.rows(),
        "tables": tables,
        "remarks": [*filter(None, [view.failures]), *view.warnings, *view.notes],
        "panels": [(panel, draw(panel)) for panel in panels.values()],
        "steps": steps,
    }
