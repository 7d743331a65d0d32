"""Names that programs and files of users depend on; `python -m tests.stable_names` lists them.

The listings in docs/stable are part of the repository: a name that is renamed or removed is seen
there before a user finds it missing.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Iterator, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import wearsim

FOLDER = Path(__file__).parents[1] / "docs" / "stable"
MODULES = (
    *("wearsim", "wearsim.plugins", "wearsim.types", "wearsim.contact_batch", "wearsim.errors"),
    *("wearsim.arguments", "wearsim.report", "wearsim.testing", "wearsim.atomic_write"),
    *("wearsim.cli.progress", "wearsim.cli.render", "wearsim.cli.shared", "wearsim.report.panels"),
    *("wearsim.report.text", "wearsim.report.view", "wearsim.results.content"),
    *("wearsim.results.io.files", "wearsim.results.io.outputs", "wearsim.results.kinds"),
    *("wearsim.results.study_view", "wearsim.results.viewed"),
    *("wearsim.studies.execution.factory", "wearsim.studies.preparation"),
    "wearsim.studies.progress",
)


def python_names() -> list[str]:
    """Return the public names of all public modules, functions with their parameters."""
    return [line for name in MODULES for line in sorted(_names_of(name))]


def _names_of(module_name: str) -> Iterator[str]:
    module = import_module(module_name)
    own = [
        name
        for name, item in vars(module).items()
        if getattr(item, "__module__", None) == module_name and not name.startswith("_")
    ]
    for name in getattr(module, "__all__", own):
        item = getattr(module, name)
        yield f"{module_name}.{name}{_parameters(item) if inspect.isfunction(item) else ''}"
        if inspect.isclass(item):
            fields = {
                *getattr(item, "__dataclass_fields__", {}),
                *getattr(item, "model_fields", {}),
            }
            members = sorted(key for key in {*dir(item), *fields} if not key.startswith("_"))
            foreign = set(dir(_foreign_base(item)))
            yield from (f"{module_name}.{name}.{key}" for key in members if key not in foreign)


def _foreign_base(kind: type) -> type:
    """Return the first base that another distribution defines, such as that of exceptions."""
    return next(base for base in kind.__mro__ if not base.__module__.startswith("wearsim"))


def _parameters(function: Any) -> str:
    return f"({', '.join(inspect.signature(function).parameters)})"


def scenario_keys() -> list[str]:
    """Return the keys of all tables of a scenario, by the names of the JSON Schema."""
    schema = wearsim.scenario_schema()
    tables = {"scenario": schema, **schema["$defs"]}
    return [
        f"{table}: {key}"
        for table, item in sorted(tables.items())
        for key in sorted(item.get("properties", {}))
        if "winkler" not in f"{table} {key}"  # of the template of plugins
    ]


def json_keys(kind: str, data: Mapping[str, Any]) -> list[str]:
    """Return the keys of the JSON of a kind of study, without those of its variable parts."""
    return [f"{kind}: {key}" for key in sorted(data)]


def stored(name: str) -> list[str]:
    """Return a listing of docs/stable."""
    return (FOLDER / f"{name}.txt").read_text("utf-8").splitlines()


def write(name: str, lines: Iterable[str]) -> None:
    """Write a listing to docs/stable."""
    FOLDER.mkdir(exist_ok=True)
    (FOLDER / f"{name}.txt").write_text("\n".join(lines) + "\n", "utf-8")


if __name__ == "__main__":
    import tempfile

    from tests.studies import test_every_kind

    write("python-names", python_names())
    write("scenario-keys", scenario_keys())
    with tempfile.TemporaryDirectory() as samples:
        test_every_kind.FOLDER[:] = [Path(samples)]
        write("json-keys", test_every_kind.json_of_every_kind())
