"""Changes to a scenario's text by dotted keys, "load.normal_force"; comments are kept."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, MutableMapping
from typing import Any

from wearsim.errors import Mistake, ScenarioError
from wearsim.scenario.tables.plain import ALTERNATIVES
from wearsim.units import shown

#: Keys that exclude each other: an override of one removes the others.
_ALTERNATIVES = {**ALTERNATIVES, "creepage": (("misalignment", "yaw"), ("misalignment", "tilt"))}


def parse_override(text: str) -> tuple[str, object]:
    """Return the dotted key and the value of an override given on the command line.

    Parameters
    ----------
    text : str
        "contact.mx=50" or "load.normal_force=350 N": the value is TOML if it can be parsed, and
        plain text otherwise.

    Returns
    -------
    tuple of str and object

    Raises
    ------
    ValueError
        If there is no key or no equals sign.
    """
    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise ValueError(f"'{text}' is not an override, expected key=value")
    try:
        return key.strip(), tomllib.loads(f"value = {value.strip()}")["value"]
    except tomllib.TOMLDecodeError:
        return key.strip(), value.strip()


def apply_overrides(text: str, file: str, overrides: Mapping[str, object]) -> str:
    """Return the scenario's text with values replaced or added.

    A key that excludes another, as passes excludes duration, replaces it.

    Parameters
    ----------
    text : str
        Valid TOML.
    file : str
        The scenario's file, for messages.
    overrides : mapping of str to object
        Values by dotted key.

    Returns
    -------
    str

    Raises
    ------
    ScenarioError
        If a key does not lead to a table or a value cannot be written in TOML.
    """
    import tomlkit  # noqa: PLC0415  (only overrides need it)

    document = tomlkit.parse(text)
    mistakes = []
    for dotted, value in overrides.items():
        *names, key = dotted.split(".")
        try:
            table = _descend(document, names, key)
            table[key] = value
        except ValueError as error:
            unfit = isinstance(error, tomlkit.exceptions.ConvertError)
            what = "has a value that TOML cannot hold" if unfit else str(error)
            mistakes.append(Mistake("", dotted, what, shown(value)))
            continue
        prefix = ".".join(names)
        for group in _ALTERNATIVES.get(prefix, ()):
            for other in group if key in group else ():
                if other != key and other in table and f"{prefix}.{other}" not in overrides:
                    del table[other]
    if mistakes:
        raise ScenarioError(file, mistakes)
    return tomlkit.dumps(document)


def _descend(document: Any, tables: list[str], key: str) -> MutableMapping[str, Any]:
    """Return the table that holds `key`; missing tables are created."""
    if not all([*tables, key]):
        raise ValueError("is not a key to override")
    table = document
    for name in tables:
        table = table.setdefault(name, {})
        if not isinstance(table, MutableMapping):
            raise ValueError(f"cannot be set, since '{name}' is not a table")
    return table  # type: ignore[no-any-return]
