"""Errors of fatigue laws, motion laws and axial profiles of plugins that return invalid values."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from plugin_examples import Point, module, rig

import wearsim
from wearsim.errors import PluginError, SolverError, WearsimError
from wearsim.plugins import (
    AxialProfile,
    AxialProfileSpec,
    FatigueLaw,
    FatigueLawSpec,
    MotionLaw,
    MotionLawSpec,
    Options,
    WearLaw,
    WearLawSpec,
)
from wearsim.scenario.examples import shipped_scenario

NAN = math.nan
Fault = tuple[Any, type[WearsimError], str]


def message(kind: str, text: str) -> str:
    """Return the pattern of a message: plugin, quantity and remedy."""
    tests = f"{kind.replace(' ', '_')}_tests"
    return (
        f"{kind} 'faulty' of wearsim-made-up 0.1 returned {text}.*; correct the plugin, which"
        f" {tests} of wearsim.testing checks"
    )


DAMAGES: dict[str, Fault] = {
    "None": (lambda p: None, PluginError, "None as damage_per_pass, expected an array"),
    "number": (lambda p: 1e-7, PluginError, "1e-07 as damage_per_pass, expected an array"),
    "shape": (lambda p: p[..., 1:], PluginError, "an array of the shape .* as damage_per_pass"),
    "nan": (lambda p: NAN * p, SolverError, "values of damage_per_pass that are not finite"),
    "infinite": (lambda p: math.inf * (p + 1.0), SolverError, "values of damage_per_pass that are"),
    "negative": (lambda p: -1e-20 * p, SolverError, "negative values of damage_per_pass, down to"),
}


@pytest.mark.parametrize(("damage", "kind", "text"), DAMAGES.values(), ids=DAMAGES)
def test_fault_of_a_fatigue_law_is_named(install, damage, kind, text):
    class Law(FatigueLaw):
        def __init__(self, options: Options, contact_modulus: float) -> None:
            pass

        def damage_per_pass(self, pressure: Any) -> Any:
            return damage(pressure)

    spec = FatigueLawSpec("faulty", Options, "a law", factory=Law, protocol=2)
    install(Point(module(wearsim_fatigue_laws=lambda: [spec])))
    fatigue = 'slope = 1.1\ncylinder = {law = "faulty", source = "none"}'
    with pytest.raises(kind, match=message("fatigue law", text)) as caught:
        wearsim.run(rig(fatigue=fatigue))
    assert kind is PluginError or (caught.value.state["pressure"] >= 0.0).all()


class Cycloid(MotionLaw):
    """A cycloidal rise."""

    def __init__(self, options: Options, angle: float, rise: float, unit: str) -> None:
        self.angle, self.rise = angle, rise

    def lift(self, angle: Any) -> Any:
        x = math.tau / self.angle
        turned = x * angle
        lift = [angle / self.angle - np.sin(turned) / math.tau, (1.0 - np.cos(turned)) / self.angle]
        return self.rise * np.stack([*lift, np.sin(turned) * x / self.angle])


def cam(install: Callable[..., None], faults: dict[str, Any], law: str = "faulty") -> Any:
    """Return the study of a cam whose motion law has faults."""
    faulty = type("Faulty", (Cycloid,), faults)
    spec = MotionLawSpec("faulty", Options, "a law", factory=faulty, protocol=2)
    install(Point(module(wearsim_motion_laws=lambda: [spec])))
    motion = [
        {"law": "dwell", "angle": "180 deg"},
        {"law": law, "angle": "90 deg", "rise": "8 mm"},
        {"law": "cycloidal", "angle": "90 deg", "rise": "-8 mm"},
    ]
    return wearsim.study_cam(shipped_scenario("cam-cycloidal", {"cam.motion": motion}))


LIFTS: dict[str, Fault] = {
    "None": ({"lift": lambda s, t: None}, PluginError, "None as lift, expected an array"),
    "shape": (
        {"lift": lambda s, t: np.zeros((2, len(t)))},
        PluginError,
        r"an array of the shape \(2, 2\) .* as lift, expected an array of the shape \(3, 2\)",
    ),
    "nan": (
        {"lift": lambda s, t: np.full((3, len(t)), NAN)},
        SolverError,
        "values of lift that are not finite",
    ),
    "breaks beyond the segment": ({"breaks": (3.0,)}, PluginError, r"a tuple as breaks \(3.0,\)"),
    "breaks not in order": ({"breaks": (1.0, 0.5)}, PluginError, "a tuple as breaks"),
    "breaks nan": ({"breaks": (NAN,)}, PluginError, r"a tuple as breaks \(nan,\)"),
    "no breaks": ({"breaks": None}, PluginError, "None as breaks"),
}


@pytest.mark.parametrize(("faults", "kind", "text"), LIFTS.values(), ids=LIFTS)
def test_fault_of_a_motion_law_is_named(install, faults, kind, text):
    with pytest.raises(kind, match=message("motion law", text)):
        cam(install, faults)


def test_valid_motion_law_gives_the_same_as_that_of_wearsim(install):
    found, expected = (cam(install, {}, law).peak_pressure for law in ("faulty", "cycloidal"))
    assert found == pytest.approx(expected, rel=1e-9)


DROPS: dict[str, Fault] = {
    "None": ({"drop": lambda s, y: None}, PluginError, "None as drop, expected an array"),
    "shape": ({"drop": lambda s, y: y[1:]}, PluginError, "an array of the shape .* as drop"),
    "nan": ({"drop": lambda s, y: NAN * y}, SolverError, "values of drop that are not finite"),
    "length": ({"length": NAN}, SolverError, "values of length that are not finite"),
    "crown": ({"crown_radius": "1 m"}, PluginError, "a str as crown_radius, expected a number"),
}


@pytest.mark.parametrize(("faults", "kind", "text"), DROPS.values(), ids=DROPS)
def test_fault_of_an_axial_profile_is_named(install, faults, kind, text):
    class Form(AxialProfile):
        length = 0.01

        def __init__(self, options: Options, pair: Any) -> None:
            pass

        def drop(self, s: Any) -> Any:
            return s * s

    faulty = type("Faulty", (Form,), faults)
    spec = AxialProfileSpec("faulty", Options, "a form", factory=faulty, protocol=2)
    install(Point(module(wearsim_axial_profiles=lambda: [spec])))
    with pytest.raises(kind, match=message("axial profile", text)):
        wearsim.run(rig({"roller.axial_profile": {"form": "faulty"}}))


class Abstract(WearLaw):
    """A law that lacks its method."""

    def __init__(self, options: Options) -> None:
        pass


def one_argument(self: Any, solution: Any) -> Any:
    return solution.dissipation


SIGNATURES = {
    "method": (
        type("Law", (Abstract,), {"depth_per_pass": one_argument}),
        r"faulty' takes \(solution\), expected \(body, solution, rolling_speed\)",
    ),
    "abstract": (Abstract, r"factory of wear law 'faulty' cannot be called: .*depth_per_pass"),
    "factory": (lambda: None, r"factory of wear law 'faulty' cannot be called: .*1 was given"),
}


@pytest.mark.parametrize(("factory", "text"), SIGNATURES.values(), ids=SIGNATURES)
def test_method_or_factory_with_other_arguments_is_named(install, factory, text):
    spec = WearLawSpec("faulty", Options, "a law", factory=factory, protocol=2)
    install(Point(module(wearsim_wear_laws=lambda: [spec])))
    with pytest.raises(PluginError, match=text):
        wearsim.run(rig(wear='law = "faulty"'))
