"""The manager: what it finds, what it refuses, and whom it names."""

from __future__ import annotations

import sys

import pytest
from plugin_examples import HOOKS, TABLES, Point, load_named, module, rig

from wearsim.errors import PluginError, ScenarioError
from wearsim.plugins import (
    ContactModelSpec,
    LoadSpec,
    Options,
    RandomInputSpec,
    WearLawSpec,
    registry,
)
from wearsim.plugins.manager import Registry


def failing():
    raise ImportError("no module named 'sparse_magic'")


def test_that_builtins_come_through_the_hooks_of_anyone(install):
    install()
    found = registry()
    assert found.names(ContactModelSpec) == ["hertz", "hertz-fastsim", "semi-hertzian", "slender"]
    assert found.names(WearLawSpec) == ["archard-dissipation", "t-gamma"]
    assert found.names(LoadSpec) == ["constant", "recorded", "spring", "thermal"]
    assert {item.distribution for item in found.all()} == {"wearsim"}
    assert all(item.spec.summary for item in found.all())
    assert not found.broken


def test_that_every_kind_of_spec_is_found():
    def of(kind, **more):
        return lambda: [kind("new", Options, "new", factory=lambda options: None, **more)]

    kinds = dict(
        zip(HOOKS, (ContactModelSpec, WearLawSpec, LoadSpec, RandomInputSpec), strict=True)
    )
    found = Registry([Point(module(**{hook: of(kind) for hook, kind in kinds.items()}))])
    for kind in kinds.values():
        assert found.names(kind) == ["new"]
        item = found.registered(kind, "new")
        assert (item.distribution, item.version) == ("wearsim-made-up", "0.1")


def test_that_two_plugins_of_one_name_are_an_error_naming_both():
    hook = module(wearsim_loads=load_named("ramp"))
    points = [Point(hook, "a", "first-dist", "1.0"), Point(hook, "b", "second-dist", "2.0")]
    with pytest.raises(PluginError, match=r"'ramp': first-dist 1\.0 and second-dist 2\.0") as told:
        Registry(points)
    assert "uninstall one" in str(told.value)


def test_that_a_plugin_cannot_take_the_name_of_a_builtin(install):
    install(Point(module(wearsim_loads=load_named("constant")), distribution="impostor"))
    with pytest.raises(PluginError, match=r"wearsim 0.* and impostor|impostor 0.* and wearsim"):
        registry()


def test_that_one_name_may_stand_for_two_kinds():
    law = [WearLawSpec("ramp", Options, "a law", factory=lambda options: None)]
    loader = module(wearsim_loads=load_named("ramp"), wearsim_wear_laws=lambda: law)
    assert len(Registry([Point(loader)]).all()) == 2


def test_that_a_misspelt_hook_is_an_error():
    with pytest.raises(PluginError, match="wearsim_contact_model") as told:
        Registry([Point(module(wearsim_contact_model=lambda: ()))])
    assert "wearsim-made-up 0.1" in str(told.value)
    for hook in HOOKS:
        assert hook in str(told.value)


def test_that_a_hook_with_an_argument_nobody_gives_is_an_error():
    with pytest.raises(PluginError, match="colour"):
        Registry([Point(module(wearsim_loads=lambda colour: []))])


def test_that_a_hook_which_yields_the_wrong_spec_is_an_error():
    with pytest.raises(PluginError, match=r"wearsim_wear_laws yielded .* expected a WearLawSpec"):
        Registry([Point(module(wearsim_wear_laws=load_named("ramp")))])


def test_that_a_plugin_may_yield_nothing():
    assert not Registry([Point(module(wearsim_loads=lambda: None))]).all()


@pytest.mark.parametrize(
    ("loader", "cause"),
    [
        (failing, "ImportError: no module named 'sparse_magic'"),
        (lambda: 1 / 0, "ZeroDivisionError: division by zero"),
        (lambda: sys.exit("goodbye"), "SystemExit: goodbye"),
        (module(wearsim_loads=lambda: 1 / 0), "ZeroDivisionError: division by zero"),
    ],
    ids=["import", "crash", "exit", "hook"],
)
def test_that_a_plugin_which_fails_to_load_is_reported_when_its_name_is_asked_for(loader, cause):
    good = Point(module(wearsim_loads=load_named("ramp")), "good", "good-dist")
    found = Registry([Point(loader, "bad", "bad-dist", "9"), good])
    assert found.get(LoadSpec, "ramp").name == "ramp"
    assert [item.cause for item in found.broken] == [cause]
    with pytest.raises(PluginError) as told:
        found.get(LoadSpec, "sine")
    assert "no load is named 'sine'; known: ramp" in str(told.value)
    assert f"plugin 'bad' of bad-dist 9 failed to load ({cause})" in str(told.value)


def test_that_a_failed_plugin_is_told_by_the_scenario_that_asks_for_it(install):
    install(Point(failing, "bad", "bad-dist", "9"))
    with pytest.raises(ScenarioError) as told:
        rig(contact='model = "sparse"')
    assert "[contact] model: no contact model is named 'sparse'" in str(told.value)
    assert "bad-dist 9 failed to load (ImportError: no module named" in str(told.value)


def test_that_a_failed_plugin_does_no_harm_to_a_scenario_without_it(install):
    install(Point(failing, "bad", "bad-dist", "9"))
    assert rig(**TABLES).contact.model == "slender"


def test_that_the_nearest_name_is_offered():
    with pytest.raises(PluginError, match="did you mean 'slender'"):
        registry().get(ContactModelSpec, "slendre")
