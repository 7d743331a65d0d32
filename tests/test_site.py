"""The site of the documentation: it builds without warnings, and its pages work in a browser."""

from __future__ import annotations

import functools
import http.server
import shutil
import subprocess
import sys
import threading
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
    """Return the folder of a site built with warnings as errors."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html"]
    done = subprocess.run(
        [*command, "-d", folder / "doctrees", ROOT / "docs", folder / "html"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-4000:]
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
