"""Changes of a scenario by dotted keys, and its tables as TOML holds them."""

from __future__ import annotations

import itertools
import pickle
import tomllib
from collections.abc import Iterable, Iterator, Mapping, MutableMapping
from contextlib import suppress
from functools import lru_cache
from pathlib import PurePath
from typing import Any, cast

import numpy as np

from wearsim.errors import Mistake, ScenarioError
from wearsim.profiles import ROW_CHOICES
from wearsim.scenario.tables.plain import ALTERNATIVES
from wearsim.types import Profile
from wearsim.units import as_written

#: Keys that exclude each other: an override of one removes the others.
_ALTERNATIVES = {**ALTERNATIVES, "creepage": (("misalignment", "yaw"), ("misalignment", "tilt"))}

PROFILE = "cylinder.profile"
#: Name of the file that holds a profile given as arrays, among the files of a scenario.
PROFILE_FILE = "profile-from-python.csv"
#: Keys that say how the file of a profile is read.
_OF_PROFILE_FILES = ("profile_columns", "profile_units", *(f"profile_{key}" for key in ROW_CHOICES))
MAX_NESTING = 20  # a scenario has at most five levels
TOO_DEEP = "is nested too deeply", None, f"at most {MAX_NESTING} levels of tables and lists"


def parse_override(text: str) -> tuple[str, object]:
    """Return the dotted key and the value of an override given on the command line.

    Parameters
    ----------
    text : str
        "contact.mx=50" or "load.normal_force=350 N": the value is TOML if it can be parsed, and
        plain text otherwise.

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
    except (tomllib.TOMLDecodeError, RecursionError):
        return key.strip(), value.strip()


def apply_overrides(
    text: str, file: str, overrides: Mapping[str, object], removed: Iterable[str] = ()
) -> str:
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
    removed : iterable of str
        Dotted keys that are removed where they are given.

    Returns
    -------
    str

    Raises
    ------
    ScenarioError
        If a key does not lead to a table or a value cannot be written in TOML.
    """
    import tomlkit  # noqa: PLC0415  (only overrides need it)

    document, plain = pickle.loads(_document_of(text)), tables_of(text)
    mistakes = []
    for dotted, value in overrides.items():
        *names, key = dotted.split(".")
        if len(names) > MAX_NESTING or is_deep(value):
            mistakes.append(Mistake("", f"{dotted:.60}", *TOO_DEEP))
            continue
        try:
            tables = [_descend(whole, names, key) for whole in (document, plain)]
            unused = set()
            if dotted == PROFILE and isinstance(value, Profile):
                unused = {name for name in tables[0] if name in _OF_PROFILE_FILES}
                value = PROFILE_FILE  # noqa: PLW2901
            prefix = ".".join(names)
            for group in _ALTERNATIVES.get(prefix, ()):
                others = set(group) - {key} if key in group else set()
                unused |= {n for n in others & {*tables[0]} if f"{prefix}.{n}" not in overrides}
            # the key within axial_profile replaces a crown
            crown = ("crown_radius", "crown_diameter") if prefix == "roller.axial_profile" else ()
            for whole, name in itertools.product((document, plain), crown):
                if f"roller.{name}" not in overrides:
                    whole.get("roller", {}).pop(name, None)
            tables[0][key] = tables[1][key] = as_toml(value)
            for table, name in itertools.product(tables, unused):
                del table[name]
        except ValueError as error:
            unfit = isinstance(error, tomlkit.exceptions.ConvertError)
            what = "has a value that TOML cannot hold" if unfit else str(error)
            mistakes.append(Mistake("", dotted, what, as_written(value)))
    if mistakes:
        raise ScenarioError(file, mistakes)
    for dotted, whole in itertools.product(removed, (document, plain)):
        *names, key = dotted.split(".")
        holder: Any = whole
        for name in names:
            holder = holder.get(name, {})
        holder.pop(key, None)
    written = tomlkit.dumps(document)
    # tables next to dotted keys are written wrongly by tomlkit; the plain text lacks comments
    with suppress(tomllib.TOMLDecodeError):
        if tables_of(written) == plain:
            return written
    return tomlkit.dumps(plain)


def tables_of(text: str) -> dict[str, Any]:
    """Return the tables of a text as dictionaries that may be changed."""
    return cast("dict[str, Any]", pickle.loads(_pickled_tables(text)))


# a study changes the same scenario for each design: reading a pickled object takes an eighth of the
# time of parsing the text
@lru_cache(maxsize=8)
def _pickled_tables(text: str) -> bytes:
    return pickle.dumps(tomllib.loads(text))


@lru_cache(maxsize=8)
def _document_of(text: str) -> bytes:
    """Return a text with its comments as a pickled document of tomlkit."""
    import tomlkit  # noqa: PLC0415  (only overrides need it)

    return pickle.dumps(tomlkit.parse(text))


def is_deep(value: object) -> bool:
    """Return whether tables and lists are nested in more than `MAX_NESTING` levels."""
    layer = [value]
    for _ in range(MAX_NESTING + 1):
        layer = [
            item
            for part in layer
            if isinstance(part, Mapping | list | tuple)
            for item in (part.values() if isinstance(part, Mapping) else part)
        ]
    return bool(layer)


def as_toml(value: object) -> object:
    """Return a Python value as TOML can hold it: numbers of numpy, arrays, tuples and paths."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, PurePath):
        return value.as_posix()
    if isinstance(value, Mapping):
        return {str(key): as_toml(item) for key, item in value.items()}
    return [as_toml(item) for item in value] if isinstance(value, list | tuple) else value


def _descend(document: Any, tables: list[str], key: str) -> MutableMapping[str, Any]:
    """Return the table that holds `key`; missing tables are created."""
    if not all([*tables, key]):
        raise ValueError("is not a key to override")
    table = document
    for name in tables:
        if isinstance(table, list):
            if not (name.isdigit() and 1 <= int(name) <= len(table)):
                raise ValueError(
                    f"cannot be set, since '{name}' is not the number of an entry, from 1 to"
                    f" {len(table)}"
                )
            table = table[int(name) - 1]
        else:
            table = table.setdefault(name, {})
        if not isinstance(table, MutableMapping | list):
            raise ValueError(f"cannot be set, since '{name}' is not a table")
    if not isinstance(table, MutableMapping):
        raise ValueError(f"cannot be set, since '{key}' is not a key of an entry")
    return table


def flat(tables: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, object]]:
    """Yield the values of nested tables by dotted key."""
    if not isinstance(tables, Mapping):
        raise TypeError(f"tables must be a mapping by name, got a {type(tables).__name__}")
    for key, value in tables.items():
        if isinstance(value, Mapping) and value:
            yield from flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
