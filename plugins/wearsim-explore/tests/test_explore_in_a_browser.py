"""The page, seen and used in Chromium; skipped where there is no browser."""

from __future__ import annotations

import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import sync_playwright

import wearsim
from wearsim_explore.server import Exploration, design_of

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium: apt-get install chromium"),
]
RIG = (Path(__file__).parent / "rig.toml").read_text()
CAM = Path(__file__).parents[3] / "scenarios" / "cam-eccentric.toml"
SLIDER = "roller crown radius, slider"


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield started
        started.close()


def served(path: Path) -> Exploration:
    return Exploration(design_of(path), workers=1)


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Exploration]:
    path = tmp_path_factory.mktemp("rig") / "rig.toml"
    path.write_text(RIG)
    server = served(path)
    yield server
    server.close()


@pytest.fixture(scope="module")
def cam(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Exploration]:
    """Return a server on a short test of a cam, with a limit and a scattered wear factor."""
    path = tmp_path_factory.mktemp("cam") / "cam.toml"
    factor = {"distribution": "lognormal", "median": 1, "factor": 1.5}
    changes = {"operation.turns": 20_000, "wear.factor": factor, "limit.depth": "2 um"}
    path.write_text(wearsim.load_scenario(CAM, changes).text)
    server = served(path)
    yield server
    server.close()


def opened(browser: Any, address: str, width: int = 1280, scheme: str = "light") -> Any:
    """Return a page with its refined result."""
    page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
    page.seen = []
    page.on("pageerror", lambda error: page.seen.append(str(error)))
    page.on(
        "request",
        lambda request: "" if "//127.0.0.1" in request.url else page.seen.append(request.url),
    )
    page.goto(address)
    rested(page)
    return page


def rested(page: Any, changed: bool = False) -> None:
    """Wait for the refined result of the present state, of a later one if it is changed."""
    before = page.locator("#status").get_attribute("data-number") if changed else None
    stage = "#status:is([data-stage=final], [data-stage=lives])"
    other = f':not([data-number="{before}"])' if changed else ""
    page.wait_for_selector(f"{stage}{other}", timeout=120_000)


def rows(page: Any) -> dict[str, str]:
    labels = page.locator("#rows dt").all_inner_texts()
    values = page.locator("#rows dd").all_inner_texts()
    answer = page.locator("#answer-label").inner_text(), page.locator("#answer").inner_text()
    return dict([answer, *zip(labels, values, strict=True)])


def field(page: Any, key: str) -> Any:
    return page.locator(f'.field[data-key="{key}"] input[type=text]')


def test_numbers_are_those_of_run_by_keyboard_alone(browser: Any, rig: Exploration) -> None:
    page = opened(browser, rig.address)
    for _ in range(200):  # from the top of the page to the slider
        page.keyboard.press("Tab")
        label = page.evaluate("document.activeElement.getAttribute('aria-label')")
        if label == SLIDER:
            break
    assert label == SLIDER
    for _ in range(5):
        page.keyboard.press("ArrowRight")
    page.wait_for_function("document.activeElement.getAttribute('aria-valuetext') !== '500 mm'")
    page.wait_for_selector('#status[data-stage=final]:not([data-number="0"])', timeout=120_000)
    text = page.evaluate("document.activeElement.getAttribute('aria-valuetext')")
    expected = wearsim.run(rig.design.scenario({"roller.crown_radius": text})).view.rows()
    assert rows(page) == {row.label: " ".join(row.text.split()) for row in expected}
    page.keyboard.press("Control+z")
    page.wait_for_function("document.getElementById('reset').disabled")
    assert field(page, "roller.crown_radius").input_value() == "500"
    assert page.seen == []
    page.close()


def test_drag_has_one_final_result(browser: Any, rig: Exploration) -> None:
    page = opened(browser, rig.address)
    shown = rig.pages[-1]
    schedule, asked, most = rig.pool.schedules["quick"], [], [0, 0]
    ask = schedule.ask

    def counted(request: Any) -> None:
        ask(request)
        asked.append(request.stage)
        running = [one for one in schedule.running.values() if one.session == request.session]
        waiting = [one for name, one in schedule.waiting.items() if name == request.session]
        most[:] = max(most[0], len(running)), max(most[1], len(waiting))

    schedule.ask = counted  # type: ignore[method-assign]
    finals = shown.finals
    slider = page.get_by_label(SLIDER)
    box = slider.bounding_box()
    middle = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + box["width"] / 2, middle)
    page.mouse.down()
    for step in range(200):
        page.mouse.move(box["x"] + box["width"] * (0.5 + 0.002 * step), middle)
    page.mouse.up()
    value = field(page, "roller.crown_radius").input_value()
    page.wait_for_selector('#status[data-stage=final]:not([data-number="0"])', timeout=120_000)
    page.wait_for_timeout(1000)  # in which nothing more is to come
    del schedule.ask  # type: ignore[method-assign]
    assert asked.count("first") > 20
    assert most == [1, 1]
    assert shown.finals - finals == 1
    assert shown.session.design.changes == {"roller.crown_radius": f"{value} mm"}
    page.keyboard.press("Escape")
    page.get_by_role("button", name="Undo").click()  # the drag is one step
    page.wait_for_function("document.getElementById('undo').disabled")
    page.close()


