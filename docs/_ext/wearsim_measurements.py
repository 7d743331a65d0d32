"""Sphinx extension that writes measured tables, figures and numbers from committed JSON files.

Pages that contain `{{ ... }}` are templates of jinja2. Their functions are the methods of
`Measurements`, which reads `docs/measurements/*.json`: topics and hard cases of `wearsim bench`,
the cases of `wearsim validate`, and tables of other commands. Each file has the date, the machine
and the command.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jinja2

from wearsim.report.parts import save_figure
from wearsim.report.text import brief
from wearsim_bench import figures
from wearsim_bench.figures.hard_cases import hard_markdown
from wearsim_bench.figures.table import markdown, markdown_table, measured_on, percent
from wearsim_bench.figures.topic import bench_figure
from wearsim_bench.hard_cases.verdict import Verdict
from wearsim_bench.measure.machine import Machine
from wearsim_bench.measure.measurement import Effort, Measurement, Topic
from wearsim_validation.figure import case_figure

if TYPE_CHECKING:
    from sphinx.application import Sphinx

MEASURED = Path(__file__).parents[1] / "measurements"
FIGURES = "_build/figures"  # of the documentation
TEMPLATE = "{{ "


class Measurements:
    """The JSON files of a folder, as Markdown.

    Parameters
    ----------
    folder : Path
        Folder of the JSON files.
    """

    def __init__(self, folder: Path = MEASURED) -> None:
        self.folder = folder
        self._read = cache(self._read_file)

    def _read_file(self, name: str) -> dict[str, Any]:
        text = (self.folder / f"{name}.json").read_text(encoding="utf-8")
        found: dict[str, Any] = json.loads(text)
        return found

    def _machine(self, name: str) -> Machine:
        return Machine(**self._read(name)["machine"])

    def measured(self, name: str) -> str:
        """Return a sentence with date, machine and command of a file."""
        data, machine = self._read(name), self._machine(name)
        if "command" not in data:
            topic = self._topic(name) if "measurements" in data else None
            return measured_on(machine, Effort(**data["effort"]), topic.timing if topic else "")
        return f"`{data['command']}` on {machine.date}, {machine}."

    def _topic(self, name: str) -> Topic:
        return Topic.from_json(self._read(name))

    def topic(self, name: str) -> str:
        """Return heading, figure and tables of a topic of `wearsim bench`."""
        topic, effort = self._topic(name), Effort(**self._read(name)["effort"])
        heading, _, rest = markdown(topic, self._machine(name), effort).partition("\n\n")
        return f"{heading}\n\n{self.figure(name)}\n\n{rest}"

    def figure(self, name: str) -> str:
        """Return the figure of a topic of `wearsim bench`."""
        return f"![{self._topic(name).title}](/{FIGURES}/{name}.svg)"

    def draw(self, folder: Path) -> None:
        """Draw the figures of all topics that are newer than their figures, as SVG."""
        newest = max(path.stat().st_mtime for path in Path(figures.__file__).parent.glob("*.py"))
        for source in sorted(self.folder.glob("*.json")):
            data, path = self._read(source.stem), folder / f"{source.stem}.svg"
            drawn = path.stat().st_mtime if path.exists() else 0.0
            stale = drawn < max(newest, source.stat().st_mtime)
            if "measurements" in data and stale:
                folder.mkdir(parents=True, exist_ok=True)
                effort, topic = Effort(**data["effort"]), self._topic(source.stem)
                save_figure(bench_figure(topic, self._machine(source.stem), effort), path)

    def validated(self, case: str) -> str:
        """Return title, sources, figure, tables, verdict and reasons of a validated case."""
        found, figure = self._read("validation")["cases"][case], f"validation-{case}"
        parts = [
            f"### {found['title']}",
            f"{found['source']}. Read: {found['read']}.",
            f"![{found['title']}](/{FIGURES}/{figure}.svg)",
        ]
        for series in found["series"]:
            title = f"{case}: {series['series']}"
            parts += [f"**{series['series']}**", self.table("validation", title)]
        verdict = self.cell("validation", "verdicts", case, "verdict")
        reasons = "\n".join(f"- {reason}" for reason in found["reasons"])
        return "\n\n".join([*parts, f"Verdict: **{verdict}**.", reasons])

    def finding(self, case: str, series: str, words: str) -> str:
        """Return the first finding on a series of a validated case that begins with words."""
        every = self._read("validation")["cases"][case]["series"]
        facts = [fact for one in every if one["series"] == series for fact in one["facts"]]
        found: list[str] = [fact for fact in facts if words in fact]
        if not found:
            raise KeyError(f"validation.json: {case}, {series} has no finding with '{words}'")
        return found[0]

    def draw_validated(self, folder: Path) -> None:
        """Draw the figures of the validated cases."""
        source = self.folder / "validation.json"
        for case, found in self._read("validation")["cases"].items():
            path = folder / f"validation-{case}.svg"
            newest = max(
                source.stat().st_mtime, Path(case_figure.__code__.co_filename).stat().st_mtime
            )
            if not path.exists() or path.stat().st_mtime < newest:
                folder.mkdir(parents=True, exist_ok=True)
                save_figure(case_figure(found), path)

    def _one(self, name: str, group: str, method: str, setting: str) -> Measurement:
        """Return a measurement; of several defaults of a method, that with the fewest strips."""
        own = [item for item in self._topic(name).of(group) if item.method == method]
        found = [i for i in own if i.setting == setting or (i.default and setting == "default")]
        if not found:
            known = [item.setting for item in own] or self._topic(name).groups
            raise KeyError(f"{name}.json has no '{group}', '{method}', '{setting}', but {known}")
        return found[0]

    def time(self, name: str, group: str, method: str, setting: str) -> str:
        """Return the time of a measurement, "30 ms"."""
        seconds = self._one(name, group, method, setting).seconds
        assert seconds is not None
        return brief(seconds)

    def error(self, name: str, group: str, method: str, setting: str, error: str = "") -> str:
        """Return an error of a measurement, by default the one that is drawn, "0.02 %"."""
        item = self._one(name, group, method, setting)
        return percent(item.errors[error or self._topic(name).error])

    def count(self, name: str, group: str, method: str, setting: str, count: str) -> str:
        """Return a count of a measurement, with two digits if it is no whole number."""
        value = self._one(name, group, method, setting).counts[count]
        return f"{value:.0f}" if float(value).is_integer() else f"{value:.2g}"

    def setting(self, name: str, group: str, method: str) -> str:
        """Return the default setting of a method."""
        return self._one(name, group, method, "default").setting

    def conclusion(self, name: str, group: str) -> str:
        """Return the conclusion on a group of a topic."""
        return self._topic(name).conclusions[group]

    def verdicts(self) -> str:
        """Return the tables of the hard cases."""
        return hard_markdown([Verdict.from_json(case) for case in self._read("hard")["cases"]])

    def passed(self) -> str:
        """Return how many hard cases pass, "48 of 48"."""
        data = self._read("hard")
        return f"{data['holding']} of {len(data['cases'])}"

    def table(self, name: str, title: str = "") -> str:
        """Return a table of another command, without empty columns, and its notes."""
        tables = self._read(name)["tables"]
        table = tables[title or next(iter(tables))]
        columns, rows = table["columns"], table["rows"]
        filled = [k for k in range(len(columns)) if any(row[k] for row in rows)]
        kept = [k for k in filled if columns[k] != "target"]
        text = markdown_table([columns[k] for k in kept], [[row[k] for k in kept] for row in rows])
        return "\n\n".join([text, *table.get("notes", ())])

    def cell(self, name: str, title: str, row: str, column: str) -> str:
        """Return a cell of a table by the first cell of its row and its column head."""
        table = self._read(name)["tables"][title]
        found = [cells for cells in table["rows"] if cells[0] == row]
        if len(found) != 1:
            raise KeyError(f"{name}.json: table '{title}' has {len(found)} rows '{row}'")
        text: str = found[0][table["columns"].index(column)]
        return text

    def page(self, text: str) -> str:
        """Return the text of a page with tables and numbers in place of its `{{ ... }}`."""
        names = [name for name in dir(self) if not name.startswith("_")]
        settings = {"undefined": jinja2.StrictUndefined, "comment_start_string": "{##"}
        template = jinja2.Environment(autoescape=False, **settings).from_string(text)
        return template.render({name: getattr(self, name) for name in names})


def fill_page(app: Sphinx, _name: str, content: list[str]) -> None:
    """Replace the `{{ ... }}` of a page, which is read again when a JSON file changes."""
    if TEMPLATE in content[0]:
        content[0] = Measurements().page(content[0])
        for path in MEASURED.glob("*.json"):
            app.env.note_dependency(str(path))


def draw_figures(app: Sphinx) -> None:
    """Draw the figures of the topics."""
    measurements, folder = Measurements(), Path(app.srcdir) / FIGURES
    measurements.draw(folder)
    measurements.draw_validated(folder)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the extension."""
    app.connect("builder-inited", draw_figures)
    app.connect("source-read", fill_page)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
