"""Kernels that a study is expected to compile, against those that it does compile or call."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from wearsim.mechanics.numerics import jit
from wearsim.mechanics.numerics.jit import kernel, subroutine
from wearsim.studies.kernels import compilation_counted

SCENARIOS = Path(__file__).parents[2] / "scenarios"

CODE = """
import json, sys
import wearsim
from wearsim.mechanics.numerics import jit
from wearsim.mechanics.numerics.jit import compilation_reported, ready_kernels
from wearsim.studies.kernels import kernels_of
file, study, fields, overrides = json.loads(sys.argv[1])
compiled = []
jit._call_elsewhere = lambda function: None  # compile all of them in this process
with compilation_reported(compiled.append):
    scenario = wearsim.load_scenario(file, overrides)
    if study == "test":
        wearsim.run(scenario)
    elif study == "contacts":
        wearsim.dissipation(scenario, 4)
    else:
        wearsim.study_contact(scenario, with_fields=fields)
print(json.dumps([sorted(kernels_of(scenario, study, fields)), compiled, sorted(ready_kernels())]))
"""

MARGINAL = {"distribution": "uniform", "low": 0.09, "high": 0.11}
FIELD = {"distribution": "gaussian-field", "correlation_length": "300 um", "marginal": MARGINAL}
PROCESS = {
    "distribution": "ornstein-uhlenbeck",
    "correlation_time": "10 s",
    "marginal": MARGINAL,
}
CASES: list[tuple[str, str, bool, dict[str, Any]]] = [
    ("rig-450min", "test", False, {}),
    ("rig-450min", "test", False, {"friction.coefficient": PROCESS}),
    ("rig-450min", "test", False, {"creepage": {"drive": "free", "bearing_torque": "10 N mm"}}),
    ("rig-450min", "test", False, {"contact.tangential": "fastsim"}),
    ("rig-450min", "test", False, {"evolution.stepper": "per-pass"}),
    ("rig-450min", "test", False, {"contact": {"model": "semi-hertzian"}}),
    ("rig-450min", "test", False, {"contact": {"model": "hertz"}}),
    ("rig-450min", "contact", True, {"contact.tangential": "fastrip"}),
    ("mean-contact", "contact", True, {}),
    ("mean-contact", "contacts", False, {"friction.coefficient": FIELD}),
]


def kernels(
    case: tuple[str, str, bool, dict[str, Any]], **environment: str
) -> Sequence[Sequence[str]]:
    """Return the expected, the compiled and the ready kernels of a study in a new process."""
    name, study, fields, overrides = case
    short = {"operation.duration": "0.1 min"} if study == "test" else {}
    arguments = str(SCENARIOS / f"{name}.toml"), study, fields, overrides | short
    process = subprocess.run(
        [sys.executable, "-P", "-c", CODE, json.dumps(arguments)],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(process.stdout)  # type: ignore[no-any-return]


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=str)
def test_expected_kernels_are_those_that_are_compiled(case, tmp_path: Path):
    expected, compiled, _ = kernels(case, NUMBA_CACHE_DIR=str(tmp_path))
    assert sorted(set(compiled)) == expected


def test_kernels_that_a_run_calls_are_expected():
    expected, _, ready = kernels(CASES[0])
    # a kernel from the cache contains those that it calls
    assert set(expected) - set(ready) <= {"factor_in_place", "solve_factored"}
    assert set(ready) <= set(expected)


@pytest.fixture
def without_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jit, "_cache_folder", lambda: None)


@pytest.mark.usefixtures("without_cache")
def test_kernels_are_counted_as_they_are_compiled():
    @subroutine
    def part(x: float) -> float:
        return x + 1.0

    @kernel
    def inner(x: float) -> float:
        return 2.0 * part(x)

    @kernel
    def outer(x: float) -> float:
        return 3.0 * inner(x)

    reports: list[tuple[int, int]] = []
    with compilation_counted(lambda *report: reports.append(report), lambda: {"outer", "inner"}):
        assert outer(1.0) == 12.0
    assert reports == [(1, 2), (2, 2)]
    with compilation_counted(lambda *report: reports.append(report), lambda: {"outer", "inner"}):
        assert outer(2.0) == 18.0
    assert len(reports) == 2


@pytest.mark.usefixtures("without_cache")
def test_kernels_that_are_not_expected_raise_the_total():
    @kernel
    def other(x: float) -> float:
        return 2.0 * x

    reports: list[tuple[int, int]] = []
    with compilation_counted(lambda *report: reports.append(report), lambda: {"missing"}):
        other(1.0)
    assert reports == [(1, 2)]
