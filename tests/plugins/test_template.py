"""Plugin template of wearsim: imports, length, and runs with its model."""

from __future__ import annotations

import ast
import importlib
import importlib.util
import runpy
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from plugin_examples import Point, rig

import wearsim
from wearsim.plugins.template import clash, renamed, template_folder, write_plugin
from wearsim.testing import axial_profile_tests, contact_model_tests
from wearsim.testing.checks import ConfiguredSpec, ConformanceError
from wearsim.testing.contact_fixtures import ContactFixture
from wearsim.testing.fatigue_laws import FATIGUE_LAW, FatigueLawFixture
from wearsim.testing.kit import CONTACT_MODEL
from wearsim.testing.study_kinds import STUDY_KIND, StudyKindFixture
from wearsim.testing.tables import TABLE, TableFixture

FOLDER = template_folder()
MODULE = FOLDER / "src" / "wearsim_template" / "__init__.py"
ALLOWED = {"numpy", "scipy", "pytest", "wearsim.plugins", "wearsim.testing", "wearsim.types"}
ALLOWED |= {"wearsim.report.panels", "wearsim.report.view", "wearsim.results.viewed"}


def load_template():
    specification = importlib.util.spec_from_file_location("wearsim_template", MODULE)
    made = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(made)
    return made


test_winkler = contact_model_tests(load_template().SPEC)
test_winkler_quartic = axial_profile_tests(load_template().FORM, {"length": "10 mm"})


def test_fatigue_law_of_the_readme_conforms():
    blocks = (FOLDER / "README.md").read_text().split("```python\n")[1:]
    (code,) = [block.split("```")[0] for block in blocks if "class NinthPower" in block]
    names = {"ws": wearsim.plugins}
    exec(code, names)
    (spec,) = names["wearsim_fatigue_laws"]()
    fixture = FatigueLawFixture(ConfiguredSpec(spec, {"passes": 2e6}))
    for check in FATIGUE_LAW.values():
        check(fixture)


@pytest.fixture
def template(install, monkeypatch):
    made = load_template()
    monkeypatch.setitem(sys.modules, "wearsim_template", made)
    install(Point(lambda: made, "winkler", "wearsim-template", "0.1.0"))


