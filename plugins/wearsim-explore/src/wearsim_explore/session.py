"""State of one page: the design, its former states, pinned designs, and what is to be computed."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from wearsim.report import Line, Panel, Records
from wearsim_explore.answers import Answer, FieldMistake, Quantity
from wearsim_explore.design import Design, unknown_keys
from wearsim_explore.fields import Field, fields_of

_ENTRY = re.compile(r"(.*?)(?: \(entry (\d+)\))?$")
_GREYS = ("#6b6b6b", "#8a5a00", "#5a3d8a", "#00695c")  # of pinned designs
_DASHES = ("--", ":", "-.", "--")
MOST_PINS = len(_GREYS)
_LEAST_WIDTH = 1.0  # least width of a line that is a curve, not an axis or a boundary


@dataclass(frozen=True)
class Pin:
    """A design that is kept for comparison, with its answers."""

    name: str
    design: Design
    answers: tuple[Answer, ...]


@dataclass
class Session:
    """State of one page.

    Parameters
    ----------
    schema : mapping
        JSON Schema of scenarios.
    design : Design
        The design of the file.

    Attributes
    ----------
    number : int
        Number of the present state, which rises with every change.
    test, lives : Answer, optional
        The last answers without mistakes.
    mistakes : tuple of FieldMistake
        Mistakes of the present state, as far as they are known.
    pins : list of Pin
    """

    schema: Mapping[str, Any]
    design: Design
    number: int = 0
    test: Answer | None = None
    lives: Answer | None = None
    mistakes: tuple[FieldMistake, ...] = ()
    pins: list[Pin] = field(default_factory=list)
    _before: list[Design] = field(default_factory=list)
    _last_key: str = ""

    def __post_init__(self) -> None:
        file = fields_of(self.schema, replace(self.design, changes={}).tables)
        self._start = {item.key: item for item in file}
        self._last: tuple[Design | None, list[Field]] = (None, [])  # design and its fields

    def fields_of(self, design: Design) -> list[Field]:
        """Return the fields of a design; ranges of sliders lie around the values of the file."""
        if self._last[0] is not design:
            fields = fields_of(self.schema, design.tables)
            self._last = design, [_with_range(item, self._start.get(item.key)) for item in fields]
        return self._last[1]

    @property
    def can_undo(self) -> bool:
        """Whether there is a former state."""
        return bool(self._before)

    def change(self, key: str, text: str, *, begins: bool = False, slides: bool = False) -> None:
        """Change a value; changes of one key are undone together.

        Parameters
        ----------
        key : str
            Dotted key of a field.
        text : str
            What was typed or chosen.
        begins : bool
            Whether this is the start of a further change of the same key.
        slides : bool
            Whether a slider moves, which changes no other field: the known ones are used.

        Raises
        ------
        KeyError
            If there is no such field.
        """
        known = self._last[1] if slides and self._last[1] else self.fields_of(self.design)
        item = next((item for item in known if item.key == key), None)
        if item is None:
            raise KeyError(key)
        if begins or key != self._last_key:
            self._before.append(self.design)
        self._last_key = key
        self.design = self.design.with_change(key, item.written(text) if text.strip() else None)
        if item.kind == "choice":
            self._remove_unknown(key)
        self._renew()

    def _remove_unknown(self, key: str) -> None:
        """Remove the options of the former choice, which the new one does not have."""
        table = key.rpartition(".")[0]
        fields = self.fields_of(self.design)
        known = [item.key for item in fields if item.key.startswith(f"{table}.")]
        if key in known and len(known) > 1 and key.rpartition(".")[2] in _NAMING:
            for name in unknown_keys(self.design, table, known):
                self.design = self.design.with_change(name, None)

    def undo(self) -> None:
        """Return to the state before the last change."""
        if self._before:
            self.design = self._before.pop()
            self._renew()
            self._last_key = ""

    def reset(self) -> None:
        """Return to the design of the file; it can be undone."""
        self.restore({})

    def restore(self, changes: Mapping[str, object]) -> None:
        """Show a design with other changes, from a link or a pin; it can be undone."""
        self._before.append(self.design)
        self.design = replace(self.design, changes=dict(changes))
        self._renew()
        self._last_key = ""

    def _renew(self) -> None:
        self.number += 1
        self.mistakes = ()

    def pin(self, name: str = "") -> None:
        """Keep the present design for comparison, up to `MOST_PINS` of them."""
        answers = tuple(answer for answer in (self.test, self.lives) if answer is not None)
        if answers and len(self.pins) < MOST_PINS:
            taken = {pin.name for pin in self.pins}
            names = (chr(ord("A") + number) for number in range(26))
            self.pins.append(
                Pin(name or next(n for n in names if n not in taken), self.design, answers)
            )

    def unpin(self, place: int) -> None:
        """Remove a pinned design."""
        del self.pins[place]

    def receive(self, answer: Answer, *, lives: bool) -> None:
        """Store an answer; one with mistakes does not replace the last one without."""
        if answer.mistakes:
            self.mistakes = answer.mistakes
        elif lives:
            self.lives = answer if answer.rows else None
        else:
            self.test, self.mistakes = answer, ()

    @property
    def panels(self) -> dict[str, Any]:
        """The panels by name, with pinned designs as further lines."""
        shown: dict[str, Any] = {}
        for answer in (self.test, self.lives):
            for name, drawn in (answer.drawn if answer else {}).items():
                pinned = [
                    (pin.name, pinned_answer.drawn[name].panel)
                    for pin in self.pins
                    for pinned_answer in pin.answers
                    if name in pinned_answer.drawn
                ]
                panel = drawn.panel if drawn.frames else with_pinned(drawn.panel, pinned)
                shown[name] = drawn if panel is drawn.panel else panel
        return shown

    def beside_fields(self) -> tuple[dict[str, str], list[str]]:
        """Return the mistakes by the key of their field, and the mistakes of no shown field."""
        keys = [item.key for item in self.fields_of(self.design)] if self.mistakes else []
        beside: dict[str, str] = {}
        other_mistakes = []
        for mistake in self.mistakes:
            key = key_of(mistake, keys)
            if key:
                beside[key] = "\n".join(filter(None, (beside.get(key), mistake.text)))
            else:
                other_mistakes.append(mistake.text)
        return beside, other_mistakes

    def differences(self) -> tuple[list[str], list[list[str]]]:
        """Return heads and rows of the table that compares the design with pinned ones."""
        heads = ["", "now", *(pin.name for pin in self.pins)]
        if not self.pins:
            return heads, []
        designs = [self.design, *(pin.design for pin in self.pins)]
        keys = dict.fromkeys(key for design in designs for key in design.changes)
        values = [
            {item.key: f"{item.value or item.default} {item.unit}".strip() for item in fields}
            for fields in map(self.fields_of, designs)
        ]
        rows = [[key, *(texts.get(key, "") or "none" for texts in values)] for key in keys]
        present = [row for answer in (self.test, self.lives) if answer for row in answer.rows]
        for row in present:
            cells = [_compared(_row_of(pin, row.label), row) for pin in self.pins]
            rows.append([row.label, row.text, *cells])
        return heads, rows

    def link(self) -> str:
        """Return the changes as text for a link."""
        return json.dumps(dict(self.design.changes), ensure_ascii=False)


#: keys that determine by their value which other keys a table has
_NAMING = ("kind", "law", "model", "distribution")


def _with_range(item: Field, start: Field | None) -> Field:
    """Return a field with the slider of the file's value, widened to hold the present one."""
    if item.slider is None or start is None or start.slider is None or start.unit != item.unit:
        return item
    slider = start.slider
    try:
        value = float(item.value) if item.value is not None else None
    except ValueError:
        return item
    if value is not None and not slider.low <= value <= slider.high:
        low, high = min(slider.low, value), max(slider.high, value)
        slider = replace(slider, low=low, high=high, log=slider.log and low > 0.0)
    return replace(item, slider=slider)


