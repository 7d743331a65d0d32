"""The language of the project: no words that a reader of the field would have to decode."""

from __future__ import annotations

import io
import re
import tokenize
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FORBIDDEN = re.compile(
    r"\b("
    r"tells?|told|telling|company|twins?|rooms?|guests?|seams?|shadows?|whoever|lest|manners|frail"
    r"|replay(s|ed|ing)?|scenes?|yielding|honest(ly)?|anew|riddle|owes?|foreseen|spared|alike"
    r"|what is out|by itself|by themselves|of its own|of their own|goes on|in the place of"
    r"|law of maximum entropy|minds?|believes?|judges?|judged|feels?"
    r")\b",
    re.IGNORECASE,
)
ALLOWED = re.compile(r"twin[- ]disc", re.IGNORECASE)
SOURCES = [
    path
    for pattern in (
        "wearsim/**/*.py",
        "plugins/*/src/**/*.py",
        "scenarios/*.toml",
        "wearsim/**/*.toml",
    )
    for path in sorted(ROOT.glob(pattern))
]
GENERATED = {"_build", "generated"}
PAGES_OF_SITE = [
    page
    for page in sorted((ROOT / "docs").rglob("*.md"))
    if not GENERATED.intersection(page.relative_to(ROOT).parts)
]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *PAGES_OF_SITE]
PAGES += sorted(ROOT.glob("plugins/**/README.md"))


def prose(path: Path) -> list[tuple[int, str]]:
    """Return the comments, docstrings and messages of a file with their line numbers."""
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        return list(enumerate(text.splitlines(), 1))
    kinds = {tokenize.COMMENT, tokenize.STRING}
    kinds |= {getattr(tokenize, "FSTRING_MIDDLE", tokenize.STRING)}
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    return [
        (token.start[0] + number, line)
        for token in tokens
        if token.type in kinds
        for number, line in enumerate(token.string.splitlines())
    ]


@pytest.mark.parametrize("path", [*SOURCES, *PAGES], ids=lambda path: str(path.relative_to(ROOT)))
def test_prose_uses_no_private_vocabulary(path: Path):
    if not FORBIDDEN.search(ALLOWED.sub("", path.read_text(encoding="utf-8"))):
        return  # to find the comments and texts of a module takes most of the time
    found = [
        f"{path.relative_to(ROOT)}:{number}: '{match[0]}' in: {line.strip()}"
        for number, line in prose(path)
        for match in FORBIDDEN.finditer(ALLOWED.sub("", line))
    ]
    assert not found, "\n".join(found)
