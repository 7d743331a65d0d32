"""Runs, ensembles, checks and cams with fatigue: records, rows, limits, warnings, sources."""

from __future__ import annotations

import numpy as np
import pytest
from study_examples import PITTING, short

import wearsim
from tests.fixed_batches import batches_of
from tests.studies.ensemble_cases import differences
from wearsim.errors import Interrupted, ScenarioError
from wearsim.mechanics.fatigue import SHEAR_DEPTH, greatest_von_mises
from wearsim.report.csv_files import table_text
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.dry_run import dry_run
from wearsim.studies.dry_run_table import plan
from wearsim.studies.plausibility import plausibility_warnings
from wearsim.studies.run.setup import Setup

FATIGUE: dict[str, object] = {"fatigue": {"slope": 1.125, "cylinder": PITTING, "roller": PITTING}}
COARSE: dict[str, object] = {"evolution.tolerance": 0.01, "evolution.strip_error": False}


@pytest.fixture(scope="module")
def result():
    return wearsim.run(short(**FATIGUE, **COARSE, **{"limit.damage": 1e-4, "limit.pitting": 0.5}))


def test_records_hold_the_damage_of_both_bodies(result):
    cylinder = result.values("cylinder_damage_profile")
    assert cylinder.shape == result.profiles.shape
    assert (np.diff(cylinder.max(axis=1)) > 0.0).all()
    assert cylinder[-1].max() == result.values("cylinder_damage")[-1]
    assert result.values("roller_damage_profile")[-1].max() == result.values("roller_damage")[-1]
    chance = -np.expm1(np.log(0.9) * result.values("damage")[-1] ** 1.125)
    assert result.values("pitting")[-1] == pytest.approx(chance, rel=1e-12)


def test_rows_and_json_state_damage_limits_and_sources(result):
    rows = {row.label: row.text for row in result.view.rows()}
    assert rows["fatigue of the cylinder"] == "pressure-life; source: a test"
    assert rows["limit of damage"].startswith("reached after about")
    assert "0.5000" in rows["limit of pitting"]
    data = result.view.data()
    assert data["damage"] == result.values("damage")[-1]
    assert data["fatigue_sources"] == {"cylinder": "a test", "roller": "a test"}
    assert "fatigue (pitting)" not in result.view.overview().excluded
    assert {"damage", "pitting"} <= result.view.panels().panels.keys()
    tables = {name: "".join(table_text(blocks)) for name, blocks in result.view.columns().items()}
    source = "# fatigue of the cylinder: pressure-life; source: a test\n"
    assert tables["cylinder_damage_profiles.csv"].startswith(source)
    assert tables["history.csv"].startswith(source)
    assert "#" not in tables["cylinder_depth_profiles.csv"]


@pytest.mark.filterwarnings("error")
def test_certain_pitting_is_stated_without_warnings():
    law = {**PITTING, "reference_passes": 1e-3}
    certain = wearsim.run(short(fatigue={"slope": 1.125, "cylinder": law, "roller": law}, **COARSE))
    assert certain.values("pitting")[-1] == 1.0
    (text,) = (row.text for row in certain.view.rows() if row.label == "probability of pitting")
    assert text.startswith("100")
    assert "nan" not in text


def test_scenario_without_fatigue_shows_nothing_of_it():
    plain = wearsim.run(short(**COARSE))
    assert not [name for name in plain.raw.variables if "damage" in name or "pitting" in name]
    assert "damage" not in plain.view.panels().panels
    assert not [row.label for row in plain.view.rows() if "fatigue" in row.label]
    assert "fatigue (pitting)" in plain.view.overview().excluded


def test_run_stops_at_a_damage(result):
    found = wearsim.run(short(**FATIGUE, **COARSE), until="damage 1e-4")
    assert found.values("damage")[-1] == pytest.approx(1e-4, rel=1e-8)
    passes = np.interp(1e-4, result.values("damage"), result.passes)
    assert found.passes[-1] == pytest.approx(passes, rel=2e-2)
    with pytest.raises(ScenarioError, match="needs the fatigue of the bodies"):
        wearsim.run(short(), until="pitting 0.1")
    with pytest.raises(ValueError, match="must be above zero and below one"):
        wearsim.run(short(**FATIGUE), until="pitting 1.5")


