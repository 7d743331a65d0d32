"""Views as notebooks show them: a short table and one panel as an image."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape

from wearsim.report.panels import Panel
from wearsim.report.view import STUDY, Row, View

_CELL = "text-align: left; padding: 0.1em 0.8em 0.1em 0; vertical-align: top"


def view_html(view: View) -> str:
    """Return a view as HTML: what was computed, the answers, and the first of the panels."""
    study = next((table.rows[:1] for table in view.tables() if table.title == STUDY), [])
    return table_html(view.title, [*study, *view.rows()], view.panels().first)


def table_html(title: str, rows: Sequence[Row], panel: Panel | None) -> str:
    """Return rows as a table of HTML, with a panel beside them unless it is only a message."""
    cells = "".join(
        f'<tr><th scope="row" style="{_CELL}">{escape(row.label)}</th>'
        f'<td style="{_CELL}">{escape(row.text)}</td></tr>'
        for row in rows
    )
    image = "" if panel is None or panel.message else _image(panel)
    return (
        '<div style="display: flex; flex-wrap: wrap; gap: 1em; align-items: flex-start">'
        f'<table><caption style="text-align: left"><b>{escape(title)}</b></caption>'
        f"<tbody>{cells}</tbody></table>{image}</div>"
    )


def _image(panel: Panel) -> str:
    from wearsim.report.figures import png_of_panel  # noqa: PLC0415  (imports matplotlib)

    data = base64.b64encode(png_of_panel(panel)).decode()
    alt = escape(f"{panel.title}. {panel.caption}")
    return f'<img alt="{alt}" src="data:image/png;base64,{data}">'
