"""Errors of loads of plugins that return invalid values."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from plugin_examples import Point, module, rig

import wearsim
from wearsim.errors import PluginError, ScenarioError, SolverError, WearsimError
from wearsim.models.loads import ConstantLoad
from wearsim.plugins import Load, LoadSpec, LoadTerm, Options
from wearsim.scenario import Scenario

RETURNED = r"load 'faulty' of wearsim-made-up 0\.1 returned "
REMEDY = ".*; correct the plugin, which load_tests of wearsim.testing checks"
NAN = math.nan


class Wave(Load):
    """300 N with a wave of 20 N."""

    def __init__(self, options: Options) -> None:
        pass

    def force(self, time: Any) -> Any:
        return 300.0 + 20.0 * np.sin(time)

    def mean(self, start: float, stop: float) -> Any:
        return 300.0 - 20.0 * (math.cos(stop) - math.cos(start)) / (stop - start)

    def extremes(self, start: float, stop: float) -> Any:
        return 280.0, 320.0

    def deviation(self, start: float, stop: float) -> Any:
        return 14.0


class Follower(LoadTerm):
    """A term of 1 N."""

    def __init__(self, options: Options) -> None:
        pass

    def advance(self, state: Any, power: Any, duration: float) -> Any:
        return 0.0 * state + 1.0

    def mean_force(self, state: Any, power: Any, duration: float) -> Any:
        return 0.0 * state + 1.0


def scenario(
    install: Callable[..., None], base: type[Any], overrides: dict[str, Any], faults: dict[str, Any]
) -> Scenario:
    """Return a test with a load or a term, some of whose methods and attributes are replaced."""
    role: Any = "term" if issubclass(base, LoadTerm) else "base"
    faulty = type("Faulty", (base,), faults)
    spec = LoadSpec("faulty", Options, "a load", factory=faulty, role=role, protocol=2)
    install(Point(module(wearsim_loads=lambda: [spec])))
    load = 'normal_force = "300 N"\n[load.faulty]' if role == "term" else 'kind = "faulty"'
    return rig(overrides, load=load, contact='strips = 41\nwidth = "6 mm"')


#: faults of a load by their description, with the error
LOADS: dict[str, tuple[dict[str, Any], type[WearsimError], str]] = {
    "no force": ({"force": lambda s, t: None}, PluginError, r"None as force, expected an array"),
    "one force": ({"force": lambda s, t: 300.0}, PluginError, r"300\.0 as force, expected an arr"),
    "force of another shape": (
        {"force": lambda s, t: np.full(len(t) + 1, 300.0)},
        PluginError,
        r"an array of the shape \(2,\) .* as force, expected an array of the shape \(1,\)",
    ),
    "force nan": ({"force": lambda s, t: NAN * t}, SolverError, "values of force that are not"),
    "no mean": ({"mean": lambda s, a, b: None}, PluginError, "None as mean, expected a number"),
    "mean nan": ({"mean": lambda s, a, b: NAN}, SolverError, "values of mean that are not finite"),
    "mean of an array": (
        {"mean": lambda s, a, b: np.array([300.0])},
        PluginError,
        r"an array of the shape \(1,\) .* as mean, expected a number",
    ),
    "deviation nan": ({"deviation": lambda s, a, b: NAN}, SolverError, "values of deviation th"),
    "negative deviation": (
        {"deviation": lambda s, a, b: -1.0},
        SolverError,
        "negative values of deviation, down to -1 N",
    ),
    "extremes nan": ({"extremes": lambda s, a, b: (NAN, 3.0)}, SolverError, "values of extremes"),
    "three extremes": (
        {"extremes": lambda s, a, b: (1.0, 2.0, 3.0)},
        PluginError,
        "a tuple as extremes, expected a tuple of two numbers",
    ),
    "stiffness nan": ({"stiffness": NAN}, SolverError, "values of stiffness that are not finite"),
    "stiffness of a text": ({"stiffness": "1"}, PluginError, "a str as stiffness, expected a num"),
    "pauses": (
        {"pauses": np.zeros(3)},
        PluginError,
        r"an array of the shape \(3,\) .* as pauses, expected an array of the shape \(3, 2\)",
    ),
    "no gaps": ({"gaps": None}, PluginError, r"None as gaps, .* of the shape \(0, 2\)"),
    "span": ({"span": (0.0, NAN)}, SolverError, "values of span that are not finite"),
}


@pytest.mark.parametrize(("faults", "kind", "message"), LOADS.values(), ids=LOADS)
def test_fault_of_a_load_is_named_with_load_and_plugin(install, faults, kind, message):
    with pytest.raises(kind, match=RETURNED + message + REMEDY) as caught:
        wearsim.run(scenario(install, Wave, {}, faults))
    assert type(caught.value) is kind


def test_error_has_the_time_that_led_to_it(install):
    with pytest.raises(SolverError) as caught:
        wearsim.run(scenario(install, Wave, {}, {"mean": lambda s, a, b: NAN}))
    assert caught.value.state["start"] == 0.0 < caught.value.state["stop"]


def test_fault_of_sampled_extremes_is_that_of_the_force(install):
    faults = {"extremes": Load.extremes, "force": lambda s, t: None}
    with pytest.raises(PluginError, match="None as force"):
        wearsim.run(scenario(install, Wave, {}, faults))


def test_negative_load_is_a_mistake_of_the_scenario(install):
    faults = {"extremes": Load.extremes, "force": lambda s, t: 300.0 - 10.0 * t}
    with pytest.raises(ScenarioError, match=r"\[load\].*falls to zero or below.* -900 N at 2 min"):
        wearsim.run(scenario(install, Wave, {}, faults))


TERMS: dict[str, tuple[dict[str, Any], type[WearsimError], str]] = {
    "advance": ({"advance": lambda s, f, p, d: None}, PluginError, "None as advance, expected an"),
    "advance nan": ({"advance": lambda s, f, p, d: NAN * f}, SolverError, "values of advance th"),
    "mean": ({"mean_force": lambda s, f, p, d: 3.0}, PluginError, r"3\.0 as mean_force, expected"),
    "mean nan": ({"mean_force": lambda s, f, p, d: NAN * f}, SolverError, "values of mean_force"),
    "lag": ({"lag": lambda s: 3.0}, PluginError, r"3\.0 as lag, expected a tuple of two numbers"),
    "lag nan": ({"lag": lambda s: (NAN, 1.0)}, SolverError, "values of lag that are not finite"),
}


@pytest.mark.parametrize(("faults", "kind", "message"), TERMS.values(), ids=TERMS)
def test_fault_of_a_term_is_named(install, faults, kind, message):
    stepper = "per-pass" if "lag" in faults else "stabilised"
    overrides = {"evolution.stepper": stepper, "operation.duration": "1 s"}
    with pytest.raises(kind, match=RETURNED + message + REMEDY):
        wearsim.run(scenario(install, Follower, overrides, faults))


@pytest.mark.parametrize("base", [Wave, Follower])
def test_valid_load_runs_to_the_end(install, base):
    assert wearsim.run(scenario(install, base, {"operation.duration": "1 s"}, {})).finished


@pytest.mark.parametrize("role", ["base", "term"])
def test_factory_without_a_load_is_named(install, role):
    spec = LoadSpec("faulty", Options, "no load", factory=lambda o: None, role=role, protocol=2)
    install(Point(module(wearsim_loads=lambda: [spec])))
    load = 'kind = "faulty"' if role == "base" else 'normal_force = "300 N"\n[load.faulty]'
    with pytest.raises(PluginError, match="the factory of load 'faulty' returned None, expected a"):
        wearsim.run(rig(load=load))


def test_loads_of_wearsim_are_not_checked():
    assert type(rig().load.built) is ConstantLoad
