"""Kernels that a study is expected to compile, against those that it does compile or call."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from types import FunctionType
from typing import Any

import pytest

import wearsim
from wearsim.mechanics.numerics import jit
from wearsim.mechanics.numerics.jit import kernel, subroutine
from wearsim.studies.kernels import compilation_counted, kernels_of

SCENARIOS = Path(__file__).parents[2] / "scenarios"

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


def called_by(name: str) -> set[str]:
    """Return a kernel and those that it calls, also by subroutines, all by name."""
    named = {item.__name__: item for item in jit._KERNELS}
    names: set[str] = set()
    functions = [named[name]._function]
    seen: list[Any] = []
    while functions:
        function = functions.pop()
        seen.append(function)
        for item in map(function.__globals__.get, function.__code__.co_names):
            callee = item._function if isinstance(item, jit.Kernel) else item
            module = str(getattr(callee, "__module__", ""))
            if isinstance(callee, FunctionType) and module.startswith("wearsim.mechanics."):
                names |= {item.__name__} if isinstance(item, jit.Kernel) else set()
                functions += [] if callee in seen else [callee]
    return names | {name}


@pytest.mark.parametrize("case", CASES, ids=str)
def test_expected_kernels_are_those_that_are_called(case, monkeypatch: pytest.MonkeyPatch):
    name, study, fields, overrides = case
    short = {"operation.duration": "0.1 min"} if study == "test" else {}
    scenario = wearsim.load_scenario(SCENARIOS / f"{name}.toml", overrides | short)
    by_python: set[str] = set()
    call = jit.Kernel.__call__

    def counted(self: jit.Kernel, *arguments: Any) -> Any:
        by_python.add(self.__name__)
        return call(self, *arguments)

    monkeypatch.setattr(jit.Kernel, "__call__", counted)
    if study == "test":
        wearsim.run(scenario)
    elif study == "contacts":
        wearsim.dissipation(scenario, 4)
    else:
        wearsim.study_contact(scenario, with_fields=fields)
    # a kernel from the cache contains those that it calls
    called = set().union(*map(called_by, by_python))
    assert called == kernels_of(scenario, study, fields)


COMPILED = """
import json, sys
import wearsim
from wearsim.mechanics.numerics.jit import compilation_reported
from wearsim.studies.kernels import kernels_of
compiled = []
with compilation_reported(compiled.append):
    scenario = wearsim.load_scenario(sys.argv[1])
    wearsim.study_contact(scenario, with_fields=True)
print(json.dumps([compiled, sorted(kernels_of(scenario, "contact", True))]))
"""


@pytest.mark.slow
def test_expected_kernels_are_those_that_are_compiled(tmp_path: Path):
    process = subprocess.run(
        [sys.executable, "-P", "-c", COMPILED, str(SCENARIOS / "mean-contact.toml")],
        env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    compiled, expected = json.loads(process.stdout)
    assert sorted(compiled) == expected


@pytest.fixture
def empty_cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))


@pytest.mark.usefixtures("empty_cache")
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


@pytest.mark.usefixtures("empty_cache")
def test_kernels_that_are_not_expected_raise_the_total():
    @kernel
    def other(x: float) -> float:
        return 2.0 * x

    reports: list[tuple[int, int]] = []
    with compilation_counted(lambda *report: reports.append(report), lambda: {"missing"}):
        other(1.0)
    assert reports == [(1, 2)]
