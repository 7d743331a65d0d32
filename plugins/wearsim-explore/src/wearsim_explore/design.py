"""A design: a scenario's text with changed values, as scenario, as options and as TOML."""

from __future__ import annotations

import shlex
import tomllib
from collections.abc import Iterable, Mapping, MutableMapping, MutableSequence
from copy import deepcopy
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import tomlkit

from wearsim import Scenario


@lru_cache(maxsize=16)
def _parsed(text: str) -> dict[str, Any]:
    """Return the tables of a text, which must not be changed."""
    return tomllib.loads(text)


@dataclass(frozen=True)
class Design:
    """A scenario with changed values.

    Parameters
    ----------
    text : str
        TOML of the scenario, as in its file.
    file : Path
        The file; other files lie in its folder.
    changes : mapping of str to object
        Values by dotted key, of which numbers lead into lists; None removes a key.
    """

    text: str
    file: Path
    changes: Mapping[str, object] = field(default_factory=dict)

    def with_change(self, key: str, value: object) -> Design:
        """Return a design with another value; one that equals that of the file is no change."""
        changes = {name: kept for name, kept in self.changes.items() if name != key}
        if _value_at(_parsed(self.text), key) != value:
            changes[key] = value
        return replace(self, changes=changes)

    @cached_property
    def tables(self) -> dict[str, Any]:
        """The changed scenario as TOML holds it."""
        tables = deepcopy(_parsed(self.text))
        for key, value in self.changes.items():
            _set(tables, key, value)
        return tables

    @cached_property
    def overrides(self) -> dict[str, object]:
        """The changes as overrides: whole lists, and whole tables from which a key is removed."""
        tables, overrides = self.tables, dict[str, object]()
        for key, value in self.changes.items():
            parts = key.split(".")
            whole = next((n for n, part in enumerate(parts) if part.isdigit()), len(parts))
            if value is None:
                whole = min(whole, len(parts) - 1)
            name = ".".join(parts[:whole])
            overrides[name] = value if whole == len(parts) else _value_at(tables, name)
        nested = [
            name for name in overrides if any(name.startswith(f"{table}.") for table in overrides)
        ]
        return {name: value for name, value in overrides.items() if name not in nested}

    def scenario(
        self, further: Mapping[str, object] | None = None, *, comments: bool = True
    ) -> Scenario:
        """Return the scenario; files outside its folder are refused.

        Parameters
        ----------
        further : mapping of str to object, optional
            Further values by dotted key, which exclude no other key.
        comments : bool
            Whether the text of the scenario keeps the comments of the file; without them it is read
            in a third of the time.

        Raises
        ------
        ScenarioError
            With all mistakes.
        """
        text, overrides = self.text, {**self.overrides, **(further or {})}
        # a value that is new to the file may exclude another one, which overrides then remove
        all_in_file = all(_value_at(_parsed(self.text), key) is not None for key in self.overrides)
        if all_in_file and not comments:
            tables = deepcopy(self.tables)
            for key, value in (further or {}).items():
                _set(tables, key, value)
            text = "\n".join(_pairs(tables))
            overrides = {}
        return Scenario.from_toml(
            text, overrides or None, folder=self.file.parent, name=self.file.name, confined=True
        )

    def options(self) -> str:
        """Return the changes as options `--set` of the shell."""
        words = [f"{key}={_as_option(value)}" for key, value in self.overrides.items()]
        return " ".join(f"--set {shlex.quote(word)}" for word in words)

    def toml(self) -> str:
        """Return the TOML of the changed scenario, with the comments of the file.

        Raises
        ------
        ScenarioError
            If the scenario has mistakes.
        """
        document: Any = tomlkit.parse(self.text)
        whole = [key for key in self.changes if key not in self.overrides]
        for key in whole:
            _set(document, key, self.changes[key])
        edited = tomlkit.dumps(document)
        plain = {key: value for key, value in self.changes.items() if key not in whole}
        try:
            readable = (
                tomllib.loads(edited)
                == replace(self, changes={key: self.changes[key] for key in whole}).tables
            )
        except tomllib.TOMLDecodeError:
            readable = False
        if not readable:  # what the library cannot edit is written without comments
            return self.scenario().text
        return replace(self, text=edited, changes=plain).scenario().text


def _value_at(tables: Any, key: str) -> Any:
    """Return the value at a dotted key, or None."""
    for part in key.split("."):
        if isinstance(tables, Mapping):
            tables = tables.get(part)
        elif isinstance(tables, MutableSequence) and part.isdigit() and int(part) < len(tables):
            tables = tables[int(part)]
        else:
            return None
    return tables


def _set(tables: Any, key: str, value: object) -> None:
    """Set or remove the value at a dotted key; missing tables are created."""
    *parents, last = key.split(".")
    for part in parents:
        if isinstance(tables, MutableSequence):
            tables = tables[int(part)]
        else:
            if not isinstance(tables.get(part), MutableMapping | MutableSequence):
                tables[part] = {}
            tables = tables[part]
    if isinstance(tables, MutableSequence):
        tables[int(last)] = value
    elif value is None:
        tables.pop(last, None)
    else:
        tables[last] = deepcopy(value)


def _as_option(value: object) -> str:
    """Return a value as `--set` reads it: text without quotes where that cannot be TOML."""
    if isinstance(value, str):
        try:
            tomllib.loads(f"value = {value.strip()}")
        except tomllib.TOMLDecodeError:
            return value
    return _on_a_line(value)


def _on_a_line(value: object) -> str:
    """Return a value as TOML on one line."""
    if isinstance(value, Mapping):
        return f"{{{', '.join(_pairs(value))}}}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_on_a_line, value))}]"
    return str(tomlkit.item(value).as_string())


def _pairs(table: Mapping[str, object]) -> Iterable[str]:
    """Return the keys of a table with their values, as TOML on one line each."""
    return (f"{tomlkit.key(name).as_string()} = {_on_a_line(v)}" for name, v in table.items())


def unknown_keys(design: Design, table: str, known: Iterable[str]) -> list[str]:
    """Return the dotted keys of a table that are not among known ones.

    Parameters
    ----------
    design : Design
    table : str
        Dotted key of the table.
    known : iterable of str
        Dotted keys of fields.
    """
    inside = _value_at(design.tables, table)
    names = list(inside) if isinstance(inside, Mapping) else []
    kept = {key.removeprefix(f"{table}.").partition(".")[0] for key in known}
    return [f"{table}.{name}" for name in names if name not in kept]
