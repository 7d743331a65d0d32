"""Topic `contact`: methods, errors and failures."""

import json
import sys
from dataclasses import replace
from types import ModuleType, SimpleNamespace
from typing import Literal, get_args

import numpy as np
import pytest
from pydantic import field_validator

import wearsim.plugins as ws
from tests.benchmarks.models import install_template
from tests.benchmarks.wear_tests import SCENARIOS
from wearsim import load_scenario
from wearsim.errors import ContactError, PluginError
from wearsim.models.contact import slender
from wearsim.models.contact.strip_model import TangentialOptions
from wearsim.plugins import ContactModelSpec, manager, registry
from wearsim.studies.run.draws import draw
from wearsim.studies.run.grid import strips_of_run
from wearsim_bench.contact.accuracy import choose_model, errors_of, random_case_errors, solved
from wearsim_bench.contact.cases import elliptic_cases, worn_cases
from wearsim_bench.contact.methods import (
    COMPARISON_MODEL,
    Method,
    compared_models,
    methods,
    normal_methods,
)
from wearsim_bench.contact.topic import HARD, contact
from wearsim_bench.contact.worn_profiles import measure
from wearsim_bench.exact_solutions import rows
from wearsim_bench.measure.measurement import Effort

QUICK = Effort(quick=True, repetitions=1)
GROUPS = ["fresh rig", "partial slip with spin", *HARD, "worn profiles"]


class ChoosyOptions(ws.Options):
    """Choices of all kinds, one of which requires another."""

    shape: Literal["round", "flat"] = "round"
    fine: bool = False
    size: float = 1.0

    @field_validator("fine")
    @classmethod
    def _flat_only(cls, value, info):
        if value and info.data["shape"] != "flat":
            raise ValueError("fine requires flat")
        return value


class Faulty(ws.SingleContactModel):
    """Contact model with a `solve_contact` that raises a TypeError."""

    def __init__(self, options, grid, materials):
        self.options = options

    def solve_contact(self, gap, longitudinal_curvature, point, wear_compliance=None, warm=None):
        """Raise a TypeError."""
        return len(None)


def faulty_plugin():
    module = ModuleType("faulty_plugin")
    spec = ContactModelSpec("choosy", ChoosyOptions, "a faulty model", factory=Faulty, protocol=2)
    costly = replace(spec, name="costly", reference=True)
    module.wearsim_contact_models = ws.hookimpl(
        lambda: [spec, costly], specname="wearsim_contact_models"
    )
    return module


@pytest.fixture(scope="module")
def plugins(tmp_path_factory):
    """Install the model of the template, and a faulty one."""
    real = manager.entry_points
    point = SimpleNamespace(name="faulty", value="faulty", load=faulty_plugin, dist=None)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "path", sys.path.copy())
        install_template(tmp_path_factory.mktemp("site"))
        patch.setattr(manager, "entry_points", lambda group: [*real(group=group), point])
        registry.cache_clear()
        yield
    sys.modules.pop("wearsim_template", None)
    registry.cache_clear()


@pytest.fixture(scope="module")
def progress():
    return []


@pytest.fixture(scope="module")
def topic(plugins, progress):
    return contact(QUICK, lambda what, part: progress.append((what, part)))


@pytest.mark.usefixtures("topic")
def test_all_models_are_measured_in_all_groups(topic, progress):
    assert topic.groups == GROUPS
    for group in GROUPS:
        named = {item.method.split(",")[0] for item in topic.of(group)}
        assert named == set(compared_models()) >= {"slender", "winkler"}
    parts = [part for _, part in progress]
    assert parts == sorted(parts)
    assert parts[0] == 0.0
    assert parts[-1] < 1.0


@pytest.mark.usefixtures("plugins")
def test_all_choices_of_all_options_are_measured():
    every = methods()
    assert len({method.name for method in every}) == len(every)
    for name in compared_models():
        of_model = [method for method in every if method.model == name]
        options = of_model[0].spec.options
        theories = issubclass(options, TangentialOptions) and name != COMPARISON_MODEL
        for key, info in options.model_fields.items():
            values = {info.default, *get_args(info.annotation)}
            if get_args(info.annotation) and not (
                theories and key in TangentialOptions.model_fields
            ):
                chosen = {getattr(options(**method.options), key) for method in of_model}
                assert chosen >= {value for value in values if isinstance(value, str)}, (name, key)


@pytest.mark.usefixtures("plugins")
def test_choice_is_combined_with_the_choice_it_requires():
    names = [method.name for method in methods("choosy")]
    assert names == [
        "choosy",
        "choosy, shape flat",
        "choosy, shape flat, fine on",
        "slender, strip",
    ]


@pytest.mark.usefixtures("plugins")
def test_reference_is_measured_only_where_it_is_named():
    assert "costly" in registry().names(ContactModelSpec)
    assert "costly" not in {method.model for method in [*methods(), *normal_methods()]}
    assert {method.model for method in methods("costly")} == {"costly", "slender"}


def test_worn_profiles_omit_tangential_choices():
    names = {method.name for method in normal_methods()}
    assert "slender, strip, half length local" in names
    assert "semi-hertzian, kik-piotrowski, strip" in names
    assert {name for name in names if name.startswith("hertz")} == {"hertz, strip", "hertz-fastsim"}


