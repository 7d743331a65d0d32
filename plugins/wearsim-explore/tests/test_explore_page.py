"""What a page asks for: a first answer, a refined one at rest, and lives of more and more tests."""

from __future__ import annotations

import asyncio
import json
from base64 import b64decode
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bokeh.document import Document

import wearsim
from wearsim.report import Axis, Line, Panel, record
from wearsim_explore import page as page_module
from wearsim_explore.answers import Answer, Drawn, FieldMistake, Quantity, Request
from wearsim_explore.design import Design
from wearsim_explore.page import Page

DONE = Answer(rows=(Quantity("depth", "1 um"),))
SCATTER = {"distribution": "lognormal", "median": "1.1e-11 1/Pa", "factor": 1.5}


class Asked:
    """Pool that keeps the requests."""

    def __init__(self) -> None:
        self.listeners: dict[str, Callable[..., None]] = {}
        self.requests: list[Request] = []

    def ask(self, request: Request) -> None:
        self.requests.append(request)

    @property
    def stages(self) -> list[tuple[str, int]]:
        return [(one.stage, one.tests) for one in self.requests]


@pytest.fixture
def opened(rig: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[Page, Asked]]:
    """Return a function that opens a page without a server; its rests are short."""
    monkeypatch.setattr(page_module, "REST", 0.01)
    monkeypatch.setattr(page_module, "REST_HELD", 0.3)

    def opened(**changes: object) -> tuple[Page, Asked]:
        text = wearsim.load_scenario(rig, changes or None).text
        asked, design = Asked(), Design(text, rig)
        document, schema = Document(), wearsim.scenario_schema()
        return Page(document, design, schema, asked, rig.parent, "a"), asked  # type: ignore[arg-type]

    return opened


def reply(page: Page) -> dict[str, Any]:
    shown: dict[str, Any] = json.loads(page._exchange.reply)
    return shown


def test_result_is_refined_once_the_hand_rests(opened: Any) -> None:
    page, asked = opened()

    async def drag() -> None:
        for value in range(20, 25):
            page.act("change", key="roller.radius", value=str(value), begins=False, held=True)
            page.receive(asked.requests[-1], DONE)
            await asyncio.sleep(0.02)  # longer than a rest, but the slider is held
        assert [stage for stage, _ in asked.stages] == ["first"] * 6
        page.act("release")
        await asyncio.sleep(0.03)

    asyncio.run(drag())
    assert [stage for stage, _ in asked.stages] == ["first"] * 6 + ["final"]
    assert asked.requests[-1].design.changes == {"roller.radius": "24 mm"}
    page.receive(asked.requests[-1], DONE)
    assert (page.finals, reply(page)["stage"]) == (1, "final")
    assert len(page.server_times) == 5


def test_answer_to_a_former_state_is_shown_but_not_refined(opened: Any) -> None:
    page, asked = opened()

    async def change() -> None:
        page.act("change", key="roller.radius", value="21", begins=True)
        page.act("change", key="roller.radius", value="22", begins=False)
        page.receive(asked.requests[-2], DONE)
        await asyncio.sleep(0.03)

    asyncio.run(change())
    assert [stage for stage, _ in asked.stages] == ["first"] * 3
    assert reply(page)["test"]["rows"] == [["depth", "1 um"]]


def test_lives_take_more_and_more_tests_until_a_change(opened: Any) -> None:
    friction = {"distribution": "uniform", "low": 0.08, "high": 0.12}
    factor = {"wear.cylinder.k_over_h": SCATTER, "limit.depth": "2 um"}
    page, asked = opened(**factor, **{"friction.coefficient": friction})

    async def compute() -> None:
        page.receive(asked.requests[-1], DONE)
        await asyncio.sleep(0.03)
        for _ in range(4):
            page.receive(asked.requests[-1], DONE)

    asyncio.run(compute())
    expected = [("first", 0), ("final", 0), ("lives", 0), ("lives", 16), ("lives", 32)]
    assert asked.stages == [*expected, ("lives", 64)]
    page.receive(asked.requests[-1], 48)  # progress
    assert (reply(page)["progress"], reply(page)["tests"]) == (48, 64)
    last = asked.requests[-1]
    page.act("change", key="roller.radius", value="21", begins=True)
    assert asked.stages[-1] == ("first", 0)
    before = reply(page)
    page.receive(last, 50)  # progress of the former state
    assert reply(page) == before


def test_numbers_of_figures_come_with_the_reply(opened: Any) -> None:
    page, asked = opened()
    x = np.linspace(0.0, 1.0, 5)
    panel = Panel("a", Axis("x", "mm"), Axis("y", "um"), [Line(1e-3 * x, 1e-6 * x**2)], "caption")
    drawn = replace(DONE, panels={"a": Drawn(panel, record(panel))})

    async def receive() -> None:
        page.receive(asked.requests[-1], drawn)

    asyncio.run(receive())
    sent = reply(page)["columns"]
    (ends,) = sent["ends"].values()
    numbers = np.frombuffer(b64decode(sent["numbers"]), "<f4")
    for name, expected in (("x", x), ("y", x**2)):
        assert numbers[slice(*ends[name])] == pytest.approx(expected, rel=1e-6)
    page.act("show")  # of a browser that connects later
    assert reply(page)["columns"] == sent
    page.end()
    assert reply(page)["ended"]
    assert "columns" not in reply(page)


def test_mistakes_ask_for_nothing_more(opened: Any) -> None:
    page, asked = opened()
    mistake = FieldMistake("friction", "coefficient", "[friction] coefficient: is out of range")
    page.act("change", key="friction.coefficient", value="-1", begins=True)
    page.receive(asked.requests[-1], Answer(mistakes=(mistake,)))
    shown = reply(page)
    assert shown["mistakes"] == {"friction.coefficient": mistake.text}
    assert shown["stage"] == "failed"
    assert len(asked.requests) == 2


def test_report_is_asked_for_beside_the_results(opened: Any) -> None:
    page, asked = opened()
    page.act("report")
    assert (asked.requests[-1].session, asked.requests[-1].stage) == ("a.report", "report")
    page.receive(asked.requests[-1], Answer(page="<html>"))
    assert reply(page)["page"] == "<html>"
