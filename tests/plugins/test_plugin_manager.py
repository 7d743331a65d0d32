"""Registry of plugins: discovery, refused plugins and error messages."""

from __future__ import annotations

import inspect
import json
import sys
from importlib import import_module
from types import ModuleType
from typing import Any, get_args

import pytest
from plugin_examples import HOOKS, RIG, TABLES, Point, load_named, module, rig
from pydantic import create_model
from typer.testing import CliRunner

from wearsim.cli.app import app
from wearsim.errors import PluginError, ScenarioError
from wearsim.plugins import (
    AxialProfileSpec,
    ContactModelSpec,
    FatigueLawSpec,
    LoadSpec,
    MotionLawSpec,
    Options,
    RandomInputSpec,
    Spec,
    StudyKind,
    TableSpec,
    WearLawSpec,
    registry,
)
from wearsim.plugins.manager import Registry

BROKEN = """
from wearsim.plugins import Options, WearLaw, WearLawSpec, hookimpl


class Broken(WearLaw):
    def __init__(self, options):
        pass

    def depth_per_pass(self, body, solution, rolling_speed):
        raise KeyError("k")


@hookimpl
def wearsim_wear_laws():
    yield WearLawSpec("broken", Options, "a law", factory=Broken, protocol=2)
"""


def failing():
    raise ImportError("no module named 'sparse_magic'")


def test_built_in_plugins_use_the_same_hooks(install):
    install()
    plugins = registry()
    assert plugins.names(ContactModelSpec) == ["hertz", "hertz-fastsim", "semi-hertzian", "slender"]
    assert plugins.names(WearLawSpec) == ["archard-dissipation", "t-gamma"]
    assert plugins.names(LoadSpec) == [
        *("constant", "follower", "follower-arm", "recorded", "spring", "thermal")
    ]
    assert {item.distribution for item in plugins.all()} == {"wearsim"}
    assert all(item.spec.summary for item in plugins.all())
    assert not plugins.broken


def test_every_kind_of_spec_is_registered():
    def of(kind):
        if kind is StudyKind:
            return lambda: [kind("new", summary="new", result="a:B", view="a:C", protocol=2)]
        if kind is TableSpec:
            return lambda: [kind("new", Options, "new", protocol=2)]
        return lambda: [kind("new", Options, "new", factory=lambda options: None, protocol=2)]

    specs = (
        *(ContactModelSpec, WearLawSpec, LoadSpec, RandomInputSpec, MotionLawSpec),
        *(FatigueLawSpec, AxialProfileSpec, StudyKind, TableSpec),
    )
    kinds = dict(zip(HOOKS, specs, strict=True))
    plugins = Registry([Point(module(**{hook: of(kind) for hook, kind in kinds.items()}))])
    for kind in kinds.values():
        assert plugins.names(kind) == ["new"]
        item = plugins.registered(kind, "new")
        assert (item.distribution, item.version) == ("wearsim-made-up", "0.1")


def test_duplicate_names_are_an_error_naming_both_plugins():
    hook = module(wearsim_loads=load_named("ramp"))
    points = [Point(hook, "a", "first-dist", "1.0"), Point(hook, "b", "second-dist", "2.0")]
    with pytest.raises(
        PluginError, match=r"'ramp': first-dist 1\.0 and second-dist 2\.0"
    ) as caught:
        Registry(points)
    assert "uninstall one" in str(caught.value)


def test_plugin_with_a_built_in_name_is_an_error(install):
    install(Point(module(wearsim_loads=load_named("constant")), distribution="impostor"))
    with pytest.raises(PluginError, match=r"wearsim 0.* and impostor|impostor 0.* and wearsim"):
        registry()


def test_different_kinds_may_have_the_same_name():
    law = [WearLawSpec("ramp", Options, "a law", factory=lambda options: None, protocol=2)]
    loader = module(wearsim_loads=load_named("ramp"), wearsim_wear_laws=lambda: law)
    assert len(Registry([Point(loader)]).all()) == 2


def test_misspelt_hook_is_an_error():
    with pytest.raises(PluginError, match="wearsim_contact_model") as caught:
        Registry([Point(module(wearsim_contact_model=lambda: ()))])
    assert "wearsim-made-up 0.1" in str(caught.value)
    for hook in HOOKS:
        assert hook in str(caught.value)


def test_hook_with_an_unknown_argument_is_an_error():
    with pytest.raises(PluginError, match="colour"):
        Registry([Point(module(wearsim_loads=lambda colour: []))])


def test_hook_with_the_wrong_kind_of_spec_is_an_error():
    with pytest.raises(PluginError, match=r"wearsim_wear_laws yielded .* expected a WearLawSpec"):
        Registry([Point(module(wearsim_wear_laws=load_named("ramp")))])


