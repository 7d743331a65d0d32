"""Errors of random inputs of plugins that return invalid values."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from plugin_examples import Point, module, rig

import wearsim
from wearsim.errors import PluginError, ScenarioError, SolverError, WearsimError
from wearsim.plugins import (
    Distribution,
    FrictionField,
    JointDistribution,
    Options,
    Process,
    RandomInputSpec,
)
from wearsim.scenario import Scenario

NAN = math.nan
RETURNED = r"random input 'faulty' of wearsim-made-up 0\.1 returned "
REMEDY = ".*; correct the plugin, which random_input_tests of wearsim.testing checks"
MARGINAL = {"distribution": "uniform", "low": 0.08, "high": 0.12}
Fault = tuple[dict[str, Any], type[WearsimError], str]


class Flat(Distribution):
    """Uniform between 280 and 320 N."""

    def __init__(self, options: Options) -> None:
        pass

    def quantile(self, probability: Any) -> Any:
        return 280.0 + 40.0 * np.asarray(probability)


class Angles(JointDistribution):
    """Independent yaw and tilt within 0.1 mrad."""

    components = ("yaw", "tilt")
    dimension = 2
    mean = (0.0, 0.0)
    reach = (1e-4, 1e-4)

    def __init__(self, options: Options) -> None:
        pass

    def values(self, uniform: Any) -> Any:
        return 1e-4 * (2.0 * uniform - 1.0)


class Strips(FrictionField):
    """Independent friction of every strip."""

    def __init__(self, options: Options, marginal: Distribution) -> None:
        self.marginal = marginal

    def values(self, x: Any, y: Any, uniforms: Any) -> Any:
        return np.broadcast_to(self.marginal.quantile(uniforms(0, len(y))), x.shape)


class Steps(Process):
    """Independent values every 10 s."""

    spacing = 10.0

    def __init__(self, options: Options, marginal: Distribution) -> None:
        self.marginal = marginal

    def path(self, points: int, uniforms: Any) -> Any:
        return self.marginal.quantile(uniforms(0, points))


def scenario(install: Callable[..., None], base: type[Any], faults: dict[str, Any]) -> Scenario:
    """Return a test with a random input that has some faulty methods or attributes."""
    roles = {Flat: "scalar", Angles: "joint", Strips: "field", Steps: "process"}
    role: Any = roles[base]
    faulty = type("Faulty", (base,), faults)
    spec = RandomInputSpec("faulty", Options, "made up", factory=faulty, role=role, protocol=2)
    install(Point(module(wearsim_random_inputs=lambda: [spec])))
    table: dict[str, Any] = {"distribution": "faulty"}
    key = {Flat: "load.normal_force", Angles: "creepage.misalignment"}.get(base)
    if key is None:
        key = "friction.coefficient"
        table["marginal"] = MARGINAL
    return rig({key: table}, contact='strips = 41\nwidth = "6 mm"')


def study(install: Callable[..., None], base: type[Any], faults: dict[str, Any]) -> Any:
    """Return a drawn test, or draws of the contact where the friction is a field."""
    found = scenario(install, base, faults)
    assert found.random[0].describe().startswith("faulty")
    return wearsim.dissipation(found, 4) if base is Strips else wearsim.run(found)


QUANTILES: dict[str, Fault] = {
    "None": ({"quantile": lambda s, p: None}, PluginError, "None as quantile, expected an array"),
    "number": ({"quantile": lambda s, p: 300.0}, PluginError, "300.0 as quantile, expected an arr"),
    "list": ({"quantile": lambda s, p: [300.0] * 2}, PluginError, "a list as quantile"),
    "shape": (
        {"quantile": lambda s, p: np.ones((len(p), 1))},
        PluginError,
        r"an array of the shape \(2, 1\) and type float64 as quantile, expected an array .* \(2,\)",
    ),
    "text": (
        {"quantile": lambda s, p: np.full(np.shape(p), "300 N")},
        PluginError,
        "an array of the shape .* and type <U5 as quantile",
    ),
    "nan": (
        {"quantile": lambda s, p: NAN * np.asarray(p)},
        SolverError,
        "values of quantile that are not finite",
    ),
    "infinite inside": (
        {"quantile": lambda s, p: np.full(np.shape(p), math.inf)},
        SolverError,
        "values of quantile that are not finite",
    ),
    "falling": (
        {"quantile": lambda s, p: 320.0 - 40.0 * np.asarray(p)},
        PluginError,
        r"an array .* as quantiles \[320. 280.\], expected values that do not fall",
    ),
    "no mean": ({"mean": None}, PluginError, "None as mean, expected a number"),
    "negative std": ({"std": -1.0}, SolverError, "negative values of std, down to -1"),
    "one end": ({"support": 280.0}, PluginError, "280.0 as support, expected a tuple of two"),
    "ends that fall": ({"support": (320.0, 280.0)}, PluginError, "a tuple as support, expected"),
}


@pytest.mark.parametrize(("faults", "kind", "text"), QUANTILES.values(), ids=QUANTILES)
def test_fault_of_a_distribution_is_named(install, faults, kind, text):
    with pytest.raises(kind, match=RETURNED + text + REMEDY):
        study(install, Flat, faults)


def test_fault_of_a_marginal_or_a_component_is_named(install):
    faulty = type("Faulty", (Flat,), {"quantile": lambda s, p: None})
    spec = RandomInputSpec("faulty", Options, "made up", factory=faulty, protocol=2)
    install(Point(module(wearsim_random_inputs=lambda: [spec])))
    inner = {"distribution": "faulty"}
    for table in (
        {"distribution": "ornstein-uhlenbeck", "correlation_time": "1 min", "marginal": inner},
        {"distribution": "mixture", "weights": [0.5, 0.5], "of": [inner, inner]},
    ):
        with pytest.raises(PluginError, match=RETURNED + "None as quantile"):
            rig({"load.normal_force": table})


JOINT: dict[str, Fault] = {
    "None": ({"values": lambda s, u: None}, PluginError, "None as values, expected an array"),
    "transposed": (
        {"values": lambda s, u: np.zeros((2, len(u) + 1))},
        PluginError,
        "an array of the shape .* as values, expected an array of the shape",
    ),
    "nan": ({"values": lambda s, u: NAN * u}, SolverError, "values of values that are not finite"),
    "dimension": ({"dimension": 0}, PluginError, "0 as dimension, expected a whole number"),
    "components": ({"components": "yaw"}, PluginError, "a str as components, expected a tuple"),
    "one mean": ({"mean": (0.0,)}, PluginError, "a tuple as mean, expected a tuple of 2 numbers"),
    "no reach": ({"reach": None}, PluginError, "None as reach, expected a tuple of 2 numbers"),
}


@pytest.mark.parametrize(("faults", "kind", "text"), JOINT.values(), ids=JOINT)
def test_fault_of_a_joint_distribution_is_named(install, faults, kind, text):
    with pytest.raises(kind, match=RETURNED + text + REMEDY):
        study(install, Angles, faults)


FIELDS: dict[str, Fault] = {
    "None": ({"values": lambda s, x, y, u: None}, PluginError, "None as values, expected an array"),
    "shape": ({"values": lambda s, x, y, u: 0.1 * y}, PluginError, "an array of the shape .* as v"),
    "nan": (
        {"values": lambda s, x, y, u: NAN * x},
        SolverError,
        "values of values that are not finite",
    ),
    "frame": ({"frame": "track"}, PluginError, "a str as frame 'track', expected contact, cyl"),
    "unresolved": (
        {"unresolved": lambda s, along, across: False},
        PluginError,
        "False as unresolved, expected a text or None",
    ),
}


@pytest.mark.parametrize(("faults", "kind", "text"), FIELDS.values(), ids=FIELDS)
def test_fault_of_a_friction_field_is_named(install, faults, kind, text):
    with pytest.raises(kind, match=RETURNED + text + REMEDY):
        study(install, Strips, faults)


PATHS: dict[str, Fault] = {
    "None": ({"path": lambda s, n, u: None}, PluginError, "None as path, expected an array"),
    "one point": (
        {"path": lambda s, n, u: np.ones(1)},
        PluginError,
        r"an array of .* \(1,\) .* as path",
    ),
    "nan": ({"path": lambda s, n, u: np.full(n, NAN)}, SolverError, "values of path that are not"),
    "no spacing": ({"spacing": None}, PluginError, "None as spacing, expected a number"),
    "zero": ({"spacing": 0.0}, PluginError, "0.0 as spacing, expected a time above 0 s"),
    "warnings": ({"warnings": "beware"}, PluginError, "a str as warnings, expected a tuple"),
}


@pytest.mark.parametrize(("faults", "kind", "text"), PATHS.values(), ids=PATHS)
def test_fault_of_a_process_is_named(install, faults, kind, text):
    with pytest.raises(kind, match=RETURNED + text + REMEDY):
        study(install, Steps, faults)


def test_process_without_its_marginal_is_named(install):
    faulty = type("Faulty", (Steps,), {"__init__": lambda s, options, marginal: None})
    spec = RandomInputSpec("faulty", Options, "made up", factory=faulty, role="process", protocol=2)
    install(Point(module(wearsim_random_inputs=lambda: [spec])))
    with pytest.raises(PluginError, match=RETURNED + "None as marginal, expected the Distr"):
        rig({"friction.coefficient": {"distribution": "faulty", "marginal": MARGINAL}})


def test_factory_of_another_role_is_named(install):
    spec = RandomInputSpec("faulty", Options, "made up", factory=Angles, protocol=2)
    install(Point(module(wearsim_random_inputs=lambda: [spec])))
    with pytest.raises(PluginError, match="'faulty' returned a Angles, expected a Distribution"):
        rig({"load.normal_force": {"distribution": "faulty"}})


def test_infinite_mean_is_a_mistake_of_the_scenario(install):
    with pytest.raises(ScenarioError, match="has no finite mean"):
        scenario(install, Flat, {"mean": math.inf, "support": (280.0, math.inf)})


@pytest.mark.parametrize("base", [Flat, Angles, Strips, Steps])
def test_valid_random_input_of_a_plugin_is_drawn(install, base):
    result = study(install, base, {})
    if base is Strips:
        assert len(set(result.values("power").tolist())) == 4
    else:
        assert result.depth[-1] > 0.0


def test_moments_of_a_distribution_are_integrated_over_checked_quantiles(install):
    (item,) = scenario(install, Flat, {}).random
    assert item.scalar.support == (280.0, 320.0)
    assert item.scalar.mean == pytest.approx(300.0, rel=1e-9)
    assert item.scalar.std == pytest.approx(40.0 / math.sqrt(12.0), rel=1e-4)
