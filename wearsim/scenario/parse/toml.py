"""Parsing of TOML, changed by dotted keys; all mistakes are reported together."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from errno import EACCES
from pathlib import Path, PurePath
from typing import Any

from wearsim.errors import Mistake, ScenarioError, mistake_in
from wearsim.input_files import csv_of_profile, read_input
from wearsim.plugins import (
    AxialProfileSpec,
    FatigueLawSpec,
    LoadSpec,
    MotionLawSpec,
    Options,
    RandomInputSpec,
    TableSpec,
)
from wearsim.profiles import split_name
from wearsim.quantities import DECIMAL_COMMA
from wearsim.scenario.parse.fields import RandomInput, RandomInputTable
from wearsim.scenario.parse.mistakes import Mistakes, installed, nearest, refuse_tables
from wearsim.scenario.parse.overrides import (
    PROFILE,
    PROFILE_FILE,
    TOO_DEEP,
    apply_overrides,
    is_deep,
    tables_of,
)
from wearsim.scenario.parse.random_inputs import validate
from wearsim.scenario.tables.axial import AxialTable, combine_bodies
from wearsim.scenario.tables.bodies import (
    CylinderTable,
    RollerTable,
    dundurs_note,
    read_cylinder,
    read_roller,
)
from wearsim.scenario.tables.cam import (
    CamTable,
    FollowerTable,
    LubricantTable,
    assemble_cam,
    of_follower,
    refuse_cylinder,
)
from wearsim.scenario.tables.cam_motion import MotionTable
from wearsim.scenario.tables.fatigue import FatigueOfBody, FatigueTable, read_fatigue
from wearsim.scenario.tables.plain import (
    CreepageTable,
    EvolutionTable,
    FrictionTable,
    LimitTable,
    OperationTable,
    OutputsTable,
    SamplingTable,
    TopTable,
    check_alternatives,
    check_correlation,
    check_limits,
    check_lists,
    read_creepage,
    read_outputs,
)
from wearsim.scenario.tables.plugin import (
    PLUGIN_TABLES,
    ContactTable,
    LoadTable,
    WearTable,
    check_contained,
    read_contact,
    read_load,
    read_wear,
)
from wearsim.types import Profile
from wearsim.units import as_written

TABLES: dict[str, type[Options]] = {
    "roller": RollerTable,
    "cylinder": CylinderTable,
    "cam": CamTable,
    "follower": FollowerTable,
    "lubricant": LubricantTable,
    "operation": OperationTable,
    "load": LoadTable,
    "friction": FrictionTable,
    "creepage": CreepageTable,
    "contact": ContactTable,
    "wear": WearTable,
    "fatigue": FatigueTable,
    "evolution": EvolutionTable,
    "outputs": OutputsTable,
    "limit": LimitTable,
    "sampling": SamplingTable,
}
#: tables of distributions of this project, ignored with a note where these are not installed
FIRST_PARTY = {"optimise": "wearsim-optimise"}
#: [cam] replaces [cylinder]
REQUIRED = ("roller", "operation", "load", "friction", "creepage")  # and a cylinder or a cam
_ABSENT = {
    *REQUIRED,
    "cylinder",
    "wear",
    "fatigue",
    "cam",
    "follower",
    "lubricant",
}  # tables without defaults
#: functions that read the tables with more checks than their models have
READERS: dict[str, Callable[[Mistakes, Mapping[str, object]], Any]] = {
    "roller": read_roller,
    "cylinder": read_cylinder,
    "load": read_load,
    "creepage": read_creepage,
    "contact": read_contact,
    "wear": read_wear,
    "fatigue": read_fatigue,
    "outputs": read_outputs,
}


def reader_in(folder: Path, *, confined: bool = False) -> Callable[[str], str]:
    """Return a function that reads the input files in a folder, if confined no others."""

    def read(name: str) -> str:
        file, choice = split_name(name)
        if confined and not (folder / file).resolve().is_relative_to(folder.resolve()):
            raise PermissionError(EACCES, "outside the folder of the scenario", file)
        return read_input(folder / file, choice)

    return read


def parse_fields(
    text: str,
    name: str,
    read: Callable[[str], str],
    overrides: Mapping[str, object] | None = None,
) -> dict[str, Any]:
    """Return the fields of a `Scenario`; parameters and errors as in `parse_scenario`."""
    if not isinstance(text, str):
        raise TypeError(
            f"text must be TOML in a str, got a {type(text).__name__}; load_scenario reads a file"
        )
    if not isinstance(overrides, Mapping | None):
        raise TypeError(
            f"overrides must be a mapping of values by dotted key, got a {type(overrides).__name__}"
        )
    if others := [key for key in overrides or () if not isinstance(key, str)]:
        raise TypeError(f"a dotted key of overrides must be a text, got {others[0]!r}")
    data = parse_toml(text, name)
    if overrides:
        text = apply_overrides(text, name, overrides)
        data = parse_toml(text, name)
    files: dict[str, str] = {}
    given: Any = (overrides or {}).get(PROFILE)

    def read_and_keep(path: str) -> str:
        from_python = path == PROFILE_FILE and isinstance(given, Profile)
        files[path] = csv_of_profile(given) if from_python else read(path)
        return files[path]

    mistakes = Mistakes(name, read_and_keep, keys_by_place)
    top = _read_top(mistakes, data)
    refuse_cylinder(mistakes, data)
    sections = {table: _read_table(mistakes, table, of_follower(data)) for table in TABLES}
    owned = _read_owned(mistakes, data)
    assemble_cam(mistakes, sections)
    sections |= combine_bodies(mistakes, sections)
    check_limits(mistakes, data, sections["limit"])
    check_lists(mistakes, data)
    check_correlation(mistakes, sections["sampling"])
    check_contained(mistakes)
    mistakes.raise_any()
    random = tuple(mistakes.random_inputs)
    return {
        "file": name,
        "title": top.title or PurePath(name).stem,
        "seed": top.seed,
        "text": text,
        "files": files,
        "notes": (
            *dundurs_note(sections["pair"], sections["contact"]),
            *(f"{item.name}: {warning}" for item in random for warning in item.warnings),
            *_unused_sampling_note(data, random),
            *mistakes.notes,
        ),
        "random": random,
        "tables": owned,
        **sections,
    }


def parse_toml(text: str, name: str) -> dict[str, Any]:
    """Return the tables of a text; raises ScenarioError if it is not valid TOML."""
    try:
        data = tables_of(text)
    except RecursionError as error:
        raise mistake_in(name, *TOO_DEEP) from error
    except ValueError as error:  # a TOMLDecodeError, or an integer with too many digits
        raise ScenarioError(name, [_syntax_mistake(text, str(error))]) from error
    if deep := [Mistake("", key, *TOO_DEEP) for key, value in data.items() if is_deep(value)]:
        raise ScenarioError(name, deep)
    return data


def _syntax_mistake(text: str, message: str) -> Mistake:
    """Return the mistake of invalid TOML, with its place and the line."""
    match = re.fullmatch(r"(?P<what>.*) \(at (?P<place>.*)\)", message, re.DOTALL)
    if re.fullmatch(r".*\.toml", text.strip()):
        return Mistake(
            "",
            "",
            "is the name of a file, not its text",
            as_written(text),
            "TOML; load_scenario reads a file",
        )
    if match is None:
        return Mistake("", "", f"is not valid TOML: {message}")
    what = match["what"][:1].lower() + match["what"][1:]
    number = re.match(r"line ([0-9]+)", match["place"])
    line = text.splitlines()[int(number[1]) - 1].strip() if number else None
    bare = re.match(r"([\w.-]+)\s*=\s*([0-9.+-][^\"'#]*?)\s*(?:#.*)?$", line or "")
    expected = f'quotes around a value with a unit, {bare[1]} = "{bare[2]}"' if bare else None
    if what.startswith(("cannot overwrite", "cannot declare")):
        expected = "each key and table once in the file"
    elif "unescaped" in what or "hex" in what:
        expected = "paths with / or, with \\, in single quotes"
    elif re.search(r"=\s*(True|False)\b", line or ""):
        expected = "true or false"
    elif "illegal character '\\n'" in what and (line or "").count('"') % 2:
        expected = "a quotation mark at the end of the text"
    elif bare and DECIMAL_COMMA.fullmatch(bare[2]):
        expected = f"a decimal point, {bare[1]} = {bare[2].replace(',', '.')}"
    elif bare and (percent := re.fullmatch(r"([0-9.]+) ?%", bare[2])):
        expected = f"a plain number, {bare[1]} = {float(percent[1]) / 100.0:.6g}"
    return Mistake("", match["place"], f"is not valid TOML: {what}", line, expected)


def _read_top(mistakes: Mistakes, data: Mapping[str, object]) -> TopTable:
    """Return the keys above the tables; add a mistake for each unknown key and table."""
    keys = {key: data[key] for key in TopTable.model_fields if key in data}
    owned = [spec.name for spec in installed(TableSpec)]
    refuse_tables(mistakes, {*TABLES, *TopTable.model_fields}.intersection(owned))
    known = {*TABLES, *keys, *owned}
    for key in [key for key in data if key not in known]:
        if key in FIRST_PARTY and isinstance(data[key], dict):
            mistakes.notes.append(
                f"[{key}] is a table of {FIRST_PARTY[key]}, which is not installed:"
                f" pip install 'wearsim[{key}]'"
            )
            continue
        if isinstance(data[key], dict):
            hint = nearest(key, TABLES) or f" (known: {', '.join(TABLES)})"
            mistakes.add(key, "", f"unknown table{hint}")
        else:
            mistakes.add("", key, f"unknown key{mistakes.hint(key, TopTable.model_fields)}")
    return validate(mistakes, TopTable, keys, "") or TopTable()


def _read_table(mistakes: Mistakes, table: str, data: Mapping[str, object]) -> Any:
    if table not in data and table in REQUIRED:
        mistakes.add(table, "", "the table is missing")
    if table not in data and table in _ABSENT:
        return None
    raw: Any = data.get(table, {})
    if not _is_table(mistakes, table, raw):
        return None
    check_alternatives(mistakes, raw, table)
    reader = READERS.get(table)
    return reader(mistakes, raw) if reader else validate(mistakes, TABLES[table], raw, table)


def _read_owned(mistakes: Mistakes, data: Mapping[str, object]) -> dict[str, Options]:
    """Return the tables that belong to plugins, by name; adds their mistakes."""
    given: dict[TableSpec, Any] = {
        spec: data[spec.name] for spec in installed(TableSpec) if spec.name in data
    }
    owned = {
        spec.name: validate(mistakes, spec.options, raw, spec.name)
        for spec, raw in given.items()
        if _is_table(mistakes, spec.name, raw)
    }
    return {name: options for name, options in owned.items() if options is not None}


def _is_table(mistakes: Mistakes, name: str, raw: object) -> bool:
    """Return whether a value is a table; add the mistake if it is not."""
    if not isinstance(raw, dict):
        mistakes.add(
            "", name, "is not a table", as_written(raw), f"a line [{name}] and its keys below"
        )
    return isinstance(raw, dict)


def _unused_sampling_note(data: Mapping[str, Any], random: tuple[RandomInput, ...]) -> list[str]:
    """Return a note if the table [sampling] has keys but no input is random."""
    keys = [f"sampling.{key}" for key in data.get("sampling", ()) if not random]
    have = "has" if len(keys) == 1 else "have"
    return [f"{', '.join(keys)} {have} no effect: no input is random"] if keys else []


def keys_by_place() -> dict[str, set[str]]:
    """Return the keys of every table and of every plugin, by their place in words."""

    def of(kind: Any, place: str) -> dict[str, set[str]]:
        options = {spec.name: spec.options for spec in installed(kind)}
        return {place.format(name): set(model.model_fields) for name, model in options.items()}

    return {
        "the top of the file": set(TopTable.model_fields),
        **{f"[{table}]": set(model.model_fields) for table, model in TABLES.items()},
        **{
            f"[load.{spec.name}]"
            if isinstance(spec, LoadSpec) and spec.role == "term"
            else f'[{table}] with {key} = "{spec.name}"': set(spec.options.model_fields)
            for table, (_, key, kind) in PLUGIN_TABLES.items()
            for spec in installed(kind)
        },
        **of(MotionLawSpec, 'an entry of cam.motion with law = "{}"'),
        **of(FatigueLawSpec, 'a body of [fatigue] with law = "{}"'),
        "a body of [fatigue]": set(FatigueOfBody.model_fields),
        "an entry of cam.motion": set(MotionTable.model_fields),
        **of(AxialProfileSpec, 'axial_profile with form = "{}"'),
        "axial_profile": set(AxialTable.model_fields),
        '[contact] with model = "auto"': {"tolerance"},
        **of(TableSpec, "[{}]"),
        "a random input": set(RandomInputTable.model_fields),
        **of(RandomInputSpec, 'a random input with distribution = "{}"'),
    }
