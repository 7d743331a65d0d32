"""`wearsim plugins`: what is installed, from where, and what it can do."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from wearsim.cli.arguments import Json
from wearsim.cli.output import note, write_json, write_list

if TYPE_CHECKING:
    from wearsim.plugins.manager import Broken, Registered

_HEADS = ("name", "kind", "distribution", "version", "capabilities", "summary")


def plugins(json: Json = False) -> None:
    """List contact models, wear laws, loads and random inputs."""
    from wearsim.plugins import registry

    found = registry()
    if json:
        listed = [_entry(item) for item in found.all()]
        write_json({"plugins": listed, "broken": [_broken(item) for item in found.broken]})
        return
    rows = [{**_entry(item), "capabilities": _words(item)} for item in found.all()]
    write_list(_HEADS, [[row[head] for head in _HEADS] for row in rows])
    for item in found.broken:
        note(
            f"broken: plugin '{item.entry_point}' of {item.distribution} {item.version}"
            f" failed to load: {item.cause}"
        )


def _entry(item: Registered) -> dict[str, Any]:
    return {
        "name": item.spec.name,
        "kind": item.spec.kind,
        "distribution": item.distribution,
        "version": item.version,
        "capabilities": item.spec.describe(),
        "summary": item.spec.summary,
        "references": list(item.spec.references),
    }


def _broken(item: Broken) -> dict[str, str]:
    return {
        "entry_point": item.entry_point,
        "distribution": item.distribution,
        "version": item.version,
        "cause": item.cause,
    }


def _words(item: Registered) -> str:
    return ", ".join(word.replace("_", " ") for word in item.spec.describe())
