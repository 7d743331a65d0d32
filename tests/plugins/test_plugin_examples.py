"""The docstring of each hook has an example that runs unchanged."""

from __future__ import annotations

import importlib
import inspect
import sys
import textwrap
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from plugin_examples import HOOKS, Point, rig

import wearsim
from wearsim.errors import ScenarioError
from wearsim.plugins import (
    AxialProfileSpec,
    FatigueLawSpec,
    LoadSpec,
    MotionLawSpec,
    RandomInputSpec,
    StudyKind,
    WearLawSpec,
    registry,
)
from wearsim.plugins.hooks import HookSpecs
from wearsim.results.viewed import study_kinds
from wearsim.testing import random_inputs
from wearsim.testing.axial_profiles import AXIAL_PROFILE, AxialProfileFixture
from wearsim.testing.checks import ConfiguredSpec
from wearsim.testing.fatigue_laws import FATIGUE_LAW, FatigueLawFixture
from wearsim.testing.motion_laws import MOTION_LAW, MotionLawFixture
from wearsim.testing.random_inputs import RandomInputFixture
from wearsim.testing.wear_and_loads import LOADS, WEAR_LAW, LoadFixture, WearLawFixture


def example_of(hook: str) -> str:
    """Return the example code of a hook's docstring."""
    text = inspect.getdoc(getattr(HookSpecs, hook)) or ""
    marker = ".. code-block:: python\n"
    assert marker in text, f"{hook} shows no example"
    return textwrap.dedent(text.split(marker, 1)[1])


@pytest.fixture
def example(install, monkeypatch, request):
    """Install the example of a hook."""

    def example(hook: str) -> ModuleType:
        made = ModuleType(f"my_{hook}")
        monkeypatch.setitem(sys.modules, made.__name__, made)
        exec(compile(example_of(hook), hook, "exec", dont_inherit=True), vars(made))
        install(Point(lambda: made, distribution="my-package"))
        return made

    return example


def test_every_hook_is_listed_in_these_tests():
    specified = {name for name in vars(HookSpecs) if name.startswith("wearsim_")}
    assert specified == set(HOOKS)


@pytest.mark.parametrize("hook", HOOKS)
def test_every_hook_is_documented(hook):
    text = inspect.getdoc(getattr(HookSpecs, hook)) or ""
    assert text[0].isupper()
    assert "Returns\n-------\n" in text
    assert f"@hookimpl\ndef {hook}():" in example_of(hook)


@pytest.mark.parametrize("hook", HOOKS)
def test_every_hook_is_tested(hook):
    used = f'example("{hook}")'
    assert used in Path(__file__).read_text(), f"no test here runs the example of {hook}"


def test_example_of_a_contact_model_runs(example, monkeypatch):
    package, own = ModuleType("my_package"), ModuleType("my_package.foundation")
    monkeypatch.syspath_prepend(Path(__file__).parent / "data" / "tiny")
    own.Foundation = importlib.import_module("wearsim_tiny").Foundation
    monkeypatch.setitem(sys.modules, "my_package", package)
    monkeypatch.setitem(sys.modules, "my_package.foundation", own)
    example("wearsim_contact_models")
    result = wearsim.run(
        rig(contact='model = "foundation"\nfoundation_modulus = 4e13\nwidth = "8 mm"\nstrips = 81')
    )
    assert result.stepper == "stabilised"
    assert result.finished
    assert result.depth[-1] > 0.0


@pytest.mark.parametrize("stepper", ["implicit", "stabilised", "explicit", "per-pass"])
def test_example_of_a_wear_law_runs(example, stepper):
    example("wearsim_wear_laws")
    scenario = rig(
        {"evolution.stepper": stepper, "operation.duration": "6 s"},
        wear='law = "constant-depth"\ndepth = 1e-11',
    )
    assert registry().registered(WearLawSpec, "constant-depth").distribution == "my-package"
    result = wearsim.run(scenario)
    # 300 passes wear the cylinder; the depth of each roller is 25/20/3 of that
    assert result.depth[-1] == pytest.approx(300 * 1e-11, rel=1e-9)
    assert result.roller_depth[-1] == pytest.approx(300 * 1e-11 * 25 / 20 / 3, rel=1e-9)