def imported(path: Path) -> set[str]:
    """Return the modules that a file imports."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add(node.module)
    return names


@pytest.mark.parametrize("path", sorted(FOLDER.rglob("*.py")), ids=lambda path: path.name)
def test_template_imports_public_modules_only(path):
    own = {"wearsim_template", "wearsim_template.study"} if path != MODULE else set()
    standard = set(sys.stdlib_module_names)
    for name in imported(path) - own:
        assert name in ALLOWED or name.split(".")[0] in (standard | {"numpy", "scipy"}), name


def test_template_is_short():
    assert len(MODULE.read_text().splitlines()) < 160


def test_kind_of_study_of_the_template_has_about_twenty_statements():
    body = ast.parse((MODULE.parent / "study.py").read_text()).body
    classes = [item for item in body if isinstance(item, ast.ClassDef)]
    nodes = [node for item in classes for node in ast.walk(item)]
    # without docstrings, which are expressions
    count = sum(isinstance(node, ast.stmt) and not isinstance(node, ast.Expr) for node in nodes)
    assert count <= 22


def test_template_tests_use_one_line_of_the_kit():
    text = (FOLDER / "tests" / "test_winkler.py").read_text()
    assert "test_winkler_approach = study_kind_tests(KIND, small_study)\n" in text
    assert "test_winkler = contact_model_tests(SPEC)\n" in text
    assert 'test_winkler_approach_table = table_tests(TABLE, {"greatest_force": "400 N"})\n' in text
    assert 'test_winkler_quartic = axial_profile_tests(FORM, {"length": "10 mm"})\n' in text


@pytest.fixture
def study(template, monkeypatch):
    """Return the kind of study of the template, installed, and a small result."""
    monkeypatch.syspath_prepend(MODULE.parents[1])
    monkeypatch.setattr(sys.modules["wearsim_template"], "__path__", [str(MODULE.parent)], False)
    made = runpy.run_path(str(FOLDER / "tests" / "test_winkler.py"))
    yield StudyKindFixture(made["KIND"], made["small_study"]())
    sys.modules.pop("wearsim_template.study", None)


def test_kind_of_study_meets_the_requirements(study):
    for check in STUDY_KIND.values():
        check(study)


@pytest.mark.usefixtures("template")
def test_table_of_the_template_meets_the_requirements():
    spec = sys.modules["wearsim_template"].TABLE
    fixture = TableFixture(ConfiguredSpec(spec, {"greatest_force": "400 N"}))
    for check in TABLE.values():
        check(fixture)


def test_table_that_is_not_installed_is_reported():
    spec = replace(load_template().TABLE, name="of-nobody")
    fixture = TableFixture(ConfiguredSpec(spec))
    with pytest.raises(ConformanceError, match="of-nobody"):
        TABLE["scenario-has-the-options"](fixture)


@pytest.mark.usefixtures("template")
def test_template_runs_the_rig_with_stabilised_steps():
    result = wearsim.run(rig(contact='model = "winkler"'))
    assert (result.stepper, result.finished) == ("stabilised", True)
    # gross sliding: mu N V |xi| per roller, for three rollers
    assert result.power[-1] == pytest.approx(3 * 0.1 * 300.0 * 2.618 * 1e-3, rel=1e-4)
    assert result.worn_volume[-1] == pytest.approx(
        1.1e-11 * result.dissipated_energy[-1], rel=1e-9, abs=0.0
    )


@pytest.mark.usefixtures("template")
def test_stabilised_steps_agree_with_per_pass_steps():
    short = {"operation.duration": "12 s"}
    contact = 'model = "winkler"\nfoundation_modulus = "800 GPa/mm"'
    steps = wearsim.run(rig(short, contact=contact))
    reference = wearsim.run(rig(short | {"evolution.stepper": "per-pass"}, contact=contact))
    assert steps.depth[-1] == pytest.approx(float(reference.depth[-1]), rel=2e-3)


@pytest.mark.usefixtures("template")
@pytest.mark.parametrize(
    ("option", "message"),
    [
        ('foundation_modulus = "1 GPa"', "foundation_modulus: wrong dimension"),
        ('foundation_modulus = "0 GPa/mm"', "must be above zero"),
        ("half_length = 0.1", 'expected a length above zero such as "20 mm"'),
        ('depth = "1 mm"', "depth: unknown key"),
    ],
)
def test_options_are_validated_with_their_units(option, message):
    with pytest.raises(wearsim.errors.ScenarioError) as caught:
        rig(contact=f'model = "winkler"\n{option}')
    assert message in str(caught.value)


def test_names_are_replaced_by_those_of_the_new_plugin():
    text = "wearsim-template wearsim_template Winkler winkler test_winkler"
    assert renamed(text, "a-b") == "wearsim-a-b wearsim_a_b AB a-b test_a_b"


AWKWARD = ["soft-winkler", "winkler-template", "template", "winkler", "wink-winkler-2", "my-grid"]


@pytest.mark.parametrize("name", AWKWARD)
def test_name_containing_a_template_name_is_replaced_once(name):
    under, camel = name.replace("-", "_"), name.title().replace("-", "")
    text = "wearsim-template wearsim_template Winkler winkler test_winkler"
    assert renamed(text, name) == (f"wearsim-{name} wearsim_{under} {camel} {name} test_{under}")


@pytest.mark.parametrize("name", AWKWARD)
def test_plugin_with_an_awkward_name_is_imported_and_solves(name, tmp_path, monkeypatch):
    written = write_plugin(name, tmp_path)
    code = [ast.parse(path.read_text()) for path in written if path.suffix == ".py"]
    assert len(code) == 3
    under = name.replace("-", "_")
    monkeypatch.syspath_prepend(tmp_path / f"wearsim-{name}" / "src")
    monkeypatch.delitem(sys.modules, f"wearsim_{under}", raising=False)
    made = importlib.import_module(f"wearsim_{under}")
    monkeypatch.delitem(sys.modules, made.__name__)
    (yielded,) = made.wearsim_contact_models()
    assert (yielded.name, made.SPEC) == (name, yielded)
    # the test of the plugin has the new names
    tests = tmp_path / f"wearsim-{name}" / "tests" / f"test_{under}.py"
    monkeypatch.setitem(sys.modules, made.__name__, made)
    assert f"test_{under}" in runpy.run_path(str(tests))
    CONTACT_MODEL["strips-carry-the-load"](ContactFixture(ConfiguredSpec(yielded)))


def test_words_in_docstrings_do_not_clash():
    assert clash("springs") is None
    assert clash("strip") is None
