"""Pictures of the page for the documentation: ``python plugins/wearsim-explore/tests/pictures.py``.

They are written to `docs/explore`; Chromium is needed.
"""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import sync_playwright

import wearsim
from wearsim_explore.server import Exploration, design_of

ROOT = Path(__file__).parents[3]
FOLDER = ROOT / "docs" / "explore"
COLOURS = 128
FACTOR = {"distribution": "lognormal", "median": 1, "factor": 1.5}
CAM = {"title": "eccentric cam", "wear.factor": FACTOR, "limit.depth": "60 um"}


def rested(page: Any, number: str) -> None:
    """Wait for the refined result of a later state than that with a number."""
    stage = f'#status:is([data-stage=final], [data-stage=lives]):not([data-number="{number}"])'
    page.wait_for_selector(stage, timeout=300_000)


def change(page: Any, key: str, value: str) -> None:
    """Type a value and wait for the refined result."""
    before = page.locator("#status").get_attribute("data-number")
    page.locator(f'.field[data-key="{key}"] input[type=text]').fill(value)
    page.keyboard.press("Enter")
    rested(page, before)


def picture(page: Any, name: str) -> None:
    """Take a picture, with few colours."""
    page.wait_for_timeout(600)
    path = FOLDER / f"{name}.png"
    page.screenshot(path=path)
    Image.open(path).convert("RGB").quantize(COLOURS).save(path, optimize=True)


def main() -> None:
    """Take all pictures."""
    FOLDER.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox"]
        )
        for name in ("rig-450min", "cam-eccentric"):
            file = Path(folder) / f"{name}.toml"
            text = wearsim.load_scenario(ROOT / "scenarios" / f"{name}.toml").text
            file.write_text(text if name[0] == "r" else wearsim.Scenario.from_toml(text, CAM).text)
            server = Exploration(design_of(file))
            scheme = "light" if name[0] == "r" else "dark"
            page = browser.new_page(viewport={"width": 1360, "height": 860}, color_scheme=scheme)
            page.goto(server.address)
            rested(page, "none")
            if name[0] == "r":
                page.get_by_role("button", name="Pin design").click()
                page.wait_for_selector("#pins:visible")
                change(page, "roller.crown_radius", "350")
                picture(page, "rig")
                page.locator("#pins").scroll_into_view_if_needed()
                picture(page, "pinned")
                page.evaluate("scrollTo(0, 0)")
                page.locator('.field[data-key="friction.coefficient"] input[type=text]').fill("-1")
                page.keyboard.press("Enter")
                page.wait_for_selector("#status[data-stage=failed]")
                picture(page, "mistake")
            else:
                page.wait_for_function(
                    "document.getElementById('life-progress').textContent.includes('exact')",
                    timeout=300_000,
                )
                page.locator("#time").evaluate("node => scrollTo(0, node.offsetTop - 150)")
                picture(page, "cam")
            page.close()
            server.close()
        browser.close()


if __name__ == "__main__":
    main()
