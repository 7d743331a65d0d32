"""The kind of study to which a results file belongs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from wearsim.errors import PluginError, ResultsFileError
from wearsim.plugins import StudyKind, registry
from wearsim.results.content import ABOUT, INPUTS
from wearsim.results.io.files import format_of, read_file, read_study
from wearsim.results.io.stored_file import StoredFile
from wearsim.results.viewed import study_kinds


def kind_of(path: str | Path) -> StudyKind:
    """Return the kind of study of a results file.

    Parameters
    ----------
    path : str or Path
        The file.

    Raises
    ------
    ResultsFileError
        If it is missing, foreign, truncated or damaged.
    PluginError
        If it belongs to a plugin that is not installed; the message names it.
    """
    name, about = read_file(path, lambda file: (format_of(file), _about(file)))
    kinds = [kind for kind in study_kinds() if kind.format and kind.format == name]
    marked = [kind for kind in kinds if kind.marked_by and about.get(kind.marked_by)]
    if chosen := [*marked, *(kind for kind in kinds if not kind.marked_by)]:
        return chosen[0]
    for plugin in about.get("plugins", []):
        if plugin.get("kind") == StudyKind.kind:
            distribution = plugin["distribution"]
            raise PluginError(
                f"{path}: holds a study of the kind '{plugin['name']}', which the plugin"
                f" {distribution} {plugin['version']} adds; it is not installed here:"
                f" pip install {distribution}"
            )
    raise ResultsFileError(f"{path}: is HDF5, but not a results file of wearsim")


def open_study(path: str | Path, kind: StudyKind | None = None) -> Any:
    """Return the result in a file, by default of the kind that the file states.

    Raises
    ------
    ResultsFileError, PluginError
        As `kind_of`; also if the file has another layout.
    """
    kind = kind or kind_of(path)
    data = kind.load("read")(path) if kind.read else read_study(path, kind.load("data"))
    return kind.load("result")(data, Path(path))


def _about(file: StoredFile) -> dict[str, Any]:
    """Return the fields of a file, none if it is foreign."""
    place = f"{INPUTS}/{ABOUT}"
    # earlier layouts hold a scalar there
    about = json.loads(file.text(place)) if place in file and file.dataset(place).shape else {}
    return about if isinstance(about, dict) else {}


def as_plugin(name: str) -> dict[str, str]:
    """Return the entry of a kind of study in the list of plugins that a file holds.

    Parameters
    ----------
    name : str
        Name of the kind.
    """
    item = registry().registered(StudyKind, name)
    return {
        "kind": StudyKind.kind,
        "name": name,
        "distribution": item.distribution,
        "version": item.version,
    }
