"""The page on results, seen and used in Chromium; skipped where there is no browser."""

import re
import shutil

import pytest

import wearsim
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.opening import save_report

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium: apt-get install chromium"),
]
SHORT = {"operation.duration": "3 min", "outputs.records": 4}


@pytest.fixture(scope="module")
def browser():
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield found
        found.close()


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    rig = wearsim.run(shipped_scenario("rig-450min", SHORT))
    cam = wearsim.run(shipped_scenario("cam-eccentric", {"operation.turns": 20_000}))
    folder = tmp_path_factory.mktemp("tests")
    tests = wearsim.ensemble(shipped_scenario("rig-ensemble", SHORT), 24, folder / "tests.h5")
    return {"rig": [rig], "cam": [cam], "ensemble": [tests], "comparison": [rig, tests]}


@pytest.fixture(scope="module")
def pages(results, tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    for name, content in results.items():
        save_report(content, folder / f"{name}.html")
    return folder


def opened(browser, path, width=1280, scheme="light"):
    """Return a page with all its figures drawn, and what it has written and requested."""
    page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
    seen = []
    page.on("console", lambda message: seen.append(message.text) if message.type == "error" else "")
    page.on("pageerror", lambda error: seen.append(str(error)))
    page.on("request", lambda request: seen.append(request.url) if "http" in request.url else "")
    page.goto(path.as_uri())
    page.wait_for_function("Bokeh.documents.length && Bokeh.documents.every(d => d.is_idle)")
    return page, seen


@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("name", ["rig", "cam", "ensemble", "comparison"])
def test_page_has_no_errors_no_requests_and_fits_the_screen(browser, pages, name, width):
    page, seen = opened(browser, pages / f"{name}.html", width)
    assert seen == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.locator("figure").count() >= 3
    page.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("name", ["rig", "cam", "ensemble", "comparison"])
def test_page_is_accessible(browser, pages, name, scheme):
    from axe_playwright_python.sync_playwright import Axe

    page, _ = opened(browser, pages / f"{name}.html", scheme=scheme)
    found = Axe().run(page).response["violations"]
    assert [(item["id"], item["nodes"][0]["html"][:200]) for item in found] == []
    page.close()


def test_first_screen_fits_the_screen_and_one_printed_page(browser, pages):
    page, _ = opened(browser, pages / "cam.html")
    bottom = page.locator(".excluded").bounding_box()
    assert bottom["y"] + bottom["height"] < 800
    page.emulate_media(media="print")
    page.set_viewport_size({"width": 688, "height": 1017})  # A4 within margins of 14 mm
    bottom = page.locator(".excluded").bounding_box()
    assert bottom["y"] + bottom["height"] < 1017
    page.close()


SHOWN = """() => {
  const named = Bokeh.documents[0].get_model_by_name("record height above nominal");
  return Array.from(named.data.shown);
}"""


def test_slider_moves_the_profile(browser, pages, results):
    (result,) = results["rig"]
    page, _ = opened(browser, pages / "rig.html")
    slider = page.get_by_label("Profiles at")
    assert page.evaluate(SHOWN) == pytest.approx(-1e6 * result.profiles[-1], rel=1e-6)
    slider.focus()
    page.keyboard.press("Home")
    assert page.evaluate(SHOWN) == pytest.approx(-1e6 * result.profiles[0], rel=1e-6)
    assert "pass 0" in page.locator("output").inner_text()
    page.keyboard.press("ArrowRight")
    assert page.evaluate(SHOWN) == pytest.approx(-1e6 * result.profiles[1], rel=1e-6)
    page.close()


def test_hover_shows_the_value_of_the_file(browser, pages, results):
    (result,) = results["rig"]
    page, _ = opened(browser, pages / "rig.html")
    figure = page.get_by_role("figure").filter(has_text="Worn profile of the cylinder").first
    figure.scroll_into_view_if_needed()
    box = figure.locator("canvas").first.bounding_box()
    page.mouse.move(box["x"] + 0.55 * box["width"], box["y"] + 0.5 * box["height"])
    text = page.locator(".bk-tooltip-content").first.inner_text()
    y, height = (float(number) for number in re.findall(r"(-?[0-9.]+) (?:mm|um)", text))
    nearest = abs(1e3 * result.y - y).argmin()
    assert height == pytest.approx(-1e6 * result.profiles[-1][nearest], abs=6e-4)
    page.close()
