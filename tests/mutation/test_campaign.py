"""Mutants of a small module, and a small sample of those of wearsim."""

from __future__ import annotations

import json
import subprocess
import sys
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path

import pytest

from tests.mutation.campaign import (
    EQUIVALENT,
    KILLED,
    PARTS,
    ROOT,
    SURVIVED,
    UNTESTED,
    equivalent,
    is_listed,
    modules_of,
    rates,
)
from tests.mutation.operators import Mutant, mutants_of, mutated_code

MODULE = '''
"""Module with one function."""

def least(values: list[float], start: float = 1.0) -> float:
    """Return the least value, not above `start`."""
    found = start
    for value, _ in zip(values, values, strict=True):
        if value < found and not value != value:
            found = -(-value)
    if not values:
        raise ValueError(f"{2 * 3} no values" + "1")
    return found + 0.0
'''


EITHER = "value < found or not value != value"


@pytest.fixture
def mutants(tmp_path: Path) -> list[Mutant]:
    (tmp_path / "least.py").write_text(MODULE)
    return mutants_of(tmp_path, tmp_path / "least.py")


def test_mutants_change_operators_constants_conditions_and_results(mutants: list[Mutant]) -> None:
    changes = {(one.operator, one.before, one.after) for one in mutants}
    assert changes == {
        ("comparison", "value < found", "value <= found"),
        ("comparison", "value != value", "value == value"),
        (
            "boolean",
            "value < found and (not value != value)",
            "value < found or not value != value",
        ),
        ("boolean", "not value != value", "value != value"),
        ("boolean", "not values", "values"),
        ("arithmetic", "--value", "-value"),
        ("arithmetic", "-value", "value"),
        ("arithmetic", "found + 0.0", "found - 0.0"),
        ("constant", "0.0", "1.0"),
        ("result", "return found + 0.0", "return None"),
        ("condition", "if value < found and (not value != value):", "if False:"),
        ("condition", "if not values:", "if False:"),
    }


def test_code_of_a_mutant_has_its_change_alone(mutants: list[Mutant], tmp_path: Path) -> None:
    space: dict[str, object] = {}
    exec(compile(MODULE, str(tmp_path / "least.py"), "exec"), space)
    least = space["least"]
    found = {}
    for mutant in mutants:
        least.__code__ = mutated_code(tmp_path, mutant)  # type: ignore[attr-defined]
        try:
            found[mutant.before, mutant.after] = least([3.0, -1.0, 0.5])  # type: ignore[operator]
        except ValueError:
            found[mutant.before, mutant.after] = "raised"
    assert found["0.0", "1.0"] == 0.0
    assert found["-value", "value"] == found["--value", "-value"] == -0.5
    assert found["not values", "values"] == "raised"
    assert found["return found + 0.0", "return None"] is None
    assert found["value < found", "value <= found"] == -1.0


def test_listed_mutants_exist_and_have_a_reason() -> None:
    modules = [path for part in PARTS for path in modules_of(part)]
    for one in equivalent():
        assert len(one["reason"]) > 20, one
        paths = [
            path for path in modules if fnmatchcase(str(path.relative_to(ROOT)), one["module"])
        ]
        assert paths, one
        if "changes" in one:
            changes = set(one["changes"])
            every = (m for path in paths for m in of_module(path) if m.change in changes)
            found = {mutant.change for mutant in every if is_listed(mutant, [one])}
            assert not changes - found, f"{EQUIVALENT}: {one['function']}"


@cache
def of_module(path: Path) -> list[Mutant]:
    """Return the mutants of a module."""
    return mutants_of(ROOT, path)


def test_rates_are_of_each_module(mutants: list[Mutant]) -> None:
    outcomes = dict.fromkeys(mutants, KILLED)
    outcomes |= {mutants[0]: SURVIVED, mutants[1]: UNTESTED}
    assert rates(outcomes).splitlines()[2] == "| least.py | 12 | 83 % | 1 | 1 |"


@pytest.mark.slow
def test_tests_kill_a_sample_of_mutants(tmp_path: Path) -> None:
    module, tests = "wearsim/uq/estimation/mann_whitney.py", "tests/uq/test_mann_whitney.py"
    command = [sys.executable, "-m", "tests.mutation.campaign", module, "--tests", tests]
    command += ["--sample", "5", "--only", "compiled", "--folder", str(tmp_path)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    rows = json.loads((tmp_path / "compiled.json").read_text())
    assert len(rows) == 5
    assert sum(row["outcome"] == KILLED for row in rows) >= 4
