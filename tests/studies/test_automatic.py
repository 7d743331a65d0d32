"""Contact model chosen by its estimated error: contact.model = "auto"."""

import numpy as np
import pytest

import wearsim
from tests.benchmarks.calibration import KINDS, MODELS, read
from tests.benchmarks.model_choice import STORED, TOLERANCES, estimates, verified
from wearsim.errors import CapabilityError, Interrupted, ScenarioError
from wearsim.plugins.manager import Registry
from wearsim.scenario import parse_scenario
from wearsim.scenario.examples import scenario_schema, shipped_scenario
from wearsim.studies.automatic import with_chosen_model
from wearsim.studies.contact.estimate import INDICATORS, calibration, indicators_of
from wearsim.studies.dry_run import dry_run

AUTO = {"contact.model": "auto"}


@pytest.fixture
def _without_halfspace(monkeypatch):
    names = Registry.names
    monkeypatch.setattr(
        Registry, "names", lambda self, kind: [n for n in names(self, kind) if n != "halfspace"]
    )


def rig(**changes):
    overrides = AUTO | {key.replace("__", "."): value for key, value in changes.items()}
    return shipped_scenario("rig-450min", overrides)


def test_contact_takes_a_cheap_model_and_says_why():
    study = wearsim.study_contact(rig())
    assert study.model in {"hertz", "semi-hertzian", "slender"}
    assert study.described_model == f"{study.model} (auto)"
    (note,) = study.notes
    assert f"has taken '{study.model}'" in note
    assert "tolerance 3 %" in note


def test_named_model_is_kept_as_it_is():
    scenario = shipped_scenario("rig-450min")
    assert with_chosen_model(scenario, test=True) is scenario


def test_choice_is_kept_in_the_text():
    once = with_chosen_model(rig(), test=True)
    again = parse_scenario(once.text, once.file, once.files.__getitem__)
    assert again.contact.model == once.contact.model == "slender"
    assert again.notes == once.notes
    assert with_chosen_model(again, test=True) is again
    changed = with_chosen_model(again.changed({"load.normal_force": "30 N"}), test=True)
    assert changed.contact.model == "slender"


def test_run_stores_the_choice_and_resumes_with_it(tmp_path):
    short = {"operation__duration": "10 min"}
    whole = wearsim.run(rig(**short), tmp_path / "whole.h5")
    named = wearsim.run(shipped_scenario("rig-450min", {"operation.duration": "10 min"}))
    np.testing.assert_array_equal(whole.depth, named.depth)
    steps = []
    with pytest.raises(Interrupted):
        wearsim.run(
            *(rig(**short), tmp_path / "part.h5"),
            stop_requested=lambda: len(steps) > 8 or steps.append(0),
        )
    resumed = wearsim.resume(tmp_path / "part.h5")
    np.testing.assert_array_equal(resumed.depth, whole.depth)
    assert resumed.model == "slender"
    assert resumed.described_model == "slender (auto)"
    assert resumed.notes == whole.notes
    assert "at the start, after a tenth and at the end" in whole.notes[0]


def test_ensemble_and_check_choose_once(tmp_path):
    scenario = shipped_scenario("rig-ensemble", {**AUTO, "operation.duration": "5 min"})
    tests = wearsim.ensemble(scenario, 2, tmp_path / "tests.h5", scheduler="serial")
    assert tests.described_model == "slender (auto)"
    assert dry_run(scenario)["contact_model"] == "slender (auto)"
    assert "has taken 'slender'" in dry_run(scenario)["notes"][-1]


def test_cam_is_judged_at_all_stations():
    cam = with_chosen_model(shipped_scenario("cam-eccentric", AUTO), test=True)
    assert cam.contact.model == "slender"
    assert "has taken" in wearsim.study_cam(shipped_scenario("cam-eccentric", AUTO)).notes[-1]


def test_exact_theory_is_taken_for_different_materials():
    study = wearsim.study_contact(rig(roller__material="bronze"))
    assert study.model == "halfspace"
    assert "different materials" in study.notes[-1]