def test_ensemble_has_the_damage_of_each_realisation(tmp_path):
    load = {"distribution": "uniform", "low": "250 N", "high": "350 N"}
    scenario = short(**FATIGUE, **COARSE, **{"load.normal_force": load})
    tests = wearsim.ensemble(scenario, 3, tmp_path / "tests.h5", workers=1)
    assert {"damage", "pitting", "roller_damage"} <= set(tests.observables)
    assert "a test" in tests.view.panels().title
    assert tests.view.data()["fatigue_sources"] == {"cylinder": "a test", "roller": "a test"}
    assert any("source: a test" in row.text for row in tests.view.study())
    order = np.argsort(tests.inputs["load.normal_force"])
    assert (np.diff(tests.at_end("damage")[order]) > 0.0).all()
    number = int(order[-1])
    drawn = float(tests.inputs["load.normal_force"][number])
    single = wearsim.run(scenario.changed({"load.normal_force": f"{drawn!r} N"}))
    assert tests.at_end("damage")[number] == pytest.approx(single.values("damage")[-1], rel=1e-3)
    for body in ("cylinder", "roller"):
        kept = tests.kept_values(f"{body}_damage_profile")
        assert kept.max(axis=1) == pytest.approx(tests.at_end(f"{body}_damage"), rel=1e-12)
        last = single.values(f"{body}_damage_profile")[-1].reshape(-1, len(single.y))[0]
        found = np.interp(tests.y, single.y, last)
        np.testing.assert_allclose(kept[number], found, rtol=0.0, atol=1e-2 * last.max())
    table = "".join(table_text(tests.view.columns()["cylinder_damage_profile.csv"]))
    assert "damage mean,damage std" in table
    assert "damage" in tests.view.panels().panels


def test_stopped_ensemble_with_fatigue_equals_unbroken_one(tmp_path, monkeypatch):
    monkeypatch.setattr("wearsim.studies.ensemble.driver.BatchSizes", batches_of(2))
    friction = {"distribution": "uniform", "low": 0.1, "high": 0.2}
    changes = {"fatigue": {"slope": 1.125, "cylinder": PITTING, "roller": PITTING}}
    scenario = shipped_scenario(
        "cam-eccentric",
        {**changes, **COARSE, "friction.coefficient": friction, "operation.passes": 30_000},
    )
    whole = wearsim.ensemble(scenario, 3, tmp_path / "whole.h5", scheduler="serial")
    path, answers = tmp_path / "tests.h5", iter([True])
    with pytest.raises(Interrupted):
        wearsim.ensemble(
            scenario, 3, path, scheduler="serial", stop_requested=lambda: next(answers, True)
        )
    tests = wearsim.resume_ensemble(path, scheduler="serial")
    assert differences(whole, tests) == []
    greatest = tests.at_end("cylinder_damage")
    for name in ("cylinder_damage_profile", "damage_curve"):
        kept = tests.kept_values(name)
        assert kept.min() >= 0.0
        assert kept.max(axis=1) == pytest.approx(greatest, rel=1e-4)
    stored = tests.to_xarray()
    np.testing.assert_allclose(stored["damage_curve_mean"], stored["damage_curve"].mean("kept"))


def test_check_states_pitting_without_wear_and_the_sources():
    data = dry_run(short(**FATIGUE))
    rows = dict(plan(data))
    found = data["pitting_without_wear"]
    pressure = data["initial_patch"]["peak_pressure_Pa"]
    life = 1e6 * (700e6 / pressure) ** 8
    assert found["cylinder_passes"] == pytest.approx(life, rel=1e-2)
    assert found["passes"] < found["cylinder_passes"]
    assert "to a probability of 10 %" in rows["pitting without wear"]
    assert rows["fatigue of the rollers"] == "a test"
    assert "pitting without wear" not in dict(plan(dry_run(short())))


