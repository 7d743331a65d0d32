"""A new plugin, made from the one that comes with wearsim."""

from __future__ import annotations

import re
from pathlib import Path

_PACKAGE = Path(__file__).parents[1]
# an installed package holds it; in the source tree it stands beside it
_FOLDERS = (_PACKAGE / "plugin_template", _PACKAGE.parent / "plugins" / "wearsim-template")
_LEFT_OUT = {"__pycache__", "build", "dist"}
NAME = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")


def template_folder() -> Path:
    """Return where the template lies, installed or not."""
    return next((folder for folder in _FOLDERS if folder.is_dir()), _FOLDERS[0])


def renamed(text: str, name: str) -> str:
    """Return a text of the template with its own names replaced.

    Parameters
    ----------
    text : str
        The content of a file, or a path.
    name : str
        Name of the contact model, lower-case words joined by hyphens.
    """
    under, camel = name.replace("-", "_"), "".join(map(str.capitalize, name.split("-")))
    for old, new in (
        ("wearsim-template", f"wearsim-{name}"),
        ("wearsim_template", f"wearsim_{under}"),
        ("test_winkler", f"test_{under}"),
        ("_winkler", f"_{under}"),
        ("winkler", name),
        ("Winkler", camel),
    ):
        text = text.replace(old, new)
    return text


def write_plugin(name: str, directory: Path) -> list[Path]:
    """Write a distribution with a contact model of its own into ``directory/wearsim-NAME``.

    Parameters
    ----------
    name : str
        Name of the contact model.
    directory : Path
        Where its folder goes; made where it does not exist.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    ValueError
        If the name is not made of lower-case words joined by hyphens.
    FileExistsError
        If the folder exists.
    """
    if not NAME.fullmatch(name) or name.startswith("wearsim"):
        raise ValueError(
            f"'{name}' cannot be the name of a contact model; expected lower-case words joined by"
            " hyphens, 'soft-layer', without 'wearsim', which is added"
        )
    source, target = template_folder(), directory / f"wearsim-{name}"
    if target.exists():
        raise FileExistsError(f"{target} exists")
    written = []
    for path in sorted(source.rglob("*")):
        parts = path.relative_to(source).parts
        if path.is_dir() or any(part in _LEFT_OUT or part.startswith(".") for part in parts):
            continue
        own = target / renamed(path.relative_to(source).as_posix(), name)
        own.parent.mkdir(parents=True, exist_ok=True)
        own.write_text(renamed(path.read_text(encoding="utf-8"), name), encoding="utf-8")
        written.append(own)
    return written
