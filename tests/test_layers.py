"""Structure of the packages: layers, sizes of packages and files, import circles, output."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MODULES = sorted((ROOT / "wearsim").rglob("*.py"))
PLUGIN_MODULES = sorted(ROOT.glob("plugins/*/src/**/*.py"))
TESTS = sorted([*ROOT.glob("tests/**/*.py"), *ROOT.glob("plugins/*/tests/**/*.py")])
MAX_LINES, MAX_FILES = 500, 15
EXEMPT = ROOT / "wearsim" / "cli" / "commands"  # one file per command


def test_layers_are_imported_from_above_only():
    command = "from importlinter.cli import lint_imports; raise SystemExit(lint_imports())"
    done = subprocess.run(
        [sys.executable, "-c", command], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "0 broken" in done.stdout


def test_every_package_is_in_the_layers_contract():
    pyproject = (ROOT / "pyproject.toml").read_text()
    packages = {path.parent.name for path in (ROOT / "wearsim").glob("*/__init__.py")}
    assert len(packages) >= 9
    missing = [name for name in sorted(packages) if f'"wearsim.{name}",\n' not in pyproject]
    assert not missing, f"packages outside the layers contract: {missing}"


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text())


def prints(path: Path) -> bool:
    calls = [node for node in ast.walk(tree(path)) if isinstance(node, ast.Call)]
    return "print" in {call.func.id for call in calls if isinstance(call.func, ast.Name)}


def test_no_module_prints():
    # the text is searched first, which takes a tenth of the time
    named = [path for path in MODULES if "print" in path.read_text()]
    assert not [str(path) for path in named if prints(path)]


def test_every_module_has_a_docstring():
    # the whole module takes seconds to parse
    bare = [str(path) for path in MODULES if not re.match(r'r?"""\s*[^\s"]', path.read_text())]
    assert not bare


PATCHES = {"setattr", "delattr", "setitem", "delitem", "patch", "object"}
MAY_PATCH = re.compile(r"(set|del)attr\(|patch\(|\._\w+(\.\w+)* = ")
PRIVATE = re.compile(r"(?<!\w)_(?!_)\w")


def patched_names(module: ast.Module) -> Iterator[str]:
    """Yield the attributes that a test module replaces, except attributes of `self`."""
    for node in ast.walk(module):
        if isinstance(node, ast.Call):
            called = getattr(node.func, "attr", getattr(node.func, "id", ""))
            if called in PATCHES:
                names = [name for name in node.args[:2] if isinstance(name, ast.Constant)]
                yield from (str(name.value).rpartition(".")[2] for name in names)
        elif isinstance(node, ast.Attribute) and not isinstance(node.ctx, ast.Load):
            text = ast.unparse(node)
            yield from [] if text.rpartition(".")[0] == "self" else text.split(".")


def test_tests_patch_no_private_names():
    texts = {path: path.read_text() for path in TESTS}
    found = {
        str(path.relative_to(ROOT)): name
        for path, text in texts.items()
        if MAY_PATCH.search(text) and PRIVATE.search(text)
        for name in patched_names(tree(path))
        if re.match("_(?!_)", name)
    }
    assert not found, "replace by an argument, a public name, or a test of the effect"


@pytest.mark.parametrize(
    ("line", "names"),
    [
        ('monkeypatch.setattr("wearsim.run._clock", now)', {"_clock"}),
        ("monkeypatch.delattr(run, '_clock')", {"_clock"}),
        ("run._clock = now", {"run", "_clock"}),
        ("run._state.clock = now", {"run", "_state", "clock"}),
        ("self._clock = now", set()),
        ("now = run._clock", set()),
    ],
)
def test_patched_names_are_found(line: str, names: set[str]):
    assert set(patched_names(ast.parse(line))) == names


def test_no_file_is_longer_than_500_lines():
    files = MODULES + PLUGIN_MODULES + TESTS
    assert len(TESTS) > 100
    lines = {path: len(path.read_text().splitlines()) for path in files}
    long = {str(path.relative_to(ROOT)): n for path, n in lines.items() if n > MAX_LINES}
    assert not long


def test_no_package_has_more_than_15_files():
    folders = {path.parent for path in MODULES + PLUGIN_MODULES} - {EXEMPT}
    files = {str(folder.relative_to(ROOT)): len(list(folder.glob("*.py"))) for folder in folders}
    assert not {folder: count for folder, count in files.items() if count > MAX_FILES}


def module_name(path: Path) -> str:
    """Return the dotted name of a module of wearsim or of a plugin."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    parts = parts[parts.index("src") + 1 :] if "src" in parts else parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports_of(node: ast.AST) -> Iterator[ast.Import | ast.ImportFrom]:
    """Yield the imports below a node, local ones too, without those for type checkers alone."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Import | ast.ImportFrom):
            yield child
        elif isinstance(child, ast.If) and getattr(child.test, "id", "") == "TYPE_CHECKING":
            yield from (item for branch in child.orelse for item in imports_of(branch))
        elif not isinstance(child, ast.expr):  # expressions contain no imports
            yield from imports_of(child)


def imported_modules(name: str, tree: ast.Module, known: set[str]) -> set[str]:
    """Return the modules of `known` that a module imports, or imports names of."""
    found = set()
    for item in imports_of(tree):
        if isinstance(item, ast.Import):
            found |= {alias.name for alias in item.names}
        else:
            assert item.level == 0, f"{name}: relative import"
            names = {f"{item.module}.{alias.name}" for alias in item.names}
            found |= {f"{item.module}"} if names - known else set()
            found |= names
    return (found & known) - {name}


def test_modules_do_not_import_each_other_in_a_circle():
    trees = {module_name(path): tree(path) for path in MODULES + PLUGIN_MODULES}
    known = set(trees)
    graph = {name: imported_modules(name, found, known) for name, found in trees.items()}
    assert graph["wearsim.evolution.problem"] >= {"wearsim.types", "wearsim.plugins"}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))