def test_probability_of_pitting_has_the_error_of_the_damage():
    result = wearsim.run(short(**FATIGUE))
    final, slope = result.final, result.scenario.fatigue.slope
    chance, damage, error = (final[name] for name in ("pitting", "damage", "damage_error"))
    exponent = np.log1p(-chance) / damage**slope
    beyond = 1.0 - np.exp(exponent * (damage + error) ** slope)
    (text,) = [row.text for row in result.view.rows() if row.label == "probability of pitting"]
    stated = float(text.removesuffix(" %").split(" ± ")[1]) / 100.0
    assert stated == pytest.approx(beyond - chance, rel=0.1)
    assert final["pitting_error"] == pytest.approx(stated, rel=0.06)  # of two digits


def test_cam_states_lives_and_stresses_at_every_angle():
    changes: dict[str, object] = {"fatigue": {"slope": 1.125, "cylinder": PITTING}}
    study = wearsim.study_cam(shipped_scenario("cam-cycloidal", changes))
    stations = study.view.data()["stations"]
    pressure = stations["peak_pressure_Pa"]
    assert stations["pitting_life_turns"] == pytest.approx(1e6 * (700e6 / pressure) ** 8, rel=1e-12)
    assert stations["orthogonal_shear_Pa"] == pytest.approx(0.25 * pressure, rel=1e-15)
    rows = {row.label: row.text for row in study.view.rows()}
    assert "which decides" in rows["pitting of the cam without wear"]
    assert rows["fatigue of the cam"].endswith("a test")
    motion = "".join(table_text(study.view.columns()["motion.csv"]))
    assert motion.startswith("# fatigue of the cam: pressure-life; source: a test\nangle")
    assert "pitting life [turns]" in motion
    assert "pitting [turns]" in study.view.tables()[0].heads


def test_stress_below_a_line_contact():
    stress, depth = greatest_von_mises(0.3)
    assert stress == pytest.approx(0.558, abs=5e-4)  # Johnson, section 6.1
    assert depth == pytest.approx(0.70, abs=5e-3)
    assert pytest.approx(0.786, abs=2e-4) == SHEAR_DEPTH


@pytest.mark.parametrize(
    ("changes", "warning"),
    [
        ({"friction.coefficient": 0.35}, "above 0.3, a surface in full slip yields first"),
        (
            {"fatigue.cylinder.valid_pressure": ["800 MPa", "2 GPa"]},
            "outside the 800 to 2000 MPa for which the constants hold (a test)",
        ),
        (
            {
                "friction.coefficient": 0.35,
                "cylinder.material": {
                    "youngs_modulus": "200 GPa",
                    "poisson_ratio": 0.3,
                    "yield_stress": "400 MPa",
                },
            },
            "exceeds its shakedown limit, 2.86 times the yield stress in shear, of 659.8 MPa",
        ),
    ],
)
def test_warnings_of_fatigue(changes, warning):
    assert not plausibility_warnings(Setup(short(**FATIGUE)))
    warned = plausibility_warnings(Setup(short(**FATIGUE, **changes)))
    assert any(warning in text for text in warned)


def test_mistakes_of_the_table_name_key_and_remedy():
    body = {**PITTING, "law": "pressure-lif"}
    table = {"slope": 1.1, "scatter": "weakest-link", "cylinder": body}
    with pytest.raises(ScenarioError) as caught:
        short(fatigue=table)
    text = str(caught.value)
    for part in ("did you mean 'pressure-life'", "reference_area: is needed"):
        assert part in text
    with pytest.raises(ScenarioError, match="reference: unknown key"):
        short(fatigue={"slope": 1.1, "reference": 1, "cylinder": PITTING})
    with pytest.raises(ScenarioError, match="no fatigue law is named ''"):
        short(fatigue={"slope": 1.1, "cylinder": {**PITTING, "law": ""}})
    with pytest.raises(ScenarioError, match="a table with law, its constants and their source"):
        short(fatigue={"slope": 1.1})
