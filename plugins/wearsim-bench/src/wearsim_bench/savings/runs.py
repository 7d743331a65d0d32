"""Savings within a whole test or study: alike rollers, records, random inputs without effect."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from wearsim.scenario import Scenario
from wearsim.scenario.examples import shipped_scenario
from wearsim.scenario.tables.plain import DEFAULT_RECORDS
from wearsim.studies.contact.draws import draw_contacts
from wearsim.studies.run.run import run
from wearsim.types import FloatArray
from wearsim.uq.sampling.sampler import Sampler
from wearsim_bench.savings.pairs import Pair, Ways
from wearsim_bench.stepping.runs import Ready, WearTest

RIG, MINUTES, QUICK_MINUTES = "rig-450min", 22.5, 0.5
STEPPERS = ("implicit", "stabilised", "per-pass")
APART = ["0 mm", "1e-9 mm", "2e-9 mm"]  # rollers that are alike, and told apart
RECORDS = 200
DRAWS, QUICK_DRAWS = 100_000, 1000
_WEAR = {
    "law": "archard-dissipation",
    "cylinder": {
        "k_over_h": {"distribution": "uniform", "low": "1e-11 1/Pa", "high": "2e-11 1/Pa"}
    },
    "roller": {"k_over_h": "0 1/Pa"},
}


def alike_rollers(quick: bool) -> Iterator[Pair]:
    """Yield every stepper with three rollers merged into one, and with the same three apart."""
    for stepper in STEPPERS:
        yield Pair("alike rollers", stepper, partial(_rollers, quick, stepper))


def _rollers(quick: bool, stepper: str) -> Ways:
    test = WearTest(RIG, QUICK_MINUTES if quick else MINUTES)
    changes: dict[str, object] = {"evolution.stepper": stepper}
    merged, apart = (
        _profile(Ready(test.asked({**changes, **further})))
        for further in ({}, {"roller.offset": APART})
    )
    return Ways({"merged": merged, "each by itself": apart})


def _profile(ready: Ready) -> Callable[[], FloatArray]:
    def profile() -> FloatArray:
        return ready.stepped(ready.stop).state.cylinder_depth.ravel()

    return profile


def records(quick: bool) -> Iterator[Pair]:
    """Yield a test recorded as by default, at its end alone, and at many moments."""
    test = WearTest(RIG, QUICK_MINUTES if quick else MINUTES)
    ways = {
        f"{DEFAULT_RECORDS} times": partial(_recorded, test.asked({})),
        "at the end": partial(_recorded, test.asked({"outputs": {"records": 1}})),
        f"{RECORDS} times": partial(_recorded, test.asked({"outputs": {"records": RECORDS}})),
    }
    yield Pair("records", "one test", lambda: Ways(ways))


def _recorded(scenario: Scenario) -> FloatArray:
    profiles: FloatArray = run(scenario).raw.records["cylinder_depth_profile"]
    return np.ravel(profiles[-1])


def idle_inputs(quick: bool) -> Iterator[Pair]:
    """Yield the draws of a study of one contact, without and with an input that does not act."""
    count = QUICK_DRAWS if quick else DRAWS
    scenario = shipped_scenario("paper-monte-carlo", {"wear": _WEAR})
    ways = {
        "not drawn": partial(_drawn, scenario, count),
        "drawn too": partial(_all_drawn, scenario, count),
    }
    yield Pair("idle inputs", f"{count} draws", lambda: Ways(ways))


def _drawn(scenario: Scenario, count: int) -> FloatArray:
    return np.concatenate(list(draw_contacts(scenario, count).values.values()))


def _all_drawn(scenario: Scenario, count: int) -> FloatArray:
    found = draw_contacts(scenario, count)
    idle = [item for item in scenario.random if not set(item.keys) <= found.values.keys()]
    inputs = [(item.name, item.dimension) for item in idle]
    sampler = Sampler(scenario.seed, inputs, scenario.sampling.plan, total=count)
    uniforms = sampler.uniforms(0, count)
    for item in idle:
        item.values(uniforms[item.name])
    return np.concatenate(list(found.values.values()))
