"""Views as the terminal shows them: tables, notes and a footer, or JSON."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from wearsim.atomic_write import save_text
from wearsim.cli.shared import note, write_json, write_list, write_notes, write_table
from wearsim.errors import printable

if TYPE_CHECKING:
    from wearsim.report.panels import Sheet
    from wearsim.report.surfaces import Surface
    from wearsim.report.view import Columns, View


def show_view(
    view: View,
    *,
    json: bool,
    files: Mapping[str, object] | None = None,
    known: Collection[str] = (),
    more: Mapping[str, Any] | None = None,
    stored: bool = False,
    brief: bool = False,
) -> None:
    """Write a view to stdout, and its notes and warnings to stderr.

    Parameters
    ----------
    view : View
    json : bool
        Whether to write JSON instead of tables.
    files : mapping of str to object, optional
        Files that were written, by what they are, and the workers.
    known : collection of str
        Notes and warnings that were shown before.
    more : dict of str to object, optional
        Further fields of the JSON.
    stored : bool
        Whether the result was read from a file, whose origin is then shown too.
    brief : bool
        Whether the rows are shown without further tables.
    """
    if json:
        write_json({**view.data(), **(view.origin() if stored else {}), **(more or {})})
    else:
        _write_tables(view, files or {}, stored, brief)
        if not stored and (line := view.line()):
            typer.echo(printable(line))
        write_notes(
            *(
                [text for text in texts if text not in known]
                for texts in (view.notes, view.warnings)
            )
        )
    if view.failures:
        note(f"warning: {view.failures}")


def show_with_figure(
    view: View,
    figure: Path | None,
    *,
    json: bool,
    files: Mapping[str, object] | None = None,
    more: Mapping[str, Any] | None = None,
) -> None:
    """Draw the figure of a view, if a name is given, and write the view as `show_view`."""
    draw_figure(view.panels, figure)
    named = {"figure": figure}
    show_view(view, json=json, files={**(files or {}), **named}, more={**(more or {}), **named})


def _write_tables(view: View, files: Mapping[str, object], stored: bool, brief: bool) -> None:
    from wearsim.report.view import ORIGIN, STUDY, Row, Table

    tables = [] if brief else [table for table in view.tables() if stored or table.title != ORIGIN]
    place, title = int(bool(tables) and tables[0].title == STUDY), view.title
    rows = [*view.rows(), *(Row(name, str(item)) for name, item in files.items() if item)]
    tables.insert(place, Table(view.heading, rows))
    for table in tables:
        if table.heads:
            write_list(table.heads, table.rows)
            typer.echo("")
        else:
            write_table(title or table.title, [(row.label, row.text) for row in table.rows])
        title = ""


def draw_figure(compose: Callable[[], Sheet], path: Path | None) -> None:
    """Write the figure of the panels that `compose` returns, if a name is given."""
    if path is None:
        return
    from wearsim.report.figures import figure_of, save_figure

    save_figure(figure_of(compose()), path)


def write_table_file(columns: Columns, path: Path) -> None:
    """Write columns as a CSV file."""
    from wearsim.report.csv_files import table_text

    save_text("".join(table_text(columns)), path)


def write_surface(surface: Surface, path: Path, *, spline: bool) -> None:
    """Write a surface, and note the number of its points and their distance from it."""
    from wearsim.report.text import count, shown

    surface.save(path, spline=spline)
    form = "chords" if not spline else "chords between the points of the spline"
    deviation = shown(surface.deviation, "um", 2)
    note(f"surface: {path}, {count(surface.count)} points, {form} within {deviation}")
