"""Write the version in `pyproject.toml` to all places that state it; `--check` only compares.

The distributions of `plugins/` have the version of wearsim, and most of them require it. The
template of plugins, which authors copy, has its own version and is not published.
"""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
TEMPLATE = "wearsim-template"


def distributions() -> list[Path]:
    """Return the folders of all distributions that are published, wearsim first."""
    folders = sorted(path.parent for path in (ROOT / "plugins").glob("*/pyproject.toml"))
    return [ROOT, *(folder for folder in folders if folder.name != TEMPLATE)]


def rewritten() -> dict[Path, str]:
    """Return the text of every file that states the version, with the present one."""
    version = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    patterns = {
        r'^version = "[^"]+"$': f'version = "{version}"',
        r"(wearsim(?:-[a-z0-9]+)?(?:\[[a-z]+\])?)==[0-9][^\"]*": rf"\1=={version}",
    }
    texts = {}
    for folder in distributions():
        text = (folder / "pyproject.toml").read_text("utf-8")
        for pattern, new in patterns.items():
            text = re.sub(pattern, new, text, flags=re.MULTILINE)
        texts[folder / "pyproject.toml"] = text
    citation = ROOT / "CITATION.cff"
    text = citation.read_text("utf-8")
    texts[citation] = re.sub(r"^version: .*$", f"version: {version}", text, flags=re.MULTILINE)
    recipe = ROOT / "release" / "recipe.yaml"
    text = recipe.read_text("utf-8")
    texts[recipe] = re.sub(r'^  version: "[^"]+"$', f'  version: "{version}"', text, flags=re.M)
    return texts


def main() -> int:
    """Write the version, or return 1 if `--check` finds another one."""
    differing = [path for path, text in rewritten().items() if path.read_text("utf-8") != text]
    names = [str(path.relative_to(ROOT)) for path in differing]
    if "--check" in sys.argv:
        if names:
            sys.stderr.write(f"{', '.join(names)}: another version; run release/version.py\n")
        return 1 if names else 0
    for path, text in rewritten().items():
        path.write_text(text, "utf-8")
    sys.stdout.write(f"changed: {', '.join(names) or 'nothing'}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