def test_plugin_may_yield_nothing():
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
def test_plugin_that_fails_to_load_is_named_with_its_cause(loader, cause):
    good = Point(module(wearsim_loads=load_named("ramp")), "good", "good-dist")
    plugins = Registry([Point(loader, "bad", "bad-dist", "9"), good])
    assert plugins.get(LoadSpec, "ramp").name == "ramp"
    assert [item.cause for item in plugins.broken] == [cause]
    with pytest.raises(PluginError) as caught:
        plugins.get(LoadSpec, "sine")
    assert "no load is named 'sine'; known: ramp" in str(caught.value)
    assert f"plugin 'bad' of bad-dist 9 failed to load ({cause})" in str(caught.value)


def test_scenario_error_names_the_plugin_that_failed(install):
    install(Point(failing, "bad", "bad-dist", "9"))
    with pytest.raises(ScenarioError) as caught:
        rig(contact='model = "sparse"')
    assert "[contact] model: no contact model is named 'sparse'" in str(caught.value)
    assert "bad-dist 9 failed to load (ImportError: no module named" in str(caught.value)


def test_failed_plugin_does_not_affect_other_scenarios(install):
    install(Point(failing, "bad", "bad-dist", "9"))
    assert rig(**TABLES).contact.model == "slender"


def test_nearest_name_is_suggested():
    with pytest.raises(PluginError, match="did you mean 'slender'"):
        registry().get(ContactModelSpec, "slendre")


@pytest.mark.parametrize(
    ("given", "protocol", "remedy"),
    [({}, 1, "a newer version of the plugin"), ({"protocol": 3}, 3, "a newer wearsim")],
)
def test_spec_of_another_protocol_is_listed_and_refused_when_selected(
    install, given, protocol, remedy
):
    def old():
        return [ContactModelSpec("old", Options, "old", factory=lambda options: None, **given)]

    install(Point(module(wearsim_contact_models=old), "old", "old-dist", "9"))
    assert "old" not in registry().names(ContactModelSpec)
    (item,) = [item for item in registry().all() if item.spec.name == "old"]
    assert item.refusal
    assert rig(**TABLES).contact.model == "slender"
    with pytest.raises(ScenarioError, match=r"\[contact\] model: contact model 'old'") as caught:
        rig(contact='model = "old"')
    for part in ("old-dist 9", f"protocol {protocol}", "has 2", remedy, "docs/plugins.md"):
        assert part in str(caught.value)


@pytest.mark.parametrize(
    ("hook", "spec"),
    [
        ("wearsim_wear_laws", WearLawSpec),
        ("wearsim_loads", LoadSpec),
        ("wearsim_random_inputs", RandomInputSpec),
        ("wearsim_motion_laws", MotionLawSpec),
        ("wearsim_fatigue_laws", FatigueLawSpec),
        ("wearsim_axial_profiles", AxialProfileSpec),
    ],
)
def test_every_kind_of_spec_has_a_protocol(hook, spec):
    made = [spec("old", Options, "old", factory=lambda options: None)]
    plugins = Registry([Point(module(**{hook: lambda: made}))])
    with pytest.raises(PluginError, match=r"plugin protocol 1, and this wearsim has 2"):
        plugins.get(spec, "old")


def test_refused_plugins_are_listed_by_the_command(install):
    old = [LoadSpec("old", Options, "a load", factory=lambda options: None)]
    install(Point(module(wearsim_loads=lambda: old), "old", "old-dist", "9"))
    shown = CliRunner().invoke(app, ["plugins"])
    assert shown.exit_code == 0
    assert "refused: load 'old' of old-dist 9" in shown.stderr
    entries = json.loads(CliRunner().invoke(app, ["plugins", "--json"]).stdout)["plugins"]
    refused = [entry["name"] for entry in entries if entry["refused"]]
    assert refused == ["old"]
    assert {entry["protocol"] for entry in entries if not entry["refused"]} == {2}


FAULTS: dict[str, tuple[str, type[Spec], dict[str, Any], str]] = {
    "role": ("wearsim_random_inputs", RandomInputSpec, {"role": "scalr"}, "role 'scalr', expected"),
    "term": ("wearsim_loads", LoadSpec, {"role": "scalar"}, "role 'scalar', expected one of base"),
    "rise": ("wearsim_motion_laws", MotionLawSpec, {"rise": True}, "rise True, expected one of re"),
    "options": ("wearsim_loads", LoadSpec, {"options": dict}, "options <class 'dict'>, expected a"),
    "name": ("wearsim_loads", LoadSpec, {"name": None}, "name None, expected a text"),
    "protocol": ("wearsim_loads", LoadSpec, {"protocol": "2"}, "protocol '2', expected the number"),
    "factory": ("wearsim_loads", LoadSpec, {"factory": 3}, "factory 3, expected a class or a func"),
}


@pytest.mark.parametrize(("hook", "kind", "field", "text"), FAULTS.values(), ids=FAULTS)
def test_spec_with_a_field_that_cannot_be_used_is_an_error(hook, kind, field, text):
    fields = {"name": "ramp", "options": Options, "summary": "a ramp", "factory": list}
    made = [kind(**{**fields, "protocol": 2, **field})]
    with pytest.raises(PluginError, match=rf"wearsim-made-up 0\.1: the {kind.__name__} .*{text}"):
        Registry([Point(module(**{hook: lambda: made}))])


