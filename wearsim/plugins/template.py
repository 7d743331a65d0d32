"""A new plugin, made from the one that comes with wearsim."""

from __future__ import annotations

import ast
import re
from keyword import iskeyword
from pathlib import Path

_PACKAGE = Path(__file__).parents[1]
# an installed package holds it; in the source tree it stands beside it
_FOLDERS = (_PACKAGE / "plugin_template", _PACKAGE.parent / "plugins" / "wearsim-template")
_LEFT_OUT = {"__pycache__", "build", "dist"}
_WORD = re.compile("wearsim_template|winkler|Winkler")
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
    new = {
        "wearsim-template": f"wearsim-{name}",
        "wearsim_template": f"wearsim_{under}",
        "_winkler": f"_{under}",
        "winkler": name,
        "Winkler": camel,
    }
    # in one go: the new name may hold a word of the template's, as in soft-winkler
    return re.sub("|".join(new), lambda found: new[found[0]], text)


def clash(name: str) -> str | None:
    """Return an identifier that a new plugin would give a second meaning, or a word of Python's.

    Parameters
    ----------
    name : str
        Name of the contact model, lower-case words joined by hyphens.
    """
    own = set().union(*(_identifiers(path) for path in _files() if path.suffix == ".py"))
    made = {item: renamed(item, name) for item in own if _WORD.search(item)}
    kept = own - set(made)
    return next((new for new in sorted(made.values()) if new in kept or iskeyword(new)), None)


def _identifiers(path: Path) -> set[str]:
    """Return the names that a file defines, imports or uses, but for attributes."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Name):
            found.add(node.id)
        elif isinstance(node, ast.arg):
            found.add(node.arg)
        elif isinstance(node, ast.ClassDef | ast.FunctionDef):
            found.add(node.name)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            found |= {alias.asname or alias.name for alias in node.names}
            found |= {node.module or ""} if isinstance(node, ast.ImportFrom) else set()
    return found


def _files() -> list[Path]:
    """Return the files of the template, but for what building and running leave behind."""
    source = template_folder()
    return [
        path
        for path in sorted(source.rglob("*"))
        if path.is_file()
        and not any(
            part in _LEFT_OUT or part.startswith(".") for part in path.relative_to(source).parts
        )
    ]


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
        If the name is not made of lower-case words joined by hyphens, or would give a name in
        the plugin's code a second meaning.
    FileExistsError
        If the folder exists.
    """
    if not NAME.fullmatch(name) or name.startswith("wearsim"):
        raise ValueError(
            f"'{name}' cannot be the name of a contact model; expected lower-case words joined by"
            " hyphens, 'soft-layer', without 'wearsim', which is added"
        )
    taken = clash(name)
    if taken is not None:
        raise ValueError(
            f"'{name}' cannot be the name of a contact model: its code would take the name {taken},"
            f" which stands for something else there; add a word, 'my-{name}'"
        )
    source, target = template_folder(), directory / f"wearsim-{name}"
    if target.exists():
        raise FileExistsError(f"{target} exists")
    written = []
    for path in _files():
        own = target / renamed(path.relative_to(source).as_posix(), name)
        own.parent.mkdir(parents=True, exist_ok=True)
        own.write_text(renamed(path.read_text(encoding="utf-8"), name), encoding="utf-8")
        written.append(own)
    return written
