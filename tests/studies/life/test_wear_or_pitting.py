"""Lives that end by wear or by pitting: the table, limits of damage, and reasons."""

from __future__ import annotations

import math

import numpy as np
import pytest

import wearsim
from wearsim.report.text import rounded_lives
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.fatigue.lives import competing_risks, lives_of, other_end
from wearsim.studies.life.settings import with_limits
from wearsim.studies.opening import export_csv

RIG = shipped_scenario
FATIGUE = {
    "slope": 1.125,
    "cylinder": {
        "law": "pressure-life",
        "source": "invented for a test",
        "reference_passes": 1e6,
        "reference_pressure": "900 MPa",
        "exponent": 8.0,
    },
}
CHANGES: dict[str, object] = {
    "fatigue": FATIGUE,
    "contact.strips": 61,
    "contact.width": "18 mm",
    "evolution.tolerance": 1e-2,
    "evolution.strip_error": False,
}


@pytest.fixture(scope="module")
def lives():
    return wearsim.life(RIG("rig-life", CHANGES), 6, workers=1)


def test_life_with_both_is_shorter_than_with_either(lives):
    assert lives_of(lives, 0.1)["without_pitting"] == lives.b(10)
    found = {name: life.value for name, life in lives_of(lives, 0.1).items()}
    assert lives.is_exact
    assert found["both"] < min(found["without_wear"], found["without_pitting"])
    assert found["without_pitting"] == pytest.approx(lives.b(10).value, rel=1e-3)
    assert math.isinf(found["pitting"])  # the groove lowers the pressure before


def test_incidences_add_up_and_are_shown_with_their_source(lives):
    level = competing_risks(lives).at(math.inf)
    assert level.survival == 0.0
    assert level.pitting + level.wear == pytest.approx(1.0, abs=1e-12)
    assert 0.0 < level.pitting < 0.1
    view = lives.view
    text = [row.text for row in view.study()]
    assert any("invented for a test" in line for line in text)
    (table,) = [item for item in view.details() if "at last" in item.heads]
    rows = {row[0]: row for row in table.rows}
    assert rows["pitting first"][1] == "infinite"
    data = view.data()["wear_or_pitting"]
    low, high = data["intervals"]["b10"]["both"]
    assert low < data["lives"]["b10"]["both"] < high
    assert f"[{rounded_lives(low, high)[0]}.." in rows["wear or pitting"][1]
    assert data["first_by_pitting"] == level.pitting
    assert data["sources"] == {"cylinder": "invented for a test"}


def test_figure_shows_incidences_of_wear_pitting_and_both_with_the_source(lives):
    sheet = lives.view.panels()
    assert "invented for a test" in sheet.title
    assert all("wear or pitting" in row for row in sheet.rows)
    curves = {mark.label: mark for mark in sheet.panels["wear or pitting"].marks}
    assert list(curves) == ["wear first", "pitting first", "both"]
    wear, pitting, both = (mark.y for mark in curves.values())
    assert wear + pitting == pytest.approx(both, abs=1e-12)
    assert both[[0, -1]] == pytest.approx([1e-3, 0.999], rel=1e-6)
    assert pitting[-1] == pytest.approx(competing_risks(lives).at(math.inf).pitting, rel=1e-2)


def test_tables_of_lives_state_the_source_above(lives, tmp_path):
    export_csv(lives, tmp_path, decimal=",")
    source = "# fatigue of the cylinder: pressure-life; source: invented for a test"
    for name in ("realisations.csv", "courses.csv"):
        first, head, *_ = (tmp_path / name).read_text().splitlines()
        assert first == source
        assert "damage" in head
    assert "#" not in (tmp_path / "profile.csv").read_text()


