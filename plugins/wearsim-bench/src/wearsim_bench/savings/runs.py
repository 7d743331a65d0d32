"""Savings in a test or study: identical rollers, records, random inputs without effect."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from wearsim.scenario import Scenario
from wearsim.scenario.examples import shipped_scenario
from wearsim.scenario.tables.plain import DEFAULT_RECORDS
from wearsim.studies.contact.batch import acting_inputs
from wearsim.studies.run.draws import Drawer
from wearsim.studies.run.run import run
from wearsim.types import FloatArray
from wearsim.uq.sampling.sampler import Sampler
from wearsim_bench.savings.saving import Alternatives, Saving
from wearsim_bench.stepping.runs import PreparedTest, WearTest

RIG, MINUTES, QUICK_MINUTES = "rig-450min", 22.5, 0.5
STEPPERS = ("implicit", "stabilised", "per-pass")
OFFSETS = ["0 mm", "1e-9 mm", "2e-9 mm"]  # prevent the merging of identical rollers
RECORDS = 200
DRAWS, QUICK_DRAWS = 100_000, 1000
_WEAR = {
    "law": "archard-dissipation",
    "cylinder": {
        "k_over_h": {"distribution": "uniform", "low": "1e-11 1/Pa", "high": "2e-11 1/Pa"}
    },
    "roller": {"k_over_h": "0 1/Pa"},
}


def identical_rollers(quick: bool) -> Iterator[Saving]:
    """Yield all steppers with three identical rollers, merged into one and separate."""
    for stepper in STEPPERS:
        yield Saving("identical rollers", stepper, partial(_rollers, quick, stepper))


def _rollers(quick: bool, stepper: str) -> Alternatives:
    test = WearTest(RIG, QUICK_MINUTES if quick else MINUTES)
    changes: dict[str, object] = {"evolution.stepper": stepper}
    merged, separate = (
        _profile(PreparedTest(test.scenario_with({**changes, **further})))
        for further in ({}, {"roller.offset": OFFSETS})
    )
    return Alternatives({"merged": merged, "separate": separate})


def _profile(prepared: PreparedTest) -> Callable[[], FloatArray]:
    def profile() -> FloatArray:
        return prepared.stepped(prepared.stop).state.cylinder_depth.ravel()

    return profile


def records(quick: bool) -> Iterator[Saving]:
    """Yield a test with the default records, with one record, and with many records."""
    test = WearTest(RIG, QUICK_MINUTES if quick else MINUTES)
    alternatives = {
        f"{DEFAULT_RECORDS} times": partial(_recorded, test.scenario_with({})),
        "at the end": partial(_recorded, test.scenario_with({"outputs": {"records": 1}})),
        f"{RECORDS} times": partial(
            _recorded, test.scenario_with({"outputs": {"records": RECORDS}})
        ),
    }
    yield Saving("records", "one test", lambda: Alternatives(alternatives))


def _recorded(scenario: Scenario) -> FloatArray:
    profiles: FloatArray = run(scenario).raw.records["cylinder_depth_profile"]
    return np.ravel(profiles[-1])


def idle_inputs(quick: bool) -> Iterator[Saving]:
    """Yield the draws of a study of one contact, without and with an input that has no effect."""
    count = QUICK_DRAWS if quick else DRAWS
    scenario = shipped_scenario("paper-monte-carlo", {"wear": _WEAR})
    alternatives = {
        "not drawn": partial(_drawn, scenario, count),
        "drawn": partial(_all_drawn, scenario, count),
    }
    yield Saving("idle inputs", f"{count} draws", lambda: Alternatives(alternatives))


def _drawn(scenario: Scenario, count: int) -> FloatArray:
    drawer = Drawer(acting_inputs(scenario)[0], scenario.sampling.plan, count, replicates=1)
    return np.concatenate(list(drawer.columns(0, count).values()))


def _all_drawn(scenario: Scenario, count: int) -> FloatArray:
    acting = {item.name for item in acting_inputs(scenario)[0].random}
    idle = [item for item in scenario.random if item.name not in acting]
    inputs = [(item.name, item.dimension) for item in idle]
    sampler = Sampler(scenario.seed, inputs, scenario.sampling.plan, total=count)
    uniforms = sampler.uniforms(0, count)
    for item in idle:
        item.values(uniforms[item.name])
    return _drawn(scenario, count)