@pytest.mark.usefixtures("_without_halfspace")
@pytest.mark.parametrize(
    ("changes", "why", "estimated"),
    [
        ({"contact__tolerance": 1e-4}, "the least estimated error is 0", True),
        ({"roller__crown_radius": "0.2 mm"}, "error is [0-9]", True),
        ({"creepage__differential_slip": True}, "creepage.differential_slip = true is not", False),
        ({"creepage__longitudinal": 1e-5}, "outside the calibrated contacts: ln of", False),
        ({"roller__material": "bronze"}, "different materials .* are not calibrated", False),
    ],
)
def test_without_a_sufficient_model_the_refusal_names_the_remedy(changes, why, estimated):
    with pytest.raises(CapabilityError, match=why) as refusal:
        wearsim.study_contact(rig(**changes))
    assert "pip install ./plugins/wearsim-halfspace" in str(refusal.value)
    assert str(refusal.value).endswith(", name a contact.model")
    assert ("raise the tolerance" in str(refusal.value)) == estimated


def test_friction_field_is_refused():
    scenario = shipped_scenario("paper-monte-carlo")
    field = {
        "distribution": "white",
        "marginal": {"distribution": "uniform", "low": 0.05, "high": 0.15},
    }
    changed = scenario.changed({"friction.coefficient": field, "contact": {"model": "auto"}})
    with pytest.raises(CapabilityError, match=r"friction.coefficient is a field"):
        wearsim.dissipation(changed, 4)


def test_wrong_keys_are_mistakes():
    with pytest.raises(ScenarioError, match=r"tolerence: unknown key .did you mean .tolerance."):
        rig(contact__tolerence=0.1)
    with pytest.raises(ScenarioError, match="tolerance"):
        rig(contact__tolerance=2.0)
    models = str(scenario_schema()["$defs"])
    assert "'const': 'auto'" in models


def test_check_during_a_run_only_warns(monkeypatch):
    monkeypatch.setattr("wearsim.studies.run.in_progress.REFERENCE", "hertz-fastsim")
    short = {"operation__duration": "5 min"}
    warned = wearsim.run(rig(**short))
    assert "P_l(y) differs by" in warned.warnings[0]
    named = wearsim.run(shipped_scenario("rig-450min", {"operation.duration": "5 min"}))
    assert warned.warnings[1:] == named.warnings
    np.testing.assert_array_equal(warned.profiles, named.profiles)


def test_calibration_has_its_provenance():
    table = calibration()
    assert {"date", "command", "software", "reference", "contacts"} <= set(table.provenance)
    assert [item.cost for item in table.models] == sorted(item.cost for item in table.models)
    assert all(1.0 < item.factor < 4.0 for item in table.models)
    assert {(item.model, str(item.options)) for item in table.models} == {
        (name, str(options)) for name, options in MODELS.values()
    }
    assert len(table.mean) == len(INDICATORS)


@pytest.mark.parametrize("tolerance", TOLERANCES)
def test_choice_meets_its_tolerance_on_contacts_kept_apart(tolerance):
    data, table = read([STORED]), calibration()
    assert np.quantile(data["own"], 0.9) < 0.001
    estimated = estimates(data, table)
    sets = {("elliptic", 2): (200, 0.95), ("worn", 2): (20, 0.9), ("worn", 3): (60, 0.95)}
    parts = {
        expected: (data["kind"] == kind) & (data["seed"] == seed)
        for (kind, seed), expected in sets.items()
    }
    for (count, least), part in {**parts, (280, 0.95): data["own"] >= 0.0}.items():
        assert part.sum() == count
        found, _ = verified(data["errors"][part], estimated[part], table, tolerance)
        assert found.met >= least
        assert found.met_unwarned >= least
        assert found.met_alone >= 0.95
        assert found.met > found.constant_met or found.met == 1.0


@pytest.mark.parametrize("number", [3, 57, 121])
def test_stored_contacts_are_those_of_their_seed(number):
    data = read([STORED])
    contact = KINDS["elliptic"](np.random.default_rng([2, number]))
    place = np.flatnonzero((data["kind"] == "elliptic") & (data["number"] == number))[0]
    try:
        solution = contact.solve("slender", {})
    except wearsim.WearsimError:
        solution = contact.solve("hertz", {})
    found = indicators_of(solution, contact.curvature, contact.point)
    np.testing.assert_allclose(found, data["indicators"][place], rtol=1e-6, atol=1e-9)


def test_exact_theory_is_not_taken_for_many_contacts():
    values = {
        "contact": {"model": "auto", "tolerance": 1e-3},
        "creepage": {"drive": "creepage", "longitudinal": 1e-3},
        "operation.turns": 10,
    }
    with pytest.raises(CapabilityError, match=r"for \d+ contacts in each step; .*raise"):
        with_chosen_model(shipped_scenario("cam-groove", values), test=True)