def test_course_of_the_damage_is_that_of_a_run(lives):
    number = int(lives.numbers[0])
    drawn = {key: float(values[0]) for key, values in lives.inputs.items()}
    passes, factor = float(lives.values("course_end")[0]), lives.settings.reference
    scenario = RIG("rig-life", CHANGES).changed(
        {
            "load.normal_force": f"{drawn['load.normal_force']!r} N",
            "friction.coefficient": drawn["friction.coefficient"],
            "wear.cylinder.k_over_h": f"{factor!r} 1/Pa",
            "operation.passes": round(passes),
        }
    )
    run = wearsim.run(scenario)
    assert number == 0
    found = lives.values("damage_course")[0]
    assert found[-1] == pytest.approx(run.values("damage")[-1], rel=1e-2)
    middle = np.interp(0.1 * passes, run.passes, run.values("damage"))
    assert found[-21] == pytest.approx(middle, rel=1e-2)


def test_lives_beyond_the_censoring_are_not_known():
    """A test that ends at the maximum number of passes does not show that a share never fails."""
    changes = {**CHANGES, "wear.cylinder.k_over_h": "1.1e-11 1/Pa"}
    found = wearsim.life(RIG("rig-life", changes), 3, most=2e5, workers=1)
    assert found.censored == 3
    for name, life in lives_of(found, 0.1).items():
        assert math.isnan(life.value) == (name != "without_wear"), name
    (table,) = [item for item in found.view.details() if "at last" in item.heads]
    cells = {row[0]: row[1] for row in table.rows}
    assert cells["wear or pitting"] == cells["pitting first"] == "above 200,000"


def test_posterior_gives_lives_without_intervals(lives, tmp_path):
    rows = ["median [1/Pa],scatter,weight", "1.0e-11,0.3,2", "1.3e-11,0.5,1"]
    (tmp_path / "K.csv").write_text("\n".join(rows))
    for life in lives_of(lives.with_posterior(tmp_path / "K.csv"), 0.1).values():
        assert (life.low, life.high) == (0.0, math.inf)


def test_limit_of_damage_ends_lives_which_are_then_counted():
    found = wearsim.life(
        RIG(
            "rig-life",
            # limits are located to a hundredth of the tolerance
            {**CHANGES, "limit": {"depth": "50 um", "damage": 2e-4}, "evolution.tolerance": 1e-4},
        ),
        2,
        workers=1,
    )
    assert not found.is_exact
    assert "damage depends on the wear factor and on the passes" in found.settings.reason
    assert found.first_limits["damage"] == 1.0
    assert found.at_end("damage") == pytest.approx([2e-4] * 2, rel=1e-5)


def test_limit_of_damage_alone_is_no_wear_in_the_table_and_figure():
    found = wearsim.life(RIG("rig-life", {**CHANGES, "limit": {"damage": 2e-4}}), 2, workers=1)
    (table,) = [item for item in found.view.details() if "at last" in item.heads]
    names = [row[0] for row in table.rows]
    assert names == [
        "a limit of damage or pitting",
        "pitting, of bodies that do not wear",
        "a limit of damage, of bodies that do not pit",
        "pitting first",
        "a limit of damage first",
    ]
    (ends,) = [row.text for row in found.view.study() if row.label == "first end"]
    assert "by pitting and" in ends
    assert "by a limit of damage within" in ends
    assert found.view.data()["wear_or_pitting"]["other_end"] == "a limit of damage"
    panel = found.view.panels().panels["wear or pitting"]
    assert "wear" not in panel.title + panel.caption + "".join(mark.label for mark in panel.marks)


def test_wear_is_named_beside_a_limit_of_pitting():
    limited = with_limits(RIG("rig-life", {"fatigue": FATIGUE}), ["pitting 0.1"])
    assert other_end(limited) == "wear or a limit of pitting"


def test_limits_without_a_unit_are_given_as_texts():
    limits = ["damage=2e-4", "pitting 0.1"]
    limited = with_limits(RIG("rig-life", {"fatigue": FATIGUE}), limits)
    assert limited.limit.given == {"depth": 50e-6, "damage": 2e-4, "pitting": 0.1}


def test_limit_of_damage_needs_fatigue():
    with pytest.raises(wearsim.ScenarioError, match=r"\[limit\] damage: needs the fatigue"):
        RIG("rig-450min", {"limit.damage": 1.0})
