"""State of a page: changes, undo, pinned designs, and mistakes beside their fields."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wearsim
from wearsim.report import Axis, Line, Panel, Records
from wearsim_explore.answers import Answer, Drawn, FieldMistake, Quantity, Request, answer
from wearsim_explore.design import Design
from wearsim_explore.session import Session, key_of, with_pinned


@pytest.fixture(scope="module")
def schema() -> dict[str, Any]:
    return wearsim.scenario_schema()


@pytest.fixture
def session(rig: Path, schema: Any) -> Session:
    return Session(schema, Design(rig.read_text(), rig))


def computed(session: Session, stage: Any = "first") -> Answer:
    scratch = session.design.file.parent
    return answer(Request("s", session.number, stage, session.design, scratch), lambda: False)


def test_numbers_of_the_refined_result_are_those_of_run(session: Session) -> None:
    session.change("friction.coefficient", "0.12")
    rows = computed(session, "final").rows
    result = wearsim.run(session.design.scenario())
    assert [(row.label, row.text) for row in rows] == [
        (row.label, row.text) for row in result.view.rows()
    ]


def test_drag_is_one_step_of_undo(session: Session) -> None:
    before = session.design
    session.change("roller.radius", "21", begins=True)
    for value in ("22", "23"):
        session.change("roller.radius", value)
    session.change("load.normal_force", "310", begins=True)
    assert session.design.changes == {"roller.radius": "23 mm", "load.normal_force": "310 N"}
    session.undo()
    assert session.design.changes == {"roller.radius": "23 mm"}
    session.undo()
    assert session.design == before
    assert not session.can_undo


def test_reset_can_be_undone(session: Session) -> None:
    session.change("roller.radius", "21")
    session.reset()
    assert session.design.changes == {}
    session.undo()
    assert session.design.changes == {"roller.radius": "21 mm"}


def test_every_change_has_a_new_number(session: Session) -> None:
    numbers = [session.number]
    for act in (lambda: session.change("roller.radius", "21"), session.undo, session.reset):
        act()
        numbers.append(session.number)
    assert numbers == [0, 1, 2, 3]


def test_slider_keeps_its_range_and_holds_the_value(session: Session) -> None:
    def slider() -> Any:
        fields = session.fields_of(session.design)
        return next(one.slider for one in fields if one.key == "roller.radius")

    before = slider()
    session.change("roller.radius", "60")
    assert slider() == before
    session.change("roller.radius", "200")
    assert (slider().low, slider().high) == (before.low, 200.0)


def test_other_choice_removes_the_options_of_the_former(session: Session) -> None:
    session.change("load.kind", "spring")
    fields = {one.key: one for one in session.fields_of(session.design)}
    assert {"load.stiffness", "load.normal_force"} <= set(fields)
    session.change("load.stiffness", "690 N/mm")
    assert session.design.scenario().load.kind == "spring"
    session.undo()
    session.undo()
    assert session.design.changes == {}


def test_mistakes_stand_beside_their_fields_in_the_words_of_check(session: Session) -> None:
    session.receive(computed(session), lives=False)
    good = session.test
    session.change("friction.coefficient", "-1")
    session.change("roller.radius", "20 N")
    session.receive(computed(session), lives=False)
    with pytest.raises(wearsim.ScenarioError) as caught:
        session.design.scenario()
    beside, others = session.beside_fields()
    assert set(beside) == {"friction.coefficient", "roller.radius"}
    assert sorted(beside.values()) == sorted(map(str, caught.value.mistakes))
    assert not others
    assert session.test is good  # the last good result stays


@pytest.mark.parametrize(
    ("table", "key", "field"),
    [
        ("roller", "radius or diameter", "roller.radius"),
        ("cam", "motion (entry 2)", "cam.motion.1.law"),
        ("cam.motion", "rise (entry 2)", "cam.motion.1.rise"),
        ("wear.cylinder", "k_over_h", "wear.cylinder.k_over_h"),
        ("", "title", "title"),
        ("wear", "", ""),
        ("", "line 3", ""),
    ],
)
def test_mistake_is_found_at_its_field(table: str, key: str, field: str) -> None:
    keys = ["title", "roller.radius", "cam.motion.0.law", "cam.motion.1.law", "cam.motion.1.rise"]
    keys.append("wear.cylinder.k_over_h")
    assert key_of(FieldMistake(table, key, ""), keys) == field


def panel(height: float) -> Panel:
    y = np.linspace(-1.0, 1.0, 3)
    marks = [
        Records(y, height * np.ones((2, 3)), np.array([0.0, 1.0])),
        Line(y, y, right=True),
        Line([0.0], [0.0], dash="", marker="o"),
    ]
    return Panel("groove", Axis("y", "mm"), Axis("height", "um"), marks)


def test_pinned_design_lies_below_as_a_line() -> None:
    below, *above = with_pinned(panel(1.0), [("A", panel(2.0))]).marks
    assert isinstance(below, Line)
    assert below.label == "pinned A"
    np.testing.assert_array_equal(below.y, [2.0, 2.0, 2.0])
    assert len(above) == 3
    other = Panel("other", Axis("y", "deg"), Axis(), panel(2.0).marks)
    assert len(with_pinned(panel(1.0), [("A", other)]).marks) == 3


def test_table_compares_with_pinned_designs(session: Session) -> None:
    drawn: dict[str, Drawn] = {}
    session.receive(Answer(rows=(Quantity("depth", "40 um ± 1 um"),), panels=drawn), lives=False)
    session.pin()
    session.change("friction.coefficient", "0.12")
    session.receive(Answer(rows=(Quantity("depth", "50.0 um"),), panels=drawn), lives=False)
    heads, rows = session.differences()
    assert heads == ["", "now", "A"]
    assert rows == [
        ["friction.coefficient", "0.12", "0.1"],
        ["depth", "50.0 um", "40 um ± 1 um (now +25.0 %)"],
    ]
    session.pin()
    session.unpin(0)
    assert [pin.name for pin in session.pins] == ["B"]


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("69.97 ± 0.00039 mm^3", (69.97, "mm^3")),
        ("1,350,000", (1_350_000.0, "")),
        ("850,000 passes [780,000..920,000]", (850_000.0, "passes")),
        ("0.012 um, 0.025 %", None),
        ("not reached", None),
    ],
)
def test_number_of_a_row_is_read(text: str, number: Any) -> None:
    assert Quantity("", text).number == number


def test_lives_of_the_wear_factor_are_exact_at_once(session: Session) -> None:
    session.change("limit.depth", "2 um")
    median = {"distribution": "lognormal", "median": "1.1e-11 1/Pa", "factor": 1.5}
    changes = {"limit.depth": "2 um", "wear.cylinder.k_over_h": median}
    session.restore(changes)
    found = computed(session, "lives")
    assert (found.tests, found.is_last) == (1, True)
    lives = wearsim.life(session.design.scenario(), 1, scheduler="serial")
    assert [row.text for row in found.rows] == [row.text for row in lives.view.rows()]
    assert "life survival" in found.drawn
    # with other random inputs they have their means, and tests follow
    uniform = {"distribution": "uniform", "low": 0.08, "high": 0.12}
    session.restore({**changes, "friction.coefficient": uniform})
    found = computed(session, "lives")
    assert not found.is_last
    assert [row.text for row in found.rows] == [row.text for row in lives.view.rows()]


def test_panels_are_those_of_the_view(session: Session) -> None:
    found = computed(session)
    result = wearsim.run(session.design.scenario({"evolution.tolerance": 0.1}))
    shown = [n for n, one in result.view.panels().panels.items() if not one.figure_only]
    assert list(found.drawn) == shown