@pytest.mark.parametrize("kind", [LoadSpec, MotionLawSpec, RandomInputSpec])
def test_every_word_of_a_spec_is_accepted(kind):
    hook = {LoadSpec: "wearsim_loads", MotionLawSpec: "wearsim_motion_laws"}.get(
        kind, "wearsim_random_inputs"
    )
    field = "rise" if kind is MotionLawSpec else "role"
    words = get_args(inspect.get_annotations(kind, eval_str=True)[field])
    made = [
        kind(word, Options, "a summary", factory=list, protocol=2, **{field: word})
        for word in words
    ]
    assert Registry([Point(module(**{hook: lambda: made}))]).names(kind) == sorted(words)


def test_function_without_the_marker_of_hooks_is_an_error():
    made = ModuleType("made_up")
    made.wearsim_loads = load_named("ramp")
    with pytest.raises(PluginError, match="wearsim_loads is no hook; write @hookimpl above it"):
        Registry([Point(lambda: made)])


@pytest.mark.parametrize("name", ["load", "title"])
def test_table_of_a_plugin_with_the_name_of_one_of_wearsim_is_an_error(install, name):
    made = [TableSpec(name, Options, "a table", protocol=2)]
    install(Point(module(wearsim_tables=lambda: made)))
    with pytest.raises(ScenarioError) as caught:
        rig(**TABLES)
    text = f"[{name}]: is a table of wearsim, and one of the plugin wearsim-made-up 0.1, expected"
    assert text in str(caught.value)


@pytest.mark.parametrize(
    ("hook", "kind", "key", "tables"),
    [
        ("wearsim_loads", LoadSpec, "kind", {"load": 'kind = "new"'}),
        ("wearsim_wear_laws", WearLawSpec, "law", {"wear": 'law = "new"'}),
        (
            "wearsim_random_inputs",
            RandomInputSpec,
            "persistence",
            {"load": 'kind = "constant"\nnormal_force = {distribution = "new"}'},
        ),
    ],
)
def test_option_with_the_name_of_a_key_of_wearsim_is_an_error(install, hook, kind, key, tables):
    options = create_model("Clash", __base__=Options, **{key: (str, "x")})
    made = [kind("new", options, "new", factory=list, protocol=2)]
    install(Point(module(**{hook: lambda: made})))
    with pytest.raises(ScenarioError, match=rf"{key}: is a key of wearsim and an option of the pl"):
        rig(**tables)


def test_internal_error_in_a_plugin_names_it_with_file_and_line(install, tmp_path, monkeypatch):
    monkeypatch.setenv("WEARSIM_TRACEBACK", "")
    (tmp_path / "wearsim_broken.py").write_text(BROKEN)
    monkeypatch.syspath_prepend(tmp_path)
    install(Point(lambda: import_module("wearsim_broken"), "wearsim_broken", "broken-dist", "9"))
    text = RIG + "".join(f"\n[{name}]\n{body}\n" for name, body in TABLES.items())
    scenario = tmp_path / "rig.toml"
    scenario.write_text(text.replace(TABLES["wear"], 'law = "broken"'))
    shown = CliRunner().invoke(app, ["run", str(scenario)])
    assert shown.exit_code == 1
    line = 1 + BROKEN.splitlines().index('        raise KeyError("k")')
    place = f"depth_per_pass, line {line} of {tmp_path / 'wearsim_broken.py'}"
    assert "internal error: KeyError: 'k'" in shown.stderr
    assert f"a defect of plugin 'wearsim_broken' of broken-dist 9, {place}; " in shown.stderr


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"result": "made_up.Result"}, "result 'made_up.Result', expected a reference 'package.mo"),
        ({"view": ""}, "view '', expected a reference"),
        ({"format": "made-up"}, "data '', expected a reference"),
    ],
)
def test_study_kind_without_a_reference_is_an_error(fields, text):
    given = {"result": "made_up:Result", "view": "made_up:View", **fields}
    made = [StudyKind("new", summary="new", protocol=2, **given)]
    with pytest.raises(PluginError, match=f"the StudyKind of 'new' has the {text}"):
        Registry([Point(module(wearsim_study_kinds=lambda: made))])


def test_study_kind_with_the_format_of_another_is_an_error(install):
    given = {"result": "made_up:Result", "view": "made_up:View", "data": "made_up:Data"}
    made = [StudyKind("new", summary="new", protocol=2, format="wearsim-run", **given)]
    install(Point(module(wearsim_study_kinds=lambda: made)))
    with pytest.raises(
        PluginError, match=r"have the format 'wearsim-run': '(run|new)' of .*made-up"
    ):
        registry()


@pytest.mark.parametrize("reference", ["made_up_module:View", "wearsim.report.view:Vue"])
def test_reference_that_names_nothing_is_an_error(reference):
    kind = StudyKind("new", summary="new", protocol=2, result="wearsim:Result", view=reference)
    text = f"study kind 'new': its view, '{reference}', cannot be imported"
    with pytest.raises(PluginError, match=text):
        kind.load("view")
