"""Sphinx extension that writes the pages of the reference from wearsim itself.

Before a build it writes `docs/reference/generated`: Python names from `__all__`, verbs from their
help texts, scenario keys from the JSON Schema, and variables of results files from their schemas.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from shutil import rmtree
from typing import TYPE_CHECKING, Any

from typer.testing import CliRunner

from wearsim.cli.app import FIRST_PARTY, app
from wearsim.results.content import Schema, Variable
from wearsim.scenario.examples import scenario_schema
from wearsim.studies.dissipation.result import DISSIPATION
from wearsim.studies.ensemble.file.schema import ENSEMBLE
from wearsim.studies.run.schema import (
    CAM_FATIGUE_VARIABLES,
    CAM_VARIABLES,
    FATIGUE_VARIABLES,
    RUN,
)

if TYPE_CHECKING:
    from sphinx.application import Sphinx

PACKAGES = {
    "wearsim": "Scenarios, tests, ensembles and results; the names that scripts and notebooks use.",
    "wearsim.plugins": "Base classes, specs and quantities for authors of plugins.",
    "wearsim.types": "Types that contact models and results share.",
    "wearsim.contact_batch": "Batches of contacts as contact models receive and return them.",
    "wearsim.report": "Panels of results as data, and their figures on pages.",
    "wearsim.testing": "Conformance tests for plugins.",
}
Table = Mapping[str, Any]


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines) + "\n"


def cell(text: object) -> str:
    """Return a text on one line, with the signs of tables and equations escaped."""
    return " ".join(str(text).split()).replace("|", r"\|").replace("$", r"\$")


def python_names() -> str:
    """Return the page of the public Python names, which makes a page for each of them."""
    parts, errors = ["# Python\n"], []
    for name, line in PACKAGES.items():
        module = import_module(name)
        public = getattr(module, "__all__", None) or sorted(
            key for key, value in vars(module).items() if not key.startswith("_")
        )
        own = [key for key in public if _is_documented(getattr(module, key), name)]
        if name != "wearsim":  # errors have one page each, below `wearsim`
            own = [key for key in own if key not in errors]
        else:
            errors = [key for key in dir(module) if key not in public and key[0].isupper()]
        groups = {"": own, **({"Errors": errors} if name == "wearsim" else {})}
        parts.append(f"## {name}\n\n{line}\n")
        for title, keys in groups.items():
            heading = f"### {title}\n\n" if title else ""
            entries = "\n".join(f"   {key}" for key in keys)
            parts.append(
                f"{heading}```{{eval-rst}}\n.. currentmodule:: {name}\n\n.. autosummary::\n"
                f"   :toctree: api\n   :nosignatures:\n\n{entries}\n```\n"
            )
    return "\n".join(parts)


def _is_documented(value: Any, module: str) -> bool:
    """Return whether a value is a class or function of wearsim that a module defines or exports."""
    home = str(getattr(value, "__module__", ""))
    exported = (
        module
        in {
            "wearsim",
            "wearsim.plugins",
            "wearsim.report",
            "wearsim.testing",
        }
        or home == module
    )
    return home.startswith("wearsim") and hasattr(value, "__name__") and exported


def verbs() -> str:
    """Return the page of the verbs: their help texts."""
    shown = _help([])
    names = re.findall(r"^  ([a-z]+)  ", shown.split("Commands:")[1], flags=re.MULTILINE)
    parts = [
        "# Commands\n",
        "The texts of `wearsim --help` and of `--help` after every verb.\n",
        f"```\n{shown}```\n",
    ]
    for name in names:
        plugin = f"A verb of the plugin `{FIRST_PARTY[name]}`.\n" if name in FIRST_PARTY else ""
        parts.append(f"## wearsim {name}\n\n{plugin}\n```\n{_help([name])}```\n")
        inner = _help([name]).partition("Commands:")[2]
        parts.extend(
            f"### wearsim {name} {verb}\n\n```\n{_help([name, verb])}```\n"
            for verb in re.findall(r"^  ([a-z]+)  ", inner, flags=re.MULTILINE)
        )
    return "\n".join(parts)


def _help(arguments: list[str]) -> str:
    """Return a help text on lines of 88 characters."""
    done = CliRunner().invoke(
        app,
        [*arguments, "--help"],
        prog_name="wearsim",
        env={"COLUMNS": "90", "TERMINAL_WIDTH": "90", "NO_COLOR": "1"},
    )
    if done.exit_code:
        raise RuntimeError(f"wearsim {' '.join(arguments)} --help failed: {done.output}")
    return done.output.strip() + "\n"


def scenario_keys() -> str:
    """Return the page of the scenario keys, one table for each table of a scenario."""
    schema = scenario_schema()
    definitions = schema["$defs"]
    introduction = (
        "From the JSON Schema, `wearsim schema`, of this version with the models of wearsim and"
        " of its shipped plugins. A value"
        ' with a unit is a string, such as `"20 mm"`; any unit of the same kind is accepted, and'
        " the column *unit* has an example. A key without default is needed where it says so, and"
        " optional elsewhere. *Random* marks values that may be [distributions]"
        "(../../random-inputs.md#distributions).\n"
    )
    parts = ["# Scenario keys\n", introduction]
    plain = {
        name: part
        for name, part in schema["properties"].items()
        if "$ref" not in part and "properties" not in part
    }
    parts.append("## Keys before the first table\n\n" + _keys(plain, schema.get("required", [])))
    tables = [name for name in schema["properties"] if name not in plain]
    for name in tables:
        parts.append(f"## `[{name}]`\n")
        parts.extend(_tables(name, definitions[name], definitions))
    written = {key for name in tables for key in _reached(definitions[name], definitions)}
    parts.append("## Tables within tables\n")
    for name in sorted(written - set(tables)):
        part = definitions[name]
        if part.get("properties") and not _is_choice(name, tables):
            parts.append(f"### {_title(name)}\n\n{part.get('description', '').strip()}\n")
            parts.append(_keys(part["properties"], part.get("required", [])))
    return "\n".join(parts)


def _title(name: str) -> str:
    return name.replace("_", " ").replace(" as marginal", " (as marginal)")


def _is_choice(name: str, tables: Sequence[str]) -> bool:
    return name.split("_", maxsplit=1)[0] in tables and "_" in name


def _tables(name: str, part: Table, definitions: Table) -> Iterator[str]:
    """Yield the tables of the keys of a table of a scenario, one for each of its choices."""
    if part.get("description"):
        yield f"{part['description']}\n"
    if part.get("properties"):
        yield _keys(part["properties"], part.get("required", []))
    for choice in part.get("anyOf", ()):
        found = choice["$ref"].rsplit("/", 1)[-1]
        inner = definitions[found]
        (key, value) = next(
            (key, item["const"]) for key, item in inner["properties"].items() if "const" in item
        )
        yield f'### `{name}.{key} = "{value}"`\n\n{inner.get("description", "")}\n'
        rest = {key: item for key, item in inner["properties"].items() if "const" not in item}
        if rest:
            yield _keys(rest, inner.get("required", []))


def _reached(part: Any, definitions: Table) -> set[str]:
    """Return the names of all definitions that a schema refers to."""
    found: set[str] = set()
    waiting = [part]
    while waiting:
        item = waiting.pop()
        if isinstance(item, Mapping):
            name = str(item.get("$ref", "")).rsplit("/", 1)[-1]
            if name and name not in found:
                found.add(name)
                waiting.append(definitions[name])
            waiting.extend(item.values())
        elif isinstance(item, list):
            waiting.extend(item)
    return found


def _keys(properties: Table, required: Sequence[str]) -> str:
    rows = []
    for key, part in properties.items():
        kinds, units = _kinds(part)
        if "default" in part:
            default = f"`{_toml(part['default'])}`"
        else:
            default = "needed" if key in required else ""
        rows.append(
            [
                f"`{key}`",
                ", ".join(kinds),
                ", ".join(units),
                default,
                cell(part.get("description", "")),
            ]
        )
    return table(["key", "type", "unit, e.g.", "default", "meaning"], rows)


def _toml(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if not isinstance(value, str):
        return str(value)
    number = re.fullmatch(r"(-?[0-9.e+-]+) (.+)", value)
    return f'"{float(number[1]):.4g} {number[2]}"' if number else f'"{value}"'


def _kinds(part: Table) -> tuple[list[str], list[str]]:
    """Return the types of a value and examples of its units, without repetition."""
    if "$ref" in part:
        name = part["$ref"].rsplit("/", 1)[-1]
        if name in {"RandomInput", "RandomFriction", "JointRandomInput"}:
            return ["random"], []
        return [f"table ({_title(name)})"], []
    if "enum" in part:
        return [" or ".join(f"`{_toml(value)}`" for value in part["enum"])], []
    if "const" in part:
        return [f"`{_toml(part['const'])}`"], []
    kinds: list[str] = []
    units: list[str] = []
    for choice in part.get("anyOf", ()):
        inner = _kinds(choice)
        kinds += [item for item in inner[0] if item not in kinds]
        units += [item for item in inner[1] if item not in units]
    if "pattern" in part:
        return ["quantity"], [" ".join(str(text).split()[1:]) for text in part.get("examples", ())]
    types = part.get("type", [])
    for name in [types] if isinstance(types, str) else types:
        if name == "array":
            inner = _kinds(part.get("items", {}))
            of = f" of {' or '.join(inner[0])}" if inner[0] else ""
            kinds.append(f"list{of}")
            units += [item for item in inner[1] if item not in units]
        else:
            words = {"string": "text", "object": "table", "boolean": "true or false"}
            kinds.append(words.get(name, name))
    return kinds, units


def result_files() -> str:
    """Return the page of the variables in results files."""
    introduction = (
        "One HDF5 file for each result, in SI units; a unit 1 is a plain number."
        ' `xarray.open_dataset("file.h5", engine="h5netcdf")` opens it, and'
        " `to_xarray` of every result has the same names. [Compatibility]"
        "(../../compatibility.md) has the rules of the layout numbers.\n"
    )
    parts = ["# Results files\n", introduction]
    for schema in (RUN, DISSIPATION, ENSEMBLE):
        parts.append(f"## `{schema.format}`, layout {schema.version}\n\n{_sentence(schema)}\n")
        axes = [[f"`{axis.name}`", cell(axis.long_name)] for axis in schema.axes.values()]
        if axes:
            parts.append(table(["axis", "meaning"], axes))
        parts.append(_variables(schema.variables))
        if schema is RUN:
            parts.append("### Further variables of a cam\n\n" + _variables(CAM_VARIABLES))
            fatigue = {**FATIGUE_VARIABLES, **CAM_FATIGUE_VARIABLES}
            parts.append("### Further variables with fatigue\n\n" + _variables(fatigue))
    return "\n".join(parts)


def _sentence(schema: Schema) -> str:
    return f"{schema.holds[0].upper()}{schema.holds[1:]}."


def _variables(variables: Mapping[str, Variable]) -> str:
    rows = [
        [f"`{item.name}`", ", ".join(item.dims), cell(item.unit), item.kind, cell(item.long_name)]
        for item in variables.values()
    ]
    return table(["variable", "axes", "unit", "written", "meaning"], rows)


def write_pages(app: Sphinx) -> None:
    """Write the pages, each only if its text is new, so that unchanged ones are not rebuilt."""
    folder = Path(app.srcdir) / "reference" / "generated"
    folder.mkdir(parents=True, exist_ok=True)
    pages = {
        "python": python_names(),
        "commands": verbs(),
        "scenario-keys": scenario_keys(),
        "result-files": result_files(),
    }
    for name, text in pages.items():
        file = folder / f"{name}.md"
        if file.exists() and file.read_text(encoding="utf-8") == text:
            continue
        file.write_text(text, encoding="utf-8")
        if name == "python":  # pages of names that have gone
            rmtree(folder / "api", ignore_errors=True)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the extension; its pages are written before autosummary reads them."""
    app.connect("builder-inited", write_pages, priority=100)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