@pytest.mark.parametrize("stepper", ["implicit", "stabilised", "explicit", "per-pass"])
def test_example_of_a_load_runs(example, stepper):
    example("wearsim_loads")
    scenario = rig({"evolution.stepper": stepper}, load='kind = "ramp"\nstart = 200.0\nslope = 0.5')
    assert registry().registered(LoadSpec, "ramp").distribution == "my-package"
    result = wearsim.run(scenario)
    assert result.normal_force[0] == pytest.approx(200.0, rel=1e-3)
    assert result.normal_force[-1] == pytest.approx(200.0 + 0.5 * 120.0, rel=5e-3)


@pytest.mark.parametrize("place", [0, 30])
def test_rarely_differing_load_option_changes_the_contact(example, place):
    example("wearsim_loads")
    starts = ["200"] * 30
    starts.insert(place, "199" if place == 0 else "201")
    read = {"starts.csv": "\n".join(["value", *starts])}.__getitem__
    start = '{ distribution = "table", file = "starts.csv" }'
    scenario = rig(load=f'kind = "ramp"\nstart = {start}\nslope = 0.5', read=read)
    with pytest.raises(ScenarioError, match=r"\[load\] start: changes the load of the contact"):
        wearsim.dissipation(scenario, 2)


@pytest.mark.parametrize(
    ("hook", "kind", "name", "checks", "fixture"),
    [
        ("wearsim_wear_laws", WearLawSpec, "constant-depth", WEAR_LAW, WearLawFixture),
        ("wearsim_loads", LoadSpec, "ramp", LOADS["base"], LoadFixture),
    ],
)
def test_examples_pass_the_checks(example, hook, kind, name, checks, fixture):
    example(hook)
    chosen = ConfiguredSpec(registry().get(kind, name))
    for check in checks.values():
        check(fixture(chosen))


def test_example_of_a_random_input_runs(example):
    example("wearsim_random_inputs")
    spec = registry().get(RandomInputSpec, "flat")
    fixture = RandomInputFixture(ConfiguredSpec(spec, {"low": 2.0, "high": 4.0}))
    for check in random_inputs.BY_ROLE["scalar"].values():
        check(fixture)
    flat = fixture.instance
    assert flat.quantile(np.array([0.25, 0.5])) == pytest.approx([2.5, 3.0])
    assert (*flat.support, flat.mean) == pytest.approx((2.0, 4.0, 3.0))
    assert flat.std == pytest.approx(1.0 / np.sqrt(3.0), rel=1e-6)


def test_example_of_a_motion_law_runs(example):
    example("wearsim_motion_laws")
    fixture = MotionLawFixture(ConfiguredSpec(registry().get(MotionLawSpec, "cosine")))
    for check in MOTION_LAW.values():
        check(fixture)


def test_example_of_a_fatigue_law_passes_the_checks(example):
    example("wearsim_fatigue_laws")
    fixture = FatigueLawFixture(ConfiguredSpec(registry().get(FatigueLawSpec, "ninth-power")))
    for check in FATIGUE_LAW.values():
        check(fixture)


def test_example_of_an_axial_profile_runs(example):
    example("wearsim_axial_profiles")
    options = {"length": "8 mm", "drop": "20 um"}
    spec = registry().get(AxialProfileSpec, "quartic")
    fixture = AxialProfileFixture(ConfiguredSpec(spec, options))
    for check in AXIAL_PROFILE.values():
        check(fixture)
    form = {"form": "quartic", **options}
    scenario = rig({"roller.axial_profile": form, "contact.strips": 61})
    assert scenario.roller.width == 8e-3
    assert wearsim.solve_contact(scenario).peak_pressure > 0.0


def test_example_of_a_study_kind_is_found_by_its_format(example):
    example("wearsim_study_kinds")
    (kind,) = [kind for kind in study_kinds() if kind.format == "my-package-survey"]
    assert registry().registered(StudyKind, kind.name).distribution == "my-package"


def test_example_of_a_table_is_read_with_the_scenario(example):
    example("wearsim_tables")
    assert rig(survey='spacing = "2 mm"').tables["survey"].spacing == 2e-3
    with pytest.raises(ScenarioError, match=r"\[survey\] spacing"):
        rig(survey='spacing = "2 N"')
