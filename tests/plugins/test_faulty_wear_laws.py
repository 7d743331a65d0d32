"""Errors of wear laws of plugins that return invalid values."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from plugin_examples import Point, module, rig

import wearsim
from wearsim.errors import PluginError, SolverError, WearsimError
from wearsim.models.wear import ArchardDissipation
from wearsim.plugins import Options, WearLaw, WearLawSpec
from wearsim.scenario import Scenario

PER_DISSIPATION = 4e-12  # m/(W/m)
PER_PASS = {"evolution.stepper": "per-pass", "operation.duration": "1 s"}
Fault = Callable[[Any], Any]

#: faults of the depth by their description, with the error
DEPTHS: dict[str, tuple[Fault, type[WearsimError], str]] = {
    "None": (lambda depth: None, PluginError, r"None as depth_per_pass of the cylinder, expected"),
    "number": (lambda depth: 1e-9, PluginError, r"1e-09 as depth_per_pass .*, expected an array"),
    "strips": (lambda depth: depth[1:], PluginError, r"an array of the shape \(\d+,\) and type fl"),
    "texts": (lambda depth: depth.astype(str), PluginError, r"an array of the shape .* type <U"),
    "nan": (
        lambda depth: np.where(depth > 0.0, np.nan, 0.0),
        SolverError,
        "values of depth_per_pass of the cylinder that are not finite",
    ),
    "negative": (
        lambda depth: -depth,
        SolverError,
        r"negative values of depth_per_pass of the cylinder, down to -\d.* m; correct the plugin",
    ),
}
#: faults of the factor of a linear law
FACTORS: dict[str, tuple[Any, type[WearsimError], str]] = {
    "array": (np.ones(3), PluginError, r"an array of the shape \(3,\) .*, expected a number;"),
    "text": ("4e-12", PluginError, "a str as depth_per_dissipation of the cylinder, expected a"),
    "nan": (np.nan, SolverError, "values of depth_per_dissipation of the cylinder that are not"),
    "negative": (
        -4e-12,
        SolverError,
        r"negative values of depth_per_dissipation .*, down to -4e-12 m\^2/W",
    ),
}


@pytest.fixture
def faulty(install: Callable[..., None]) -> Callable[..., Scenario]:
    """Return a function that returns a test with a law that has a fault from a call on."""

    def scenario(
        fault: Fault, from_call: int = 0, factor: Any = None, **overrides: object
    ) -> Scenario:
        calls = iter(range(10**6))

        class Law(WearLaw):
            def __init__(self, options: Options) -> None:
                pass

            def depth_per_pass(self, body: Any, solution: Any, rolling_speed: float) -> Any:
                depth = PER_DISSIPATION * solution.dissipation
                return fault(depth) if next(calls) >= from_call else depth

            def depth_per_dissipation(self, body: Any, rolling_speed: float) -> Any:
                return factor

        spec = WearLawSpec("faulty", Options, "a law with a fault", factory=Law, protocol=2)
        install(Point(module(wearsim_wear_laws=lambda: [spec])))
        changes = {name.replace("__", "."): value for name, value in overrides.items()}
        return rig(changes, wear='law = "faulty"', contact='strips = 41\nwidth = "6 mm"')

    return scenario


RETURNED = r"wear law 'faulty' of wearsim-made-up 0\.1 returned "


@pytest.mark.parametrize(("fault", "kind", "message"), DEPTHS.values(), ids=DEPTHS)
def test_fault_of_the_depth_is_named_with_law_and_plugin(faulty, fault, kind, message):
    with pytest.raises(kind, match=RETURNED + message) as caught:
        wearsim.run(faulty(fault))
    assert type(caught.value) is kind


@pytest.mark.parametrize("stepper", ["implicit", "stabilised", "explicit", "per-pass"])
def test_fault_during_a_run_is_named_and_kept_in_its_file(faulty, stepper, tmp_path):
    depth = faulty(DEPTHS["nan"][0], 60, evolution__stepper=stepper, operation__duration="5 s")
    with pytest.raises(SolverError, match=RETURNED):
        wearsim.run(depth, tmp_path / "rig.h5")
    stored = wearsim.open_results(tmp_path / "rig.h5")
    assert not stored.finished
    assert "wear law 'faulty'" in stored.raw.failure


@pytest.mark.parametrize(("factor", "kind", "message"), FACTORS.values(), ids=FACTORS)
def test_fault_of_a_linear_factor_is_named(faulty, factor, kind, message):
    with pytest.raises(kind, match=RETURNED + message):
        wearsim.run(faulty(lambda depth: depth, factor=factor))


def test_error_has_the_contact_that_led_to_it(faulty):
    with pytest.raises(SolverError) as caught:
        wearsim.run(faulty(DEPTHS["negative"][0]))
    state = caught.value.state
    assert state["depth_per_pass"].shape == state["dissipation"].shape
    assert state["depth_per_pass"].min() == -PER_DISSIPATION * state["dissipation"].max()
    assert state["rolling_speed"] > 0.0


def test_rounding_below_zero_is_no_fault(faulty):
    def rounded(depth: Any) -> Any:
        return np.where(depth > 0.0, depth, -1e-12 * depth.max())

    assert wearsim.run(faulty(rounded)).finished


def test_factory_without_a_law_is_named(install):
    spec = WearLawSpec("faulty", Options, "no law", factory=lambda options: None, protocol=2)
    install(Point(module(wearsim_wear_laws=lambda: [spec])))
    with pytest.raises(PluginError, match="the factory of wear law 'faulty' returned None"):
        wearsim.run(rig(wear='law = "faulty"'))


def test_laws_of_wearsim_are_not_checked():
    assert type(rig().wear.built) is ArchardDissipation
