"""`wearsim plugins`: installed plugins and their capabilities."""

from __future__ import annotations

from typing import Any

from wearsim.cli.shared import Json, note, write_json, write_list

_HEADS = ("name", "kind", "distribution", "version", "protocol", "capabilities", "summary")


def plugins(json: Json = False) -> None:
    """List contact models, wear laws, loads and random inputs."""
    from wearsim.plugins import registry

    found = registry()
    entries: list[dict[str, Any]] = [
        {
            "name": item.spec.name,
            "kind": item.spec.kind,
            "distribution": item.distribution,
            "version": item.version,
            "protocol": item.spec.protocol,
            "refused": item.refusal,
            "capabilities": item.spec.describe(),
            "summary": item.spec.summary,
            "references": list(item.spec.references),
        }
        for item in found.all()
    ]
    if json:
        keys = ("entry_point", "distribution", "version", "cause")
        broken = [{key: getattr(item, key) for key in keys} for item in found.broken]
        write_json({"plugins": entries, "broken": broken})
        return
    for entry in entries:
        entry["capabilities"] = ", ".join(word.replace("_", " ") for word in entry["capabilities"])
    write_list(_HEADS, [[str(entry[head]) for head in _HEADS] for entry in entries])
    for refusal in filter(None, (entry["refused"] for entry in entries)):
        note(f"refused: {refusal}")
    for item in found.broken:
        note(
            f"broken: plugin '{item.entry_point}' of {item.distribution} {item.version}"
            f" failed to load: {item.cause}"
        )
