"""Tests of docs/plugins.md: the example of every hook runs and passes the conformance tests."""

from __future__ import annotations

import json
import re
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from plugin_examples import HOOKS, Point, rig
from typer.testing import CliRunner

import wearsim
from wearsim.cli.app import app as cli_app
from wearsim.errors import CapabilityError, PluginError, ScenarioError
from wearsim.plugins import (
    AxialProfileSpec,
    Capabilities,
    ContactModelSpec,
    LoadSpec,
    MotionLawSpec,
    RandomInputSpec,
    StudyKind,
    WearLawSpec,
    registry,
)
from wearsim.plugins.manager import HookSpecs
from wearsim.scenario.examples import scenario_schema
from wearsim.testing import random_inputs
from wearsim.testing.axial_profiles import AXIAL_PROFILE, AxialProfileFixture
from wearsim.testing.checks import ConfiguredSpec
from wearsim.testing.contact_fixtures import ContactFixture
from wearsim.testing.kit import CONTACT_MODEL
from wearsim.testing.motion_laws import MOTION_LAW, MotionLawFixture
from wearsim.testing.random_inputs import RandomInputFixture
from wearsim.testing.study_kinds import STUDY_KIND, StudyKindFixture
from wearsim.testing.wear_and_loads import LOADS, WEAR_LAW, LoadFixture, WearLawFixture
from wearsim.units import ANGLE, FORCE

PAGE = (Path(__file__).parents[2] / "docs" / "plugins.md").read_text(encoding="utf-8")
LOAD = 'kind = "constant"\nnormal_force = "300 N"'


def section(title: str) -> str:
    """Return the section of the page under a title."""
    parts = re.split(r"^## (.+)$", PAGE, flags=re.MULTILINE)
    sections = dict(zip(parts[1::2], parts[2::2], strict=True))
    assert title in sections, f"docs/plugins.md has no section on {title}"
    return sections[title]


