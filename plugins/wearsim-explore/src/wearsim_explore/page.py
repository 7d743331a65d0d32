"""One page: a Bokeh document that shows a session and performs the actions of its user."""

from __future__ import annotations

import asyncio
import itertools
import json
import os
import re
import time
from base64 import b64encode
from collections import deque
from collections.abc import Mapping
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from bokeh.core.properties import String
from bokeh.document import Document
from bokeh.model import DataModel
from bokeh.models import Column, CustomJS
from jinja2 import Environment, PackageLoader

import wearsim
from wearsim.report import LiveFigure, Panel, page_style, record
from wearsim_explore.answers import FIRST_TESTS, Answer, Drawn, Request, Stage, has_lives
from wearsim_explore.design import Design
from wearsim_explore.pool import Pool
from wearsim_explore.session import MOST_PINS, Session

REST, REST_HELD = 0.3, 1.5  # s without a change, after which the result is refined; held: longer
SLOTS = 26  # figures of a page, at most
_NAME = re.compile(r"\w[\w .-]*\.toml")
_KEPT = 1000  # server times that are kept


class Exchange(DataModel):
    """Requests of the page and replies to it, both as JSON."""

    request = String(default="")
    reply = String(default="")


class Page:
    """One page.

    Parameters
    ----------
    document : Document
        Document that is filled.
    design : Design
        The scenario of the file.
    schema : mapping
        JSON Schema of scenarios.
    pool : Pool
    scratch : Path
        Folder for files of computations.
    name : str
        Name of the session.

    Attributes
    ----------
    server_times : deque of float
        Times from the receipt of a change to its first answer in the document [s].
    finals : int
        Number of refined results that were shown.
    """

    def __init__(
        self,
        document: Document,
        design: Design,
        schema: Mapping[str, Any],
        pool: Pool,
        scratch: Path,
        name: str,
    ) -> None:
        self.document, self.pool, self.scratch, self.name = document, pool, scratch, name
        self.session = Session(schema, design)
        self.server_times: deque[float] = deque(maxlen=_KEPT)
        self.finals = 0
        self._exchange = Exchange(name="exchange")
        self._slots = [Column(name=f"slot{n}", sizing_mode="stretch_width") for n in range(SLOTS)]
        self._figures: list[LiveFigure] = []
        self._shown: list[dict[str, Any]] = []
        self._columns: dict[str, Mapping[str, Any]] = {}  # of the figures, by data source
        self._sent = True
        self._fields, self._replies = "", itertools.count()
        self._stage: str = "first"
        self._tests, self._frame, self._seen = 0, 0, 0
        self._received: dict[int, float] = {}
        self._changed = time.perf_counter()
        self._timer: asyncio.TimerHandle | None = None
        self._held, self._answered = False, -1
        self._fill(design)
        pool.listeners[name] = self._listen
        pool.listeners[f"{name}.report"] = self._listen
        document.on_session_destroyed(self._destroyed)
        self._ask("first")

    def _fill(self, design: Design) -> None:
        """Put models, template and scripts into the document."""
        for model in (self._exchange, *self._slots):
            self.document.add_root(model)
        self.document.title = f"{design.file.name}: explore"
        environment = Environment(
            loader=PackageLoader("wearsim_explore", "."), autoescape=False, trim_blocks=True
        )
        self.document.template = environment.get_template("page.html.jinja")
        self.document.template_variables.update(
            style=page_style(), file=design.file.name, most_pins=MOST_PINS, slots=SLOTS
        )
        self._exchange.on_change("request", self._on_request)
        code = "window.wearsim_receive(cb_obj.reply)"
        self._exchange.js_on_change("reply", CustomJS(code=code))
        self.document.js_on_event("connection_lost", CustomJS(code="window.wearsim_lost()"))

    def _destroyed(self, _: Any) -> None:
        for name in (self.name, f"{self.name}.report"):
            self.pool.forget(name)
        if self._timer is not None:
            self._timer.cancel()

    def end(self) -> None:
        """Inform the page that the server ends, since a websocket of a notebook may stay open."""
        self._reply(ended=True)

    # actions of the user

    def _on_request(self, _: str, __: str, new: str) -> None:
        try:
            content = json.loads(new)
            self.act(content.pop("do"), **content)
        except (ValueError, TypeError, KeyError, IndexError) as error:
            self._reply(message=f"refused: {type(error).__name__}: {error}")

    def act(self, action: str, **values: Any) -> None:
        """Perform an action of the user.

        Parameters
        ----------
        action : str
            "change", "release", "undo", "reset", "restore", "pin", "unpin", "save", "report" or
            "show".
        **values
            Values of the action.

        Raises
        ------
        ValueError, KeyError, IndexError
            If there is no such action, field or pin.
        """
        received, session = time.perf_counter(), self.session
        self._seen = int(values.pop("count", self._seen))
        self._frame = int(values.pop("frame", self._frame))
        before = session.number
        match action:
            case "change":
                slides = bool(values.get("slides"))
                session.change(
                    str(values["key"]), str(values["value"]), begins=values["begins"], slides=slides
                )
                self._held = bool(values.get("held"))
            case "release":
                self._held = False
                self._refine_at_rest()
            case "undo":
                session.undo()
            case "reset":
                session.reset()
            case "restore":
                session.restore(_changes(values["changes"]))
            case "pin":
                session.pin()
                self._show_panels()
            case "unpin":
                session.unpin(int(values["place"]))
                self._show_panels()
            case "save":
                self._save(str(values["name"]), force=bool(values.get("force")))
                return
            case "report":
                self._ask("report")
            case "show":
                pass
            case _:
                raise ValueError(f"'{action}' is no action")
        if session.number != before:
            self._changed = received
            self._received[session.number] = received
            self._stage, self._tests = "first", 0
            self._ask("first")
        if action in {"undo", "reset", "restore", "show"}:
            self._reply(fields=True)
        elif action == "change" and not values.get("slides"):
            if self._fields != self._fields_now():
                self._reply(fields=True)
        elif action in {"pin", "unpin"}:
            self._reply()

    def _save(self, name: str, *, force: bool) -> None:
        """Write the scenario into the folder of its file."""
        folder = self.session.design.file.resolve().parent
        path = folder / name
        if not _NAME.fullmatch(name) or path.resolve().parent != folder:
            self._reply(message=f"refused: '{name}' is no name of a TOML file in {folder}")
            return
        try:
            text = self.session.design.toml()
            if not force:
                with path.open("x", encoding="utf-8") as file:
                    file.write(text)
            else:
                part = path.with_name(f".{path.name}.part")
                part.write_text(text, encoding="utf-8")
                os.replace(part, path)
        except FileExistsError:
            self._reply(message=f"{name} exists; choose another name or replace it", exists=True)
        except (OSError, wearsim.WearsimError) as error:
            self._reply(message=f"not saved: {error}")
        else:
            self._reply(message=f"saved: {path}")

    # computations

    def _ask(self, stage: Stage) -> None:
        session = self.session
        name = f"{self.name}.report" if stage == "report" else self.name
        design, scratch = session.design, self.scratch
        number = session.number
        self.pool.ask(Request(name, number, stage, design, scratch, self._tests, self._frame))

    def _listen(self, request: Request, content: Answer | int) -> None:
        self.document.add_next_tick_callback(partial(self.receive, request, content))

    def receive(self, request: Request, content: Answer | int) -> None:
        """Show an answer, or the progress of lives, and ask for what follows.

        Parameters
        ----------
        request : Request
        content : Answer or int
            An answer, or the number of tests that are done.
        """
        if request.stage == "report":
            if isinstance(content, Answer):
                texts = [mistake.text for mistake in content.mistakes]
                self._reply(page=content.page, message="\n".join(texts))
            return
        if isinstance(content, int):
            if request.number == self.session.number:
                self._reply(progress=content)
            return
        self.session.receive(content, lives=request.stage == "lives")
        if request.number != self.session.number:  # a newer change waits
            self.session.mistakes = ()
        else:
            self._stage = "failed" if content.mistakes else request.stage
        if not content.mistakes:
            self._show_panels()
        self._reply()
        if request.stage == "first" and request.number in self._received:
            self.server_times.append(time.perf_counter() - self._received[request.number])
            self._received = {n: at for n, at in self._received.items() if n > request.number}
        self.finals += request.stage == "final"
        if request.number == self.session.number and not content.mistakes:
            self._follow(request, content)

    def _follow(self, request: Request, content: Answer) -> None:
        """Ask for what follows an answer: a refined result, then lives of more and more tests."""
        if request.stage == "first":
            self._answered = request.number
            self._refine_at_rest()
        elif request.stage == "final" and has_lives(request.design):
            self._tests = 0
            self._ask("lives")
            self._reply(progress=0)
        elif request.stage == "lives" and not content.is_last:
            self._tests = max(FIRST_TESTS, 2 * request.tests)
            self._ask("lives")
            self._reply(progress=request.tests)

    def _refine_at_rest(self) -> None:
        """Refine the first answer after a time without changes."""
        if self._timer is not None:
            self._timer.cancel()
        if self._answered == self.session.number and self._stage == "first":
            rest = REST_HELD if self._held else REST
            wait = max(0.0, self._changed + rest - time.perf_counter())
            self._timer = asyncio.get_running_loop().call_later(wait, self._refine)

    def _refine(self) -> None:
        if self._answered == self.session.number:
            self._ask("final")

    # display

    def _show_panels(self) -> None:
        """Show the panels of the session in the slots; the next reply has their columns."""
        self.document.hold("combine")
        try:
            self._shown, self._columns, self._sent = [], {}, False
            panels = list(self.session.panels.items())[:SLOTS]
            for place, (name, item) in enumerate(panels):
                self._show_panel(place, item)
                panel = item.panel if isinstance(item, Drawn) else item
                frames = len(item.frames) if isinstance(item, Drawn) else 0
                described = {"title": panel.title, "caption": panel.caption}
                self._shown.append({"name": name, "frames": frames, **described})
        finally:
            self.document.unhold()

    def _show_panel(self, place: int, item: Drawn | Panel) -> None:
        panel = item.panel if isinstance(item, Drawn) else item
        recording = item.recording if isinstance(item, Drawn) else record(panel)
        frames = item.frames if isinstance(item, Drawn) else ()
        content = panel, recording, frames, self._columns.__setitem__
        if place < len(self._figures) and self._figures[place].show(*content):
            return
        drawn = LiveFigure(panel)
        drawn.show(*content)
        self._figures[place : place + 1] = [drawn]
        self._slots[place].children = [drawn.figure]

    def _fields_now(self) -> str:
        """Return the properties of the fields that a change may alter, apart from their values."""
        fields = self.session.fields_of(self.session.design)
        return json.dumps([(item.key, item.kind, item.unit, item.choices) for item in fields])

    def _reply(self, *, fields: bool = False, **further: Any) -> None:
        session = self.session
        beside, other_mistakes = session.beside_fields()
        content: dict[str, Any] = {
            "count": next(self._replies),
            "seen": self._seen,
            "number": session.number,
            "stage": self._stage,
            "mistakes": beside,
            "others": other_mistakes,
            "undo": session.can_undo,
            "pins": [pin.name for pin in session.pins],
            "differences": session.differences(),
            "options": session.design.options(),
            "link": session.link(),
            "figures": self._shown,
            "tests": self._tests,
            **further,
        }
        for name, answer in (("test", session.test), ("lives", session.lives)):
            if answer is not None:
                content[name] = {
                    "title": answer.title,
                    "question": answer.question,
                    "basis": answer.basis,
                    "rows": [(row.label, row.text) for row in answer.rows],
                    "remarks": answer.remarks,
                    "steps": answer.steps,
                    "tests": answer.tests,
                    "last": answer.is_last,
                }
        if fields or not self._sent:
            content["columns"], self._sent = _packed(self._columns), True
        if fields or not self._fields:
            self._fields = self._fields_now()
            shown = session.fields_of(session.design)
            content["fields"] = [
                {**asdict(item), "table": item.table, "label": item.label} for item in shown
            ]
            content["files"] = sorted(
                path.name for path in session.design.file.parent.iterdir() if path.is_file()
            )
        self._exchange.update(reply=json.dumps(content))


def _packed(columns: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return columns of data sources for JSON: all numbers as one text, and the ends of each."""
    ends, parts, count = dict[str, dict[str, tuple[int, int]]](), list[Any](), 0
    for source, named in columns.items():
        ends[source] = {}
        for name, values in named.items():
            ends[source][name] = count, count + len(values)
            parts.append(values)
            count += len(values)
    numbers = np.concatenate(parts).astype("<f4").tobytes() if parts else b""
    return {"ends": ends, "numbers": b64encode(numbers).decode()}


def _changes(value: Any) -> dict[str, object]:
    """Return the changes of a link.

    Raises
    ------
    ValueError
        If they are none.
    """
    if not isinstance(value, dict) or not all(isinstance(key, str) for key in value):
        raise ValueError("the link holds no changes")
    return dict(value)
