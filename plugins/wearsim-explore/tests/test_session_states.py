"""The session of a page in any sequence of changes, undos, pins and answers."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

import wearsim
from tests.stateful import STATES
from wearsim_explore.answers import Answer, FieldMistake, Quantity
from wearsim_explore.design import Design
from wearsim_explore.session import MOST_PINS, Session

RIG = Path(__file__).parent / "rig.toml"
UNITS = {"roller.radius": " mm", "load.normal_force": " N", "friction.coefficient": ""}
VALUES = st.sampled_from(["0.12", "21", "310.5"])
KEYS = st.sampled_from(sorted(UNITS))


@cache
def schema() -> dict[str, Any]:
    return wearsim.scenario_schema()


class SessionStates(RuleBasedStateMachine):
    """A session beside a plain list of its designs."""

    def __init__(self) -> None:
        super().__init__()
        self.session = Session(schema(), Design(RIG.read_text(), RIG))
        self.changes: dict[str, Any] = {}
        self.before: list[dict[str, Any]] = []
        self.last_key = ""
        self.number = 0
        self.pins: list[dict[str, Any]] = []
        self.texts: dict[bool, str] = {}  # of the last answers, by whether they are lives
        self.mistakes = 0

    def _renewed(self, changes: dict[str, Any], last_key: str = "") -> None:
        self.changes, self.last_key = changes, last_key
        self.number += 1
        self.mistakes = 0

    @rule(key=KEYS, text=VALUES, begins=st.booleans(), slides=st.booleans())
    def change(self, key: str, text: str, begins: bool, slides: bool) -> None:
        self.session.change(key, text, begins=begins, slides=slides)
        if begins or key != self.last_key:
            self.before.append(self.changes)
        written = f"{text}{UNITS[key]}" if UNITS[key] else float(text)
        self._renewed({**self.changes, key: written}, key)

    @rule()
    def undo(self) -> None:
        self.session.undo()
        if self.before:
            self._renewed(self.before.pop())

    @rule()
    def reset(self) -> None:
        self.session.reset()
        self.before.append(self.changes)
        self._renewed({})

    @rule()
    def follow_the_link(self) -> None:
        design = self.session.design
        self.session.restore(json.loads(self.session.link()))
        assert self.session.design == design
        self.before.append(self.changes)
        self._renewed(self.changes)

    @rule(lives=st.booleans(), value=st.integers(1, 99))
    def receive(self, lives: bool, value: int) -> None:
        row = Quantity("depth", f"{value} um")
        self.session.receive(Answer(rows=(row,)), lives=lives)
        self.texts[lives] = row.text
        if not lives:
            self.mistakes = 0

    @rule(lives=st.booleans())
    def receive_a_mistake(self, lives: bool) -> None:
        mistake = FieldMistake("roller", "radius", "is out of range")
        self.session.receive(Answer(mistakes=(mistake,)), lives=lives)
        self.mistakes = 1
        assert "roller.radius" in self.session.beside_fields()[0]

    @rule()
    def pin(self) -> None:
        self.session.pin()
        if self.texts and len(self.pins) < MOST_PINS:
            self.pins.append(self.changes)

    @precondition(lambda self: self.pins)
    @rule(data=st.data())
    def unpin(self, data: st.DataObject) -> None:
        place = data.draw(st.integers(0, len(self.pins) - 1))
        self.session.unpin(place)
        del self.pins[place]

    @invariant()
    def session_is_the_list(self) -> None:
        session = self.session
        assert session.design.changes == self.changes
        assert session.can_undo == bool(self.before)
        assert session.number == self.number
        assert len(session.mistakes) == self.mistakes
        shown = {False: session.test, True: session.lives}
        for lives, answer in shown.items():
            assert (answer.rows[0].text if answer else None) == self.texts.get(lives)

    @invariant()
    def pins_have_different_names_and_a_column_each(self) -> None:
        pins = self.session.pins
        assert [pin.design.changes for pin in pins] == self.pins
        assert len({pin.name for pin in pins}) == len(pins)
        heads, rows = self.session.differences()
        assert heads == ["", "now", *(pin.name for pin in pins)]
        assert all(len(row) == len(heads) for row in rows)


TestSessionStates = SessionStates.TestCase
TestSessionStates.settings = STATES
