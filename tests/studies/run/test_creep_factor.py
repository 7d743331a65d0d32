"""Kalker's reduction factor, friction.creep_factor, in contacts and tests of wear."""

import numpy as np
import pytest

import wearsim
from wearsim.errors import CapabilityError, ScenarioError
from wearsim.models.contact.slender import Slender
from wearsim.models.tangential.strip_theory import StripTheory
from wearsim.plugins import ContactModelSpec, Options
from wearsim.scenario.examples import shipped_scenario
from wearsim.scenario.tables.plugin import ContactChoice

FACTOR = "friction.creep_factor"
MODELS = {
    "slender": {"contact.model": "slender"},
    "slender fastrip": {"contact.model": "slender", "contact.tangential": "fastrip"},
    "semi-hertzian": {"contact.model": "semi-hertzian"},
    "hertz": {"contact.model": "hertz"},
    "hertz-fastsim": {"contact.model": "hertz-fastsim"},
}
SHORT = {"operation.duration": "20 s", "outputs.records": 3}


def contact(model: str, creepage: float, factor: float, **options) -> wearsim.ContactStudy:
    changes = MODELS[model] | {"creepage.longitudinal": creepage, FACTOR: factor}
    return wearsim.study_contact(shipped_scenario("rig-450min", changes), **options)


@pytest.mark.parametrize("model", MODELS)
def test_creep_factor_multiplies_initial_slope(model):
    ideal, film = (contact(model, 1e-9, factor).solution.force_x for factor in (1.0, 0.37))
    assert film / ideal == pytest.approx(0.37, rel=1e-6)


@pytest.mark.parametrize("model", MODELS)
def test_creep_factor_leaves_full_slip_unchanged(model):
    ideal, film = (contact(model, 2e-2, factor).solution for factor in (1.0, 0.37))
    assert film.force_x == pytest.approx(ideal.force_x, rel=1e-12)
    np.testing.assert_allclose(film.dissipation, ideal.dissipation, rtol=1e-11)


@pytest.mark.parametrize("model", MODELS)
def test_power_with_creep_factor_is_work_of_rigid_slip(model):
    study = contact(model, 8e-4, 0.37)
    solution, speed = study.solution, study.point.rolling_speed
    assert solution.power == pytest.approx(-speed * 8e-4 * solution.force_x, rel=1e-12)


def test_fields_with_creep_factor_integrate_to_force():
    study = contact("slender", 8e-4, 0.37, with_fields=True)
    fields = study.fields
    assert fields is not None
    lines = np.trapezoid(fields.power_density, fields.x, axis=0)
    power = float(lines.sum()) * (fields.y[1] - fields.y[0])
    assert power == pytest.approx(study.solution.power, rel=0.01)


def test_creep_factor_of_one_changes_no_bit():
    plain = wearsim.run(shipped_scenario("rig-450min", SHORT))
    explicit = wearsim.run(shipped_scenario("rig-450min", {**SHORT, FACTOR: 1.0}))
    for name in ("depth", "power", "worn_volume"):
        np.testing.assert_array_equal(getattr(explicit, name), getattr(plain, name))


def test_pass_loop_takes_creep_factor():
    changes = {"operation.duration": "2 s", "outputs.records": 2, FACTOR: 0.5}
    passes = wearsim.run(
        shipped_scenario("rig-450min", {**changes, "evolution.stepper": "per-pass"})
    )
    steps = wearsim.run(shipped_scenario("rig-450min", {**changes, "evolution.tolerance": 1e-5}))
    ideal = wearsim.run(shipped_scenario("rig-450min", {**changes, FACTOR: 1.0}))
    assert passes.depth[-1] == pytest.approx(steps.depth[-1], rel=2e-3)
    assert passes.depth[-1] < 0.97 * ideal.depth[-1]


def test_free_roller_creeps_more_by_creep_factor():
    free = {"creepage": {"drive": "free", "bearing_torque": "1e-3 N mm"}}
    found = [
        wearsim.solve_contact(shipped_scenario("rig-450min", {**free, FACTOR: factor}))
        for factor in (1.0, 1e-3)
    ]
    ideal, film = (solution.longitudinal_creepage for solution in found)
    assert ideal / film == pytest.approx(1e-3, rel=1e-6)


def test_model_without_creep_factor_is_refused_by_name(monkeypatch):
    class Ideal(Slender):
        capabilities = wearsim.plugins.Capabilities()

    def factory(options, grid, materials):
        return Ideal(StripTheory(), grid, materials)

    spec = ContactModelSpec("ideal", Options, "takes no creep factor", factory=factory, protocol=2)
    monkeypatch.setattr(ContactChoice, "spec", property(lambda self: spec))
    with pytest.raises(
        CapabilityError, match=r"does not support friction.creep_factor = 0\.5; cho"
    ):
        wearsim.solve_contact(shipped_scenario("rig-450min", {FACTOR: 0.5}))


@pytest.mark.parametrize("value", [0.0, 1.2, -0.5])
def test_creep_factor_beyond_its_range_is_refused(value):
    with pytest.raises(ScenarioError, match="creep_factor"):
        shipped_scenario("rig-450min", {FACTOR: value})


def test_random_creep_factor_is_refused():
    scattered = {"distribution": "uniform", "low": 0.5, "high": 0.9}
    with pytest.raises(ScenarioError, match="creep_factor: cannot be random"):
        shipped_scenario("rig-450min", {FACTOR: scattered})


def test_reference_model_takes_creep_factor():
    changes = {FACTOR: 0.4, "creepage.longitudinal": 1e-3}
    study = wearsim.study_contact(shipped_scenario("rig-450min", changes), against="semi-hertzian")
    assert abs(study.errors.power) < 0.01


def test_free_roller_of_a_cam_wears_with_creep_factor():
    turns = {"operation.turns": 2000, "outputs.records": 2, "creepage.drive": "free"}
    free = {**turns, "creepage": {"drive": "free", "bearing_torque": "20 N mm"}}
    del free["creepage.drive"]
    ideal, film = (
        wearsim.run(shipped_scenario("cam-eccentric", {**free, FACTOR: factor}))
        for factor in (1.0, 0.01)
    )
    # the torque is balanced by the same tractions, at a hundred times the creepage
    assert film.power[0] / ideal.power[0] == pytest.approx(100.0, rel=0.02)


def test_ensemble_with_creep_factor_equals_single_runs(tmp_path):
    changes = {
        **SHORT,
        FACTOR: 0.5,
        "friction.coefficient": {"distribution": "uniform", "low": 0.08, "high": 0.12},
    }
    scenario = shipped_scenario("rig-450min", changes)
    tests = wearsim.ensemble(scenario, 3, tmp_path / "tests.h5", workers=1)
    single = wearsim.run(scenario.changed({"sampling.realisation": 2}))
    assert tests.values("depth")[2, -1] == single.depth[-1]
