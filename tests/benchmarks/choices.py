"""The rows of the README's table: which model and stepper for which task."""

from __future__ import annotations

import wearsim
from tests.benchmarks.studies import PAPER
from tests.benchmarks.table import Effort, Row, part
from tests.benchmarks.wear_tests import SCENARIOS
from wearsim.studies.run.result import Result
from wearsim_bench.measure.timing import best, timed

RUNS: dict[str, dict[str, object]] = {
    "a wear test: `slender`, `implicit` (the defaults)": {},
    "a first look: the same, `tolerance = 0.1`": {"evolution.tolerance": 0.1},
    "a plugin with `solve` alone: `stabilised`": {"contact.model": "winkler"},
}
REFERENCE = "the reference: `slender`, `per-pass`"


def choice_rows(effort: Effort) -> list[Row]:
    """Time the 450-minute test by model and stepper, and one fresh contact of many draws."""
    duration = {"operation.duration": f"{450 * effort.part:.12g} min"}

    def run(changes: dict[str, object]) -> Result:
        return wearsim.run(wearsim.load_scenario(SCENARIOS / "rig-450min.toml", changes))

    run({"evolution.stepper": "per-pass", "operation.duration": "1 s"})  # compiles
    kept: list[Result] = []
    every_pass = duration | {"evolution.stepper": "per-pass"}
    seconds = timed(lambda: kept.append(run(every_pass)))
    exact = float(kept[0].depth[-1])
    rows = []
    for name, changes in RUNS.items():
        depth = float(run(duration | changes).depth[-1])
        scenario = wearsim.load_scenario(SCENARIOS / "rig-450min.toml", duration | changes)
        quick = best(lambda scenario=scenario: wearsim.run(scenario), effort.repetitions)
        rows.append(Row(name, quick, "", f"depth {part(depth / exact - 1)}"))
    rows.append(Row(REFERENCE, seconds))
    return [*rows, _fresh_contact(effort)]


def _fresh_contact(effort: Effort) -> Row:
    """Time one of 1000 draws of a fresh contact, against a refined grid."""
    count = 100 if effort.quick else 1000

    def power(points: int) -> tuple[float, float]:
        changes = {"contact.mx": points, "contact.my": points}
        study = wearsim.dissipation(wearsim.load_scenario(PAPER, changes), count)
        return study.summaries["power"].mean, study.raw.solve_seconds

    found = min((power(24) for _ in range(effort.repetitions)), key=lambda item: item[1])
    error = f"mean power {part(found[0] / power(200)[0] - 1)}"
    return Row("many draws of a fresh contact: `hertz-fastsim`", found[1] / count, "", error)
