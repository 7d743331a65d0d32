"""Plausibility of the limit of a run, before it starts."""

from __future__ import annotations

import math

from wearsim.errors import Mistake, ScenarioError
from wearsim.evolution.limits import Limit
from wearsim.scenario import Scenario
from wearsim.studies.failures import DEEPEST
from wearsim.studies.forecast import WearForecast
from wearsim.studies.run.assemble import assemble_problem
from wearsim.studies.run.continuation import written_value
from wearsim.studies.run.draws import draw
from wearsim.studies.run.grid import start_of_run

EXTENSIONS = 10  # of a test that ends before its limit, each to twice its length
LONGER = 4.0  # times the test, from which on a limit gives a warning
PRESSURE = 2.0  # times that of the fresh contact, which no groove reaches
_DEPTHS = ("depth", "roller depth", "lift error", "clearance")


def limit_warnings(scenario: Scenario, limit: Limit) -> list[str]:
    """Return a warning if a run takes several times its test to reach a limit.

    Parameters
    ----------
    scenario : Scenario
    limit : Limit

    Raises
    ------
    ScenarioError
        If the limit is beyond the validity of the models, or no run of `EXTENSIONS` extensions
        reaches it, as forecast.
    """
    if limit.quantity in {"time", "passes"}:
        return []
    roller, deep = scenario.roller, DEEPEST * scenario.roller.radius
    if not scenario.evolution.allow_deep:
        most, what = (
            math.inf,
            f"which is {DEEPEST:g} times roller.radius = {1e3 * roller.radius:g} mm",
        )
        if limit.quantity in _DEPTHS:
            most, shown = deep, f"{1e3 * deep:.4g} mm"
        elif limit.quantity == "width":
            most = 2.0 * math.sqrt(2.0 * roller.crown_radius * deep)
            shown = f"{1e3 * most:.4g} mm, a groove of a depth of {1e3 * deep:.4g} mm"
        if limit.value > most:
            remedy = f"at most {shown}, {what}, or evolution.allow_deep = true"
            raise _refusal(scenario, limit, "is beyond the validity of the contact models", remedy)
    draws = draw(scenario)
    forecast = WearForecast(draws, assemble_problem(draws, start_of_run(scenario, draws))[0])
    test, name = float(scenario.total_passes), limit.variable
    name = {"worn_volume": "volume", "descent": "clearance"}.get(name, name)
    fresh, end = forecast.at(1.0), forecast.at(test)
    if limit.quantity == "peak pressure":
        greatest = max(fresh[name], end[name])
        if limit.value > PRESSURE * greatest:
            text = f"is far above the pressures of the test, {greatest / 1e6:.4g} MPa at most"
            raise _refusal(scenario, limit, text, "a lower pressure")
        if limit.value <= fresh[name]:
            text = "is below the pressure of the unworn contact, where the test would end at once"
            raise _refusal(scenario, limit, text, f"above {fresh[name] / 1e6:.4g} MPa")
        if limit.value <= greatest:
            return []
        course = f"{fresh[name] / 1e6:.3g} MPa at the start and about {end[name] / 1e6:.3g} MPa"
        return [f"until: {limit.text} may never be reached, with {course} at the end of the test"]
    if end.get(name, 0.0) <= 0.0:
        return []  # nothing is worn, which the run states
    times = 1.0
    while forecast.at(times * test)[name] < limit.value:
        times *= 2.0
        if times > 2.0**EXTENSIONS:
            last = written_value(limit, end[name])
            text = f"is not reached in {2**EXTENSIONS} times the test, whose end has about {last}"
            raise _refusal(scenario, limit, text, "a lower limit, or a longer test")
    if times <= LONGER:
        return []
    last = written_value(limit, float(f"{end[name]:.2g}"))
    return [f"until: {limit.text} would take about {times:g} times the test, which ends at {last}"]


def _refusal(scenario: Scenario, limit: Limit, what: str, expected: str) -> ScenarioError:
    mistake = Mistake("", "the limit of the run (until)", what, limit.text, expected)
    return ScenarioError(scenario.file, [mistake])
