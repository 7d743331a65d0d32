"""Kernels that Python interprets have the results of compiled kernels, to the last bit."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wearsim
from wearsim.mechanics.numerics import jit

SCENARIOS = Path(__file__).parents[2] / "scenarios"
PROCESS = {
    "distribution": "ornstein-uhlenbeck",
    "correlation_time": "10 s",
    "marginal": {"distribution": "uniform", "low": 0.09, "high": 0.11},
}
SPRING = {"kind": "spring", "normal_force": "300 N", "stiffness": "690 N/mm"}
CASES: list[dict[str, Any]] = [
    {},
    {"operation.duration": "2 min"},
    {"operation.duration": "1 min", "friction.coefficient": PROCESS},
    {"operation.duration": "20 min", "load": SPRING},
    {"operation.duration": "20 min", "roller.radius": "20 mm", "load.normal_force": "2 kN"},
    {"operation.duration": "20 min", "creepage": {"longitudinal": 1e-4, "tilt": "2 mrad"}},
]


def interpreted(kernel: jit.Kernel, *arguments: Any) -> Any:
    with np.errstate(all="ignore"):
        return kernel._function(*arguments)


@pytest.mark.parametrize("overrides", CASES, ids=str)
def test_interpreted_test_equals_compiled_one(overrides, monkeypatch: pytest.MonkeyPatch):
    scenario = wearsim.load_scenario(SCENARIOS / "rig-450min.toml", overrides)
    compiled = wearsim.run(scenario).to_xarray()
    monkeypatch.setattr(jit.Kernel, "__call__", interpreted)
    xarray = wearsim.run(scenario).to_xarray()
    names = [name for name in compiled if name != "wall_time"]
    different = [n for n in names if not xarray[n].identical(compiled[n])]
    assert not different


FIRST_RUN = f"""
import json, sys
import wearsim
result = wearsim.run(r"{SCENARIOS / "rig-450min.toml"}")
from wearsim.mechanics.numerics import jit
used = [kernel.dispatcher for kernel in jit._KERNELS if kernel.is_ready]
compiled = sum(len(dispatcher.stats.cache_misses) for dispatcher in used)
print(json.dumps([len(used), compiled, result.depth[-1].hex(), str(jit._cache_folder())]))
"""


@pytest.mark.slow
@pytest.mark.skipif(jit.processors() == 1, reason="kernels are compiled by another process")
def test_first_run_does_not_wait_for_its_kernels(tmp_path: Path):
    found = []
    for _ in range(2):
        code = [sys.executable, "-P", "-c", FIRST_RUN]
        place = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
        run = subprocess.run(code, env=place, capture_output=True, text=True, check=True)
        found.append(json.loads(run.stdout))
        folder, end = Path(found[-1][3]), time.monotonic() + 300.0
        last = "begin_step", "strip_contacts"  # one of them is compiled last
        while time.monotonic() < end and not all(list(folder.glob(f"*/*.{k}-*.nbc")) for k in last):
            time.sleep(0.5)
    (_, *first, _), (read, *second, _) = found
    assert first == second
    assert first[0] == 0  # compiled by neither run
    assert read > 5