def blocks(text: str, language: str) -> list[str]:
    """Return the code blocks of a text."""
    found = re.findall(r"^```(\w*)\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)
    return [code for own, code in found if own == language]


@pytest.fixture
def documented(install, monkeypatch):
    """Install the example in a hook's section; return its tables for the scenario."""

    def documented(hook: str) -> dict[str, str]:
        text = section(f"`{hook}`")
        code, toml = "\n".join(blocks(text, "python")), "".join(blocks(text, "toml"))
        made = ModuleType(f"documented_{hook}")
        monkeypatch.setitem(sys.modules, made.__name__, made)
        exec(compile(code, "docs/plugins.md", "exec", dont_inherit=True), vars(made))
        install(Point(lambda: made, distribution="my-package"))
        parts = re.split(r"^\[([\w.]+)\]$", toml, flags=re.MULTILINE)
        return dict(zip(parts[1::2], parts[2::2], strict=True))

    return documented


def run_checks(checks, fixture):
    for check in checks.values():
        check(fixture)


@pytest.mark.parametrize("hook", [name for name in vars(HookSpecs) if "wearsim" in name])
def test_every_hook_is_documented_and_tested(hook):
    code = blocks(section(f"`{hook}`"), "python")[0]
    assert f"@hookimpl\ndef {hook}():" in code
    assert f'documented("{hook}")' in Path(__file__).read_text(), f"no test here runs {hook}"
    assert hook in HOOKS
    assert f"| `{hook}` |" in section("How plugins are found")


def test_documented_contact_model_passes_the_checks_and_runs(documented):
    tables = documented("wearsim_contact_models")
    spec = registry().get(ContactModelSpec, "plastic")
    run_checks(CONTACT_MODEL, ContactFixture(ConfiguredSpec(spec)))
    scenario = rig(**tables)
    assert scenario.contact.options.hardness == 1.2e9
    solution = wearsim.solve_contact(scenario)
    assert solution.peak_pressure == 1.2e9
    result = wearsim.run(scenario)
    assert result.finished
    assert result.power[-1] == pytest.approx(3 * 0.1 * 300.0 * 2.618 * 1e-3, rel=1e-4)
    with pytest.raises(CapabilityError, match="wear compliance"):
        wearsim.run(rig({"evolution.stepper": "implicit"}, **tables))


def test_documented_table_is_read_with_the_scenario(documented):
    tables = documented("wearsim_tables")
    assert rig(**tables).tables["survey"].spacing == 2e-3
    assert "survey" in scenario_schema()["properties"]
    with pytest.raises(ScenarioError, match=r"\[survey\] grooves: .*got 0"):
        rig(survey="grooves = 0")


@pytest.mark.parametrize("stepper", ["auto", "per-pass"])
def test_documented_wear_law_passes_the_checks_and_runs(documented, stepper):
    tables = documented("wearsim_wear_laws")
    spec = registry().get(WearLawSpec, "threshold")
    run_checks(WEAR_LAW, WearLawFixture(ConfiguredSpec(spec, {"k_over_h": "1.1e-11 1/Pa"})))
    changes = {"evolution.stepper": stepper, "operation.duration": "12 s"}
    result = wearsim.run(rig(changes, **tables))
    free = wearsim.run(rig(changes | {"wear.threshold": "0 J/m^2"}, **tables))
    assert 0.0 < result.worn_volume[-1] < 0.9 * free.worn_volume[-1]
    assert result.width[-1] <= free.width[-1]


@pytest.mark.parametrize("stepper", ["auto", "per-pass"])
def test_documented_loads_pass_the_checks_and_run(documented, stepper):
    tables = documented("wearsim_loads")
    wave = {"normal_force": "300 N", "amplitude": "20 N", "period": "90 s"}
    warmth = {"time_constant": "1 min"}
    run_checks(LOADS["base"], LoadFixture(ConfiguredSpec(registry().get(LoadSpec, "wave"), wave)))
    run_checks(
        LOADS["term"],
        LoadFixture(ConfiguredSpec(registry().get(LoadSpec, "warmth"), warmth)),
    )
    result = wearsim.run(rig({"evolution.stepper": stepper}, **tables))
    # two time constants of a lag of 0.0785 W x 50 N/W, plus a wave of 20 N
    wave_now = 20.0 * np.sin(2.0 * np.pi * 120.0 / 90.0)
    warm_now = 50.0 * 0.0785 * (1.0 - np.exp(-2.0))
    assert result.normal_force[-1] == pytest.approx(300.0 + wave_now + warm_now, rel=5e-3)


def test_documented_random_inputs_pass_the_checks_and_run(documented):
    tables = documented("wearsim_random_inputs")

    def chosen(name, raw, kind=None):
        return ConfiguredSpec(registry().get(RandomInputSpec, name), raw, kind)

    triangle = chosen("triangle", {"mode": "300 N", "width": "30 N"}, FORCE)
    run_checks(random_inputs.BY_ROLE["scalar"], RandomInputFixture(triangle))
    assert triangle.spec.factory(triangle.options).std == pytest.approx(30.0 / 6**0.5, rel=1e-4)
    slack = chosen("slack", {"yaw": "1 mrad", "tilt": "0.5 mrad"}, ANGLE)
    run_checks(random_inputs.BY_ROLE["joint"], RandomInputFixture(slack))
    friction = chosen("triangle", {"mode": 0.1, "width": 0.02})
    stripes = RandomInputFixture(chosen("stripes", {}), friction)
    run_checks(random_inputs.BY_ROLE["field"], stripes)
    steady = RandomInputFixture(chosen("steady", {"spacing": "10 s"}), friction)
    run_checks(random_inputs.BY_ROLE["process"], steady)
    text = "".join(f"\n[{name}]\n{body}" for name, body in tables.items())
    scenario = rig_with(text)
    result = wearsim.run(scenario)
    assert result.finished
    assert 270.0 < result.drawn["load.normal_force"][0] < 330.0
    assert np.abs(result.drawn["creepage.tilt"]).max() <= 0.5e-3
    assert len(set(result.drawn["creepage.yaw"])) == 3


def test_documented_motion_law_passes_the_checks(documented):
    tables = documented("wearsim_motion_laws")
    assert 'law = "power"' in tables["cam"]
    spec = registry().get(MotionLawSpec, "power")
    run_checks(MOTION_LAW, MotionLawFixture(ConfiguredSpec(spec, {"order": 4})))


def test_documented_axial_profile_passes_the_checks_and_runs(documented):
    tables = documented("wearsim_axial_profiles")
    (key,) = [line for line in tables["roller"].splitlines() if line.startswith("axial")]
    form = tomllib.loads(key)["axial_profile"]
    options = {name: value for name, value in form.items() if name != "form"}
    spec = registry().get(AxialProfileSpec, "power")
    run_checks(AXIAL_PROFILE, AxialProfileFixture(ConfiguredSpec(spec, options)))
    scenario = rig({"roller.axial_profile": form})
    assert wearsim.solve_contact(scenario).power > 0.0


def rig_with(tables: str):
    """Return a short test with load, misalignment and friction in separate tables."""
    base = rig().text.replace("coefficient = 0.1\n", "").replace('normal_force = "300 N"\n', "")
    return wearsim.scenario.parse_scenario(base + tables, "rig.toml", {}.__getitem__)


def test_every_capability_is_in_the_table():
    text = PAGE[PAGE.index("### Optional capabilities") :]
    rows = re.findall(r"^\| `(\w+)` \|", text[: text.index("\n## ")], flags=re.MULTILINE)
    assert rows == list(vars(Capabilities()))


def test_every_check_is_in_the_table():
    rows = re.findall(r"^\| `([\w-]+)` \| (.*) \|$", section("Conformance tests"), re.MULTILINE)
    assert rows == [(check.name, check.requirement) for check in CONTACT_MODEL.values()]


def test_documented_verb_runs(tmp_path, monkeypatch):
    (code,), (toml,) = (blocks(section("Add a verb"), language) for language in ("python", "toml"))
    project = tomllib.loads(toml)["project"]
    ((group, points),) = project["entry-points"].items()
    ((verb, value),) = points.items()
    info = tmp_path / "wearsim_pressure-0.1.0.dist-info"
    info.mkdir()
    (info / "entry_points.txt").write_text(f"[{group}]\n{verb} = {value}\n")
    (info / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
        f"Summary: {project['description']}\n"
    )
    (tmp_path / "wearsim_pressure.py").write_text(code)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    Path("scenario.toml").write_text(rig().text)
    (call,) = re.findall(r"^wearsim (.*)$", blocks(section("Add a verb"), "")[0], re.MULTILINE)
    result = CliRunner().invoke(cli_app, call.split())
    peak = wearsim.solve_contact(rig()).peak_pressure
    assert result.exit_code == 0, result.output
    assert result.stdout == f"{peak / 1e6:.1f} MPa\n"
    assert re.search(
        rf"{verb} +{project['description']}", CliRunner().invoke(cli_app, "--help").stdout
    )


@pytest.mark.parametrize("title", ["Options and units", "Conformance tests"])
def test_other_examples_run(title):
    for code in blocks(section(title), "python"):
        exec(compile(code, "docs/plugins.md", "exec", dont_inherit=True), {})


def test_documented_message_is_that_of_the_check():
    (message,) = blocks(section("Conformance tests"), "")
    check = CONTACT_MODEL["strips-carry-the-load"]
    flat = " ".join(message.split())
    assert flat.endswith(f"Violated requirement: {check.requirement} ({check.specified_in})")


def test_documented_study_passes_the_checks_in_every_display(documented, tmp_path):
    documented("wearsim_study_kinds")
    module, path = sys.modules["documented_wearsim_study_kinds"], tmp_path / "survey.h5"
    kind = registry().get(StudyKind, "survey")

    def opened():
        module.survey(rig(), [45e-6, 48e-6, 52e-6], path)
        return wearsim.open_results(path)

    run_checks(STUDY_KIND, StudyKindFixture(kind, opened()))


def test_verbs_work_on_the_file_of_a_documented_study(documented, tmp_path, monkeypatch):
    documented("wearsim_study_kinds")
    monkeypatch.chdir(tmp_path)
    sys.modules["documented_wearsim_study_kinds"].survey(rig(), [45e-6, 48e-6], "a.h5")
    for verb in (["show"], ["plot"], ["export"], ["report"]):
        done = CliRunner().invoke(cli_app, [*verb, "a.h5"])
        assert done.exit_code == 0, done.output
    assert json.loads(CliRunner().invoke(cli_app, ["show", "a.h5", "--json"]).stdout)["depth_m"]
    assert Path("a", "grooves.csv").read_text().startswith("depth [um]")
    refused = CliRunner().invoke(cli_app, ["resume", "a.h5"])
    assert "holds depths of grooves, which cannot be continued" in refused.stderr


def test_study_without_its_plugin_names_the_plugin(documented, install, tmp_path):
    documented("wearsim_study_kinds")
    path = tmp_path / "a.h5"
    sys.modules["documented_wearsim_study_kinds"].survey(rig(), [45e-6, 48e-6], path)
    install()
    with pytest.raises(PluginError, match="pip install my-package"):
        wearsim.open_results(path)
