"""Changes to a scenario by dotted keys, "load.normal_force", that leave its comments alone."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, MutableMapping
from typing import Any

from wearsim.errors import Mistake, ScenarioError
from wearsim.scenario.tables.plain import CADENCES
from wearsim.units import shown

# An override of one of these takes the place of the others.
_ALTERNATIVES = {
    "roller": (("radius", "diameter"), ("crown_radius", "crown_diameter")),
    "cylinder": (("radius", "diameter"),),
    "operation": (("duration", "passes"),),
    "creepage": (("misalignment", "yaw"), ("misalignment", "tilt")),
    "outputs": (CADENCES,),
}


def parse_override(text: str) -> tuple[str, object]:
    """Return the dotted key and the value of an override as given at the shell.

    Parameters
    ----------
    text : str
        "contact.mx=50" or "load.normal_force=350 N": the value is TOML, or else plain text.

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
        parsed: object = tomllib.loads(f"value = {value.strip()}")["value"]
    except tomllib.TOMLDecodeError:
        parsed = value.strip()
    return key.strip(), parsed


def apply_overrides(text: str, file: str, overrides: Mapping[str, object]) -> str:
    """Return the scenario's text with values replaced or added.

    A key that excludes another, as passes does duration, takes its place.

    Parameters
    ----------
    text : str
        Valid TOML.
    file : str
        Where it came from, for messages.
    overrides : mapping of str to object
        Values by dotted key.

    Returns
    -------
    str

    Raises
    ------
    ScenarioError
        If a key leads nowhere or a value cannot be written in TOML.
    """
    import tomlkit  # noqa: PLC0415  (only overrides need it)

    document = tomlkit.parse(text)
    problems = []
    for dotted, value in overrides.items():
        *tables, key = dotted.split(".")
        try:
            table = _descend(document, tables, key)
            table[key] = _item(value)
        except ValueError as error:
            problems.append(Mistake("", dotted, str(error), shown(value)))
            continue
        for rival in _rivals(".".join(tables), key):
            if rival in table and f"{'.'.join(tables)}.{rival}" not in overrides:
                del table[rival]
    if problems:
        raise ScenarioError(file, problems)
    return tomlkit.dumps(document)


def _item(value: object) -> Any:
    import tomlkit  # noqa: PLC0415

    try:
        return tomlkit.item(value)
    except ValueError as error:
        raise ValueError("has a value that TOML cannot hold") from error


def _descend(document: Any, tables: list[str], key: str) -> MutableMapping[str, Any]:
    """Return the table that holds `key`, made where it is missing."""
    import tomlkit  # noqa: PLC0415

    if not all([*tables, key]):
        raise ValueError("is not a key to override")
    table = document
    for name in tables:
        if name not in table:
            table[name] = tomlkit.table()
        table = table[name]
        if not isinstance(table, MutableMapping):
            raise ValueError(f"cannot be set, since '{name}' is not a table")
    return table  # type: ignore[no-any-return]


def _rivals(table: str, key: str) -> list[str]:
    groups = _ALTERNATIVES.get(table, ())
    return [other for group in groups if key in group for other in group if other != key]
