"""New plugins, written from the template that is part of wearsim."""

from __future__ import annotations

import ast
import re
from keyword import kwlist
from pathlib import Path

_PACKAGE = Path(__file__).parents[1]
# an installed package contains the template; a source tree has it in the folder `plugins`
_FOLDERS = (_PACKAGE / "plugin_template", _PACKAGE.parent / "plugins" / "wearsim-template")
_LEFT_OUT = {"__pycache__", "build", "dist"}
_WORD = re.compile("wearsim_template|winkler|Winkler")
NAME = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")


def template_folder() -> Path:
    """Return the folder of the template, in an installed package or a source tree."""
    return next((folder for folder in _FOLDERS if folder.is_dir()), _FOLDERS[0])


def renamed(text: str, name: str) -> str:
    """Return a text of the template with the names of a new plugin.

    Parameters
    ----------
    text : str
        Content of a file, or a path.
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
    # in one pass: the new name may contain a word of the template, such as soft-winkler
    return re.sub("|".join(new), lambda match: new[match[0]], text)


def clash(name: str) -> str | None:
    """Return an identifier of the new plugin that is already used or a keyword, or None.

    Parameters
    ----------
    name : str
        Name of the contact model, lower-case words joined by hyphens.
    """
    identifiers = set().union(*(_identifiers(path) for path in _files() if path.suffix == ".py"))
    new = {item: renamed(item, name) for item in identifiers if _WORD.search(item)}
    taken = {*(identifiers - set(new)), *kwlist}
    return next((item for item in sorted(new.values()) if item in taken), None)


def _identifiers(path: Path) -> set[str]:
    """Return the names that a file defines, imports or uses, except attributes."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        match node:
            case (
                ast.Name(id=name)
                | ast.arg(arg=name)
                | ast.ClassDef(name=name)
                | ast.FunctionDef(name=name)
            ):
                names.add(name)
            case ast.Import(names=aliases) | ast.ImportFrom(names=aliases):
                names |= {alias.asname or alias.name for alias in aliases}
                names.add(getattr(node, "module", None) or "")
    return names


def _files() -> list[Path]:
    """Return the files of the template, without build results and caches."""
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
    """Write a distribution with a new contact model into ``directory/wearsim-NAME``.

    Parameters
    ----------
    name : str
        Name of the contact model.
    directory : Path
        Parent folder of the distribution, created if it does not exist.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    ValueError
        If the name is not made of lower-case words joined by hyphens, or clashes with an
        identifier in the code of the plugin.
    FileExistsError
        If the folder exists.
    """
    if not NAME.fullmatch(name) or name.startswith("wearsim"):
        raise ValueError(
            f"'{name}' cannot be the name of a contact model; expected lower-case words joined by"
            " hyphens, 'soft-layer', without 'wearsim', which is added"
        )
    if taken := clash(name):
        raise ValueError(
            f"'{name}' cannot be the name of a contact model: its code would define the name"
            f" {taken}, which has another meaning there; add a word, 'my-{name}'"
        )
    source, target = template_folder(), directory / f"wearsim-{name}"
    if target.exists():
        raise FileExistsError(f"{target} exists")
    written = []
    for path in _files():
        copy = target / renamed(path.relative_to(source).as_posix(), name)
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text(renamed(path.read_text(encoding="utf-8"), name), encoding="utf-8")
        written.append(copy)
    return written