def test_faulty_model_does_not_stop_the_benchmark(topic):
    for item in topic.measurements:
        faulty = item.method.startswith("choosy")
        assert ("raised TypeError: object of type 'NoneType'" in item.failed) == faulty


def test_failed_method_has_a_reason_and_no_numbers(topic):
    refused = [item for item in topic.of("worn profiles") if item.method == "hertz, strip"]
    assert len(refused) == 1
    assert "1 of 2 fail; bump 10um, partial: the gap's fitted curvature" in refused[0].failed
    assert refused[0].seconds is None
    assert not refused[0].errors
    assert "51 to 161 strips" in refused[0].setting


def test_other_methods_have_times_and_errors(topic):
    whole = [item for item in topic.measurements if not item.failed]
    assert len(whole) > len(topic.measurements) / 2
    for item in whole:
        assert item.seconds > 0.0
        assert item.counts["prepare_seconds"] > 0.0
        assert set(item.errors) == set(topic.errors)
        assert min(item.errors.values()) >= 0.0
    json.dumps(topic.as_json(), allow_nan=False)


def test_warm_starts_are_timed_for_models_that_use_them(topic):
    warm = {item.method for item in topic.measurements if "warm_seconds" in item.counts}
    assert warm == {"slender, strip", "slender, strip, half length local"}


def test_warm_start_with_another_result_is_a_failure(monkeypatch):
    solve = slender.Slender.solve

    def depends_on_start(self, batch, wear_compliance=None, coupling=None, warm=None):
        if warm is not None:
            batch = replace(batch, friction=1.01 * batch.friction)
        return solve(self, batch, wear_compliance, coupling, warm)

    monkeypatch.setattr(slender.Slender, "solve", depends_on_start)
    found = measure("draws", elliptic_cases("paper")[:1], Method("slender"), 41, 1)
    assert "the warm start changes the power by 1.0e-02" in found.failed
    assert found.seconds is None


def test_defaults_are_the_strips_of_a_run_and_a_contact(topic):
    scenario = load_scenario(SCENARIOS / "rig-450min.toml")
    setup = draw(scenario)
    of_run = setup.fresh_patch(300.0).b / strips_of_run(setup).spacing
    for group in GROUPS[:2]:
        default = [item for item in topic.of(group) if item.default]
        assert {item.method for item in default} == {"slender, strip"}
        case, strips = (
            elliptic_cases("paper")[0],
            [int(item.setting.split()[0]) for item in default],
        )
        usual, fewer = (
            case.grid(choose_model("slender")),
            case.grid(choose_model("slender"), strips[0]),
        )
        assert [fewer.strips, usual.strips] == strips
        assert case.patch.b / fewer.spacing == pytest.approx(of_run, rel=0.05)


def test_errors_of_a_group_are_those_of_its_contacts():
    cases = elliptic_cases("paper")
    found = measure("draws", cases, Method("hertz"), 50, 1).errors
    whole = random_case_errors(choose_model("hertz", my=50), "paper")
    assert found["power"] == whole.rms
    assert found["worst_power"] == whole.worst
    assert found["dissipation"] == whole.strips
    powers = [solved(choose_model("hertz"), case)[0].power for case in cases]
    exact = [row["P_over_V_N"] for row in rows("rig_random", kind="paper")]
    assert found["worst_power"] == np.abs(np.array(powers) / exact - 1.0).max()


def test_hertz_model_has_exact_pressure_and_width():
    for kind in ("paper", "hard"):
        errors = measure("ellipses", elliptic_cases(kind), Method("hertz"), 81, 1).errors
        assert errors["peak_pressure"] < 1e-12
        assert errors["width"] < 1e-4


def test_steps_along_rolling_equal_the_strips():
    fastsim = Method("hertz", {"tangential": "fastsim"})
    assert fastsim.setting(41) == "41 x 41"
    assert fastsim.choice(41).options.mx == 41
    assert Method("hertz").setting(41) == "41 strips"


def test_errors_decrease_with_the_number_of_strips():
    coarse, fine = (
        measure("worn", list(worn_cases("flat").values()), Method("slender"), strips, 1).errors
        for strips in (41, 321)
    )
    assert fine["dissipation"] < 0.5 * coarse["dissipation"]
    assert fine["width"] < coarse["width"]


def test_nonfinite_value_raises_contact_error():
    case = elliptic_cases("paper")[0]
    solution, grid = solved(choose_model("hertz"), case)
    solution.dissipation[3] = np.nan
    with pytest.raises(ContactError, match="dissipation: not finite"):
        errors_of(solution, grid, case)


@pytest.mark.usefixtures("plugins")
def test_plugin_option_measures_one_model_and_the_default():
    found = contact(Effort(quick=True, repetitions=1, plugin="winkler"), lambda what, part: None)
    assert {item.method for item in found.measurements} == {"winkler", "slender, strip"}


def test_unknown_model_raises_plugin_error():
    with pytest.raises(PluginError, match="'winklerr'"):
        contact(Effort(quick=True, plugin="winklerr"), lambda what, part: None)


def test_solutions_of_a_reference_replace_the_stored_ones():
    effort = Effort(quick=True, repetitions=1, plugin="winkler", against="slender")
    found = contact(effort, lambda what, part: None)
    assert "relative to 'slender'" in found.about
    own = [item for item in found.of("fresh rig") if item.method == "slender, strip"]
    assert min(item.errors["dissipation"] for item in own) < 1e-9
