"""The site of the documentation: it builds without warnings, and its pages work in a browser."""

from __future__ import annotations

import functools
import http.server
import os
import re
import shutil
import subprocess
import sys
import threading
import time
from html import unescape
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
IN_A_BROWSER = pytest.mark.skipif(
    CHROMIUM is None, reason="there is no Chromium: apt-get install chromium"
)
PAGES = [
    "index",
    "start",
    "theory",
    "cam",
    "life",
    "speed",
    "tutorials/my-rig",
    "tutorials/identify",
    "tutorials/contact-model",
    "reference/generated/scenario-keys",
    "reference/generated/api/wearsim.run",
]
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a site built with warnings as errors, by one of the test processes."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "site"
    outcome = folder / "outcome.txt"
    try:
        folder.mkdir()
    except FileExistsError:  # another process builds it, or has built it
        while not outcome.exists():
            time.sleep(0.5)
    else:
        command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html"]
        done = subprocess.run(
            [*command, "-d", folder / "doctrees", ROOT / "docs", folder / "html"],
            capture_output=True,
            text=True,
            check=False,
        )
        part = folder / "part.txt"
        part.write_text(done.stderr[-4000:] if done.returncode else "")
        part.rename(outcome)
    assert outcome.read_text() == ""
    return folder / "html"


@pytest.fixture(scope="module")
def address(site: Path):
    """Return the address at which a server offers the site."""

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_: object) -> None:
            pass

    handler = functools.partial(Quiet, directory=str(site))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


@pytest.fixture(scope="module")
def browser():
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield found
        found.close()


def test_reference_is_written_from_the_package(site: Path):
    keys = (site / "reference" / "generated" / "scenario-keys.html").read_text()
    assert "crown_radius" in keys
    files = (site / "reference" / "generated" / "result-files.html").read_text()
    assert "cylinder_depth_profile" in files
    assert (site / "reference" / "generated" / "api" / "wearsim.run.html").exists()


def test_measured_numbers_are_on_their_pages(site: Path):
    for page in ("speed", "benchmarks", "hard-cases", "theory", "life"):
        text = (site / f"{page}.html").read_text(encoding="utf-8")
        assert "{{" not in text
        assert "Measured on 20" in text or "on 20" in text
    assert list((site / "_images").glob("stepping*.svg"))


def test_pages_load_nothing_from_elsewhere(site: Path):
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        assert 'src="http' not in text, page
        assert 'rel="stylesheet" href="http' not in text, page


def test_notebook_of_the_python_interface_has_its_outputs(site: Path):
    page = (site / "python.html").read_text(encoding="utf-8")
    cells = page.split('<div class="cell docutils container">')[1:]
    texts = {unescape(re.sub(r"<[^>]*>", "", cell)).strip(): cell for cell in cells}

    def shown(start: str) -> tuple[str, str]:
        """Return the text of a cell with its output, and its HTML."""
        (text,) = [text for text in texts if text.startswith(start)]
        return text, texts[text]

    progress = shown("result = wearsim.run")[0]
    assert "done in" in progress
    assert "90,000 (100 %)" not in progress  # the line is updated
    assert "finished: 90,000 passes" in progress
    assert "<img" in shown("result.plot()")[1]
    assert 'class="dataframe"' in shown("result.to_dataframe()")[1]
    assert "cylinder_depth_profile" in shown("result.to_xarray()")[0]
    ensemble = shown("ensemble = ")[0]
    assert "40 of 40 realisations" in ensemble
    assert "95 % interval" in ensemble
    assert "<img" in shown("from matplotlib")[1]
    assert "did you mean 'coefficient'?" in shown("try:")[0]


@IN_A_BROWSER
@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("name", PAGES)
def test_page_works_in_a_browser(browser, address: str, name: str, width: int):
    from axe_playwright_python.sync_playwright import Axe

    page = browser.new_page(viewport={"width": width, "height": 900})
    seen: list[str] = []
    page.on("console", lambda message: seen.append(message.text) if message.type == "error" else "")
    page.on("pageerror", lambda error: seen.append(str(error)))
    page.on(
        "request",
        lambda request: "" if request.url.startswith(address) else seen.append(request.url),
    )
    page.goto(f"{address}/{name}.html", wait_until="networkidle")
    if name == "theory":
        page.wait_for_selector("div.math .MathJax_Display")
    # before axe requests style sheets of its own
    assert [text for text in seen if not text.startswith("data:")] == []
    found = Axe().run(page).response["violations"]
    serious = [item for item in found if item["impact"] in {"serious", "critical"}]
    assert [(item["id"], item["nodes"][0]["html"][:200]) for item in serious] == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.close()