def key_of(mistake: FieldMistake, keys: Sequence[str]) -> str:
    """Return the key beside which a mistake stands, or an empty text.

    A mistake on one of several keys stands beside the first of them, one on a part of a list
    beside that part.
    """
    match = _ENTRY.fullmatch(mistake.key)
    name, entry = (match[1], match[2]) if match else (mistake.key, None)
    table = mistake.table
    known = set(keys)
    for word in re.split(r" (?:or|and) ", name):
        place = ".".join(filter(None, (table, word)))
        if entry is not None:
            number = str(int(entry) - 1)
            parts = (f"{table}.{number}.{word}", f"{place}.{number}")
            inside = (key for key in keys if key.startswith(f"{place}.{number}."))
            place = next((part for part in parts if part in known), next(inside, place))
        if place in known:
            return place
        inner = next((key for key in keys if key.startswith(f"{place}.")), "")
        if inner and word:
            return inner
    return ""


def with_pinned(panel: Panel, pinned: Sequence[tuple[str, Panel]]) -> Panel:
    """Return a panel with the curves of other designs below its own, at their last record.

    Parameters
    ----------
    panel : Panel
    pinned : sequence of (str, Panel)
        Names and panels of the other designs.
    """
    below: list[Any] = []
    for number, (name, pinned_panel) in enumerate(pinned):
        if (
            pinned_panel.x.unit != panel.x.unit
            or pinned_panel.x.log != panel.x.log
            or pinned_panel.y.log != panel.y.log
        ):
            continue
        style: dict[str, Any] = {"colour": _GREYS[number % len(_GREYS)], "width": 1.0}
        style["dash"] = _DASHES[number % len(_DASHES)]
        label = f"pinned {name}"
        for mark in pinned_panel.marks:
            if isinstance(mark, Records):
                line = Line(mark.x, mark.y[-1], label=label, **style)
            elif isinstance(mark, Line) and _is_content(mark) and not mark.right:
                line = Line(mark.x, mark.y, label=label, steps=mark.steps, **style)
            else:
                continue
            below.append(line)
            label = ""  # the entry of the legend stands for all lines of the design
    return replace(panel, marks=[*below, *panel.marks]) if below else panel


def _is_content(mark: Line) -> bool:
    """Return whether a line is a curve, not an axis or a boundary."""
    return (
        bool(mark.dash)
        and mark.width >= _LEAST_WIDTH
        and getattr(mark.x, "ndim", 0) == 1
        and (getattr(mark.y, "ndim", 0) == 1)
    )


def _row_of(pin: Pin, label: str) -> Quantity | None:
    rows = (row for answer in pin.answers for row in answer.rows)
    return next((row for row in rows if row.label == label), None)


def _compared(pinned: Quantity | None, present: Quantity) -> str:
    """Return the text of a pinned row, with how much the present one differs from it."""
    if pinned is None:
        return ""
    before, after = pinned.number, present.number
    if before and after and before[0] and before[1] == after[1]:
        return f"{pinned.text} (now {100.0 * (after[0] / before[0] - 1.0):+.1f} %)"
    return pinned.text
