"""Whole wear tests with the default stepper, against solving every roller pass."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import wearsim
from tests.benchmarks.table import Effort, Row, part
from wearsim.results.io.files import write_results
from wearsim.scenario import Scenario
from wearsim.studies.opening import open_results
from wearsim.studies.run.result import Result
from wearsim_bench.measure.timing import best, timed

SCENARIOS = Path(__file__).parents[2] / "scenarios"
SPRING = {"load.kind": "spring", "load.stiffness": "690 N/mm"}
WEAR_TESTS: dict[str, tuple[str, dict[str, object]]] = {
    "rig-450min": ("rig-450min.toml", {}),
    "rig-450min with a spring": ("rig-450min.toml", SPRING),
    "rig-logged-load": ("rig-logged-load.toml", {}),
    "rig-three-rollers": ("rig-three-rollers.toml", {}),
}
_LOAD = {"distribution": "maxent", "support": ["0 N", "inf"], "mean": "307 N", "std": "32 N"}
_FRICTION = {"distribution": "maxent", "support": [0, "inf"], "mean": 0.1, "std": 0.02}
_CREEPAGE = {"distribution": "maxent", "support": [0, 1], "mean": 1e-3, "std": 4e-4}
_MISALIGNMENT = {"distribution": "disc", "radius": "2 mrad"}
SCATTER: dict[str, dict[str, object]] = {
    "misalignment drawn at every pass": {"creepage.misalignment": _MISALIGNMENT},
    "load, friction, creepage and misalignment drawn at every pass": {
        "load.normal_force": _LOAD,
        "friction.coefficient": _FRICTION,
        "creepage.longitudinal": _CREEPAGE,
        "creepage.misalignment": _MISALIGNMENT,
    },
}
TARGETS = {"rig-450min": "0.3 s, aim 0.03 s; 0.5 % in depth"}


def scenario(name: str, effort: Effort, stepper: str = "auto") -> Scenario:
    """Return a scenario of `WEAR_TESTS`, shortened according to the effort."""
    file, overrides = WEAR_TESTS[name]
    changes = overrides | {
        "evolution.stepper": stepper,
        "operation.duration": f"{450 * effort.part:.12g} min",
    }
    return wearsim.load_scenario(SCENARIOS / file, changes)


def errors_against(result: Result, reference: Result) -> str:
    """Return the true and the estimated errors of depth and volume."""
    depth, volume = float(result.depth[-1]), float(result.worn_volume[-1])
    true = (
        f"depth {part(depth / float(reference.depth[-1]) - 1)},"
        f" volume {part(volume / float(reference.worn_volume[-1]) - 1)}"
    )
    estimate = (
        f"estimated {part(float(result.depth_error[-1]) / depth)},"
        f" {part(float(result.volume_error[-1]) / volume)}"
    )
    return f"{true} ({estimate.replace('+', '')})"


def wear_test_rows(effort: Effort) -> list[Row]:
    """Time each test with the default stepper, and once with `per-pass`, which takes long."""
    rows = []
    for name in WEAR_TESTS:
        every_pass = scenario(name, effort, "per-pass")
        wearsim.run(scenario(name, Effort(part=1e-4), "per-pass"))  # compiles
        references: list[Result] = []
        slow = timed(lambda run=every_pass, kept=references: kept.append(wearsim.run(run)))
        default = scenario(name, effort)
        result = wearsim.run(default)
        quick = best(lambda run=default: wearsim.run(run), effort.repetitions)
        steps = f"{int(result.steps)} steps, {int(result.solves[-1])} contact solves"
        target = TARGETS.get(name, "")
        rows.append(Row(f"{name}, {steps}", quick, target, errors_against(result, references[0])))
        passes = f"{float(references[0].passes[-1]):,.0f} passes".replace(",", " ")
        target = "60 s, aim 15 s" if name == "rig-450min" else ""
        in_full = f"{int(references[0].full_solves[-1])} solved in full"
        rows.append(Row(f"{name}, pass by pass, {passes}", slow, target, in_full))
    return rows


def scatter_rows(effort: Effort) -> list[Row]:
    """Time expected wear with inputs drawn at every pass, against drawing for every pass."""
    rows = []
    for name, inputs in SCATTER.items():
        drawn = {
            key: {**distribution, "persistence": "per-pass"} for key, distribution in inputs.items()
        }
        found = []
        for stepper in ("implicit", "per-pass"):
            changes = drawn | {
                "evolution.stepper": stepper,
                "operation.duration": f"{45 * effort.part:.12g} min",
            }
            shortened = wearsim.load_scenario(SCENARIOS / "rig-450min.toml", changes)
            kept: list[Result] = []
            seconds = timed(lambda run=shortened, kept=kept: kept.append(wearsim.run(run)))
            found.append((kept[0], seconds))
        (result, quick), (reference, slow) = found
        what = f"a tenth of rig-450min, {name}"
        steps = f"{int(result.steps)} steps, {int(result.solves[-1])} contact solves"
        rows.append(Row(f"{what}, {steps}", quick, "", errors_against(result, reference)))
        passes = f"{float(reference.passes[-1]):,.0f} passes".replace(",", " ")
        rows.append(Row(f"{what}, {passes} drawn individually", slow))
    return rows


def file_rows(effort: Effort) -> list[Row]:
    """Time the writing and the reading of a results file."""
    result = wearsim.run(scenario("rig-450min", effort))
    with TemporaryDirectory() as folder:
        path = Path(folder) / "rig.h5"
        write = best(lambda: write_results(path, result.raw), effort.repetitions)
        read = best(lambda: open_results(path), effort.repetitions)
        same = (open_results(path).depth == result.depth).all()
        size = path.stat().st_size / 1024
    check = "is read back bit for bit" if same else "DIFFERS"
    return [
        Row(f"results file, written ({size:.0f} KiB)", write, "", check),
        Row("results file, opened", read),
    ]