def test_mistakes_are_beside_their_fields_and_the_picture_stays(
    browser: Any, rig: Exploration
) -> None:
    page = opened(browser, rig.address)
    before = rows(page)
    field(page, "friction.coefficient").fill("-1")
    page.keyboard.press("Enter")
    page.wait_for_selector("#status[data-stage=failed]")
    mistake = page.locator('.field[data-key="friction.coefficient"] .mistake').inner_text()
    assert mistake == "[friction] coefficient: is out of range, got -1, expected a number above 0"
    assert rows(page) == before
    assert page.locator("#shown.stale figure:visible").count() >= 3
    page.get_by_role("button", name="Undo").click()
    page.wait_for_selector("#shown:not(.stale)")
    page.close()


def test_link_carries_the_state_without_the_token(browser: Any, rig: Exploration) -> None:
    page = opened(browser, rig.address)
    page.get_by_label("Find a value").fill("roller width")
    field(page, "roller.width").fill("14")
    page.keyboard.press("Enter")
    page.wait_for_selector('#status[data-stage=final]:not([data-number="0"])', timeout=120_000)
    page.get_by_role("button", name="Copy as --set").click()
    assert page.locator("#copied").input_value() == "--set 'roller.width=14 mm'"
    page.get_by_role("button", name="Copy a link").click()
    link = page.locator("#copied").input_value()
    address, _, token = rig.address.partition("?token=")
    assert token not in link
    assert link.startswith(f"{address}#")
    page.close()
    # without the token the page asks for it, and then shows the state
    other = browser.new_page()
    other.goto(link)
    other.get_by_label("Token").fill(token)
    other.get_by_role("button", name="Open").click()
    other.wait_for_function(
        """document.querySelector('.field[data-key="roller.width"] input')?.value === '14'"""
    )
    other.close()


def test_cam_is_shown_and_accessible(browser: Any, cam: Exploration) -> None:
    page = opened(browser, cam.address, 390, "dark")
    page.wait_for_function("document.getElementById('life-progress').textContent.includes('exact')")
    titles = " ".join(page.locator("figure:visible h3").all_inner_texts())
    for name in ("Turning cam", "Motion", "Normal force", "Worn depth", "Lift error", "Survival"):
        assert name.lower() in titles.lower(), name
    assert "B10" in page.locator("#life-rows").inner_text()
    data = "Bokeh.documents[0].get_model_by_name('slot0').children[0].renderers[1].data_source.data"
    before = page.evaluate(f"Array.from({data}.x)")
    page.get_by_label("Angle of the cam").focus()
    page.keyboard.press("ArrowRight")
    assert page.evaluate(f"Array.from({data}.x)") != before
    page.get_by_role("button", name="Pin design").click()
    page.wait_for_selector("#pins:visible")
    for width, scheme in ((390, "dark"), (1920, "light")):
        page.set_viewport_size({"width": width, "height": 900})
        page.emulate_media(color_scheme=scheme)
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        found = Axe().run(page).response["violations"]
        assert [(item["id"], item["nodes"][0]["html"][:200]) for item in found] == []
    assert [text for text in page.seen if not re.match("data:|blob:", text)] == []
    page.close()


def test_page_says_that_the_server_has_ended(browser: Any, tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_text(RIG)
    command = [sys.executable, "-m", "wearsim", "explore", str(path), "--no-browser"]
    output = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "text": True}
    with subprocess.Popen(command, **output) as process:  # type: ignore[call-overload]
        page = opened(browser, process.stdout.readline().strip())
        before = rows(page)
        process.send_signal(signal.SIGKILL)
        page.wait_for_selector("#status.lost", timeout=20_000)
    assert "The server has ended" in page.locator("#status").inner_text()
    assert rows(page) == before
    assert page.get_by_label(SLIDER).is_disabled()
    page.close()
