"""From TOML to a `Scenario`, with every mistake of the file told at once."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path, PurePath
from typing import Any

from wearsim.errors import Mistake, ScenarioError
from wearsim.mechanics.hertz.elasticity import combine
from wearsim.scenario.parse.key_index import REQUIRED, TABLES, all_names
from wearsim.scenario.parse.mistakes import Report
from wearsim.scenario.parse.overrides import apply_overrides
from wearsim.scenario.parse.validate import validate
from wearsim.scenario.random.model import RandomInput
from wearsim.scenario.random.placeholders import put_all
from wearsim.scenario.scenario import Scenario
from wearsim.scenario.tables.bodies import Cylinder, Roller, read_cylinder, read_roller
from wearsim.scenario.tables.plain import (
    TopTable,
    read_creepage,
    read_evolution,
    read_friction,
    read_operation,
    read_outputs,
)
from wearsim.scenario.tables.plugin import read_contact, read_load, read_wear
from wearsim.scenario.tables.sampling import check_correlation, read_sampling
from wearsim.units import shown

DUNDURS_LIMIT = 0.1

READERS: dict[str, Callable[[Mapping[str, object], Report], Any]] = {
    "roller": read_roller,
    "cylinder": read_cylinder,
    "operation": read_operation,
    "load": read_load,
    "friction": read_friction,
    "creepage": read_creepage,
    "contact": read_contact,
    "wear": read_wear,
    "evolution": read_evolution,
    "outputs": read_outputs,
    "sampling": read_sampling,
}
_OPTIONAL = {"wear"}  # tables that stay None where they are left out


def load_scenario(path: str | Path, overrides: Mapping[str, object] | None = None) -> Scenario:
    """Read a scenario from a TOML file; the files it names are sought beside it.

    Parameters
    ----------
    path : str or Path
        The file.
    overrides : mapping of str to object, optional
        Values by dotted key, {"load.normal_force": "350 N"}.

    Returns
    -------
    Scenario

    Raises
    ------
    ScenarioError
        With every mistake found.
    PluginError
        If two plugins share a name.
    """
    path = Path(path)

    def read(name: str) -> str:
        return (path.parent / name).read_text(encoding="utf-8-sig")

    try:
        text = read(path.name)
    except UnicodeDecodeError as error:
        raise ScenarioError(str(path), [Mistake("", "", "is not text in UTF-8")]) from error
    except OSError as error:
        problem = Mistake("", "", f"the file cannot be read ({error.strerror})")
        raise ScenarioError(str(path), [problem]) from error
    return parse_scenario(text, str(path), read, overrides)


def parse_scenario(
    text: str,
    name: str,
    read: Callable[[str], str],
    overrides: Mapping[str, object] | None = None,
) -> Scenario:
    """Return the scenario that a text holds.

    Parameters
    ----------
    text : str
        TOML.
    name : str
        Where it came from, for messages.
    read : callable
        Returns the content of a file that the scenario names; a stored scenario passes
        ``scenario.files.__getitem__``.
    overrides : mapping of str to object, optional
        Values by dotted key.

    Returns
    -------
    Scenario

    Raises
    ------
    ScenarioError
        With every mistake found.
    PluginError
        If two plugins share a name.
    """
    data = _parse_toml(text, name)
    if overrides:
        text = apply_overrides(text, name, overrides)
        data = _parse_toml(text, name)
    files: dict[str, str] = {}

    def read_and_keep(path: str) -> str:
        files[path] = read(path)
        return files[path]

    report = Report(name, read_and_keep, all_names())
    top = _read_top(data, report)
    sections = {table: _read_table(table, data, report) for table in TABLES}
    check_lists(data, report)
    check_correlation(sections["sampling"], report)
    report.raise_any()
    random = tuple(sorted(report.random, key=lambda item: item.name))
    return Scenario(
        file=name,
        title=top.title or PurePath(name).stem,
        seed=top.seed,
        text=text,
        files=files,
        notes=(
            *_notes(sections["roller"], sections["cylinder"], random),
            *_idle_sampling(data, random),
            *report.notes,
        ),
        random=random,
        _tables=put_all(data, report.means),
        **sections,
    )


def _parse_toml(text: str, name: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except ValueError as error:  # a TOMLDecodeError, or an integer beyond all bounds
        raise ScenarioError(name, [_syntax_problem(text, str(error))]) from error


def _syntax_problem(text: str, message: str) -> Mistake:
    """Say where the TOML breaks, and show the line."""
    found = re.fullmatch(r"(?P<what>.*) \(at (?P<place>.*)\)", message, re.DOTALL)
    if found is None:
        return Mistake("", "", f"is not valid TOML: {message}")
    what = found["what"][:1].lower() + found["what"][1:]
    number = re.match(r"line ([0-9]+)", found["place"])
    line = text.splitlines()[int(number[1]) - 1].strip() if number else None
    expected = None
    bare = re.match(r"([\w.-]+)\s*=\s*([0-9.+-][^\"'#]*?)\s*(?:#.*)?$", line or "")
    if bare:
        expected = f'quotes around a value with a unit, {bare[1]} = "{bare[2]}"'
    return Mistake("", found["place"], f"is not valid TOML: {what}", line, expected)


def _read_top(data: Mapping[str, object], report: Report) -> TopTable:
    """Read what stands above the tables, and report what belongs nowhere."""
    own = {key: data[key] for key in TopTable.model_fields if key in data}
    for key, value in data.items():
        if key in TABLES or key in own:
            continue
        if isinstance(value, dict):
            report.add(key, "", f"unknown table{report.names.near(key, TABLES)}")
        else:
            report.add("", key, f"unknown key{report.names.hint(key, TopTable.model_fields)}")
    return validate(report, TopTable, own, "") or TopTable()


def _read_table(table: str, data: Mapping[str, object], report: Report) -> Any:
    raw = data.get(table)
    if raw is None:
        if table in REQUIRED:
            report.add(table, "", "the table is missing")
            return None
        if table in _OPTIONAL:
            return None
        raw = {}
    if not isinstance(raw, dict):
        report.add("", table, "is not a table", shown(raw), f"a line [{table}] and its keys below")
        return None
    return READERS[table](raw, report)


def check_lists(data: Mapping[str, Any], report: Report) -> None:
    """Check that lists have one value per roller."""

    def raw(table: str, key: str, default: object = None) -> object:
        found = data.get(table)
        return found.get(key, default) if isinstance(found, dict) else None

    rollers = raw("operation", "rollers", 1)
    if not isinstance(rollers, int):
        return
    for table, key in (("roller", "offset"), ("creepage", "yaw"), ("creepage", "tilt")):
        value = raw(table, key)
        if isinstance(value, list) and len(value) != rollers:
            got = f"{len(value)} values" if len(value) != 1 else "1 value"
            expected = f"{rollers}, as operation.rollers says"
            report.add(table, key, "a list has one value per roller", got, expected)


def _idle_sampling(data: Mapping[str, Any], random: tuple[RandomInput, ...]) -> tuple[str, ...]:
    """Return a note if draws are asked for where there is nothing to draw."""
    given = data.get("sampling")
    if random or not given:
        return ()
    keys = ", ".join(f"sampling.{key}" for key in given)
    return (f"{keys} {'has' if len(given) == 1 else 'have'} no effect: no input is random",)


def _notes(roller: Roller, cylinder: Cylinder, random: tuple[RandomInput, ...]) -> tuple[str, ...]:
    warnings = tuple(f"{item.name}: {text}" for item in random for text in item.warnings)
    dundurs = combine(cylinder.material, roller.material).dundurs
    if abs(dundurs) <= DUNDURS_LIMIT:
        return warnings
    note = (
        f"the materials' Dundurs constant is {dundurs:.3g}: beyond {DUNDURS_LIMIT} the coupling of"
        " pressure and traction, which is neglected, is no longer small"
    )
    return (note, *warnings)
