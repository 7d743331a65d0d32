"""Specific wear rates of handbooks as wear factors of a scenario."""

import numpy as np
import pytest

import wearsim
from wearsim.errors import ScenarioError
from wearsim.scenario.examples import shipped_scenario

RATE = {"specific_wear_rate": "1e-5 mm^3/(N m)", "measured_friction": 0.5}


def rig(cylinder, **changes):
    return shipped_scenario("rig-450min", {"wear.cylinder": cylinder, **changes})


def test_rate_is_divided_by_measured_friction():
    assert rig(RATE).wear.options.cylinder.wear_factor == pytest.approx(2e-14, rel=1e-15)


def test_sliding_test_wears_rate_times_load_times_distance():
    """A test in full slip with the friction of the measurement returns the handbook's volume."""
    changes = {
        "friction.coefficient": 0.5,
        "creepage.longitudinal": 0.04,
        "operation.duration": "60 s",
        "operation.rollers": 1,
        "outputs.records": 2,
    }
    scenario = rig(RATE, **changes)
    result = wearsim.run(scenario)
    distance = 0.04 * scenario.rolling_speed * 60.0
    assert result.worn_volume[-1] == pytest.approx(1e-14 * 300.0 * distance, rel=1e-9, abs=0.0)


def test_rate_and_wear_factor_give_equal_runs():
    short = {"operation.duration": "30 s", "outputs.records": 2}
    by_rate = wearsim.run(rig(RATE, **short))
    by_factor = wearsim.run(rig({"k_over_h": "2e-14 1/Pa"}, **short))
    assert by_rate.depth[-1] == by_factor.depth[-1]


def test_other_numbers_are_drawn_beside_a_rate(tmp_path):
    scattered = {"distribution": "uniform", "low": 0.4, "high": 0.6}
    scenario = rig(RATE, **{"friction.coefficient": scattered, "operation.duration": "10 s"})
    factor = {"distribution": "lognormal", "median": 1.0, "factor": 1.5}
    scattered_rate = scenario.changed({"wear.factor": factor})
    tests = wearsim.ensemble(scattered_rate, 3, tmp_path / "tests.h5", scheduler="serial")
    drawn = tests.drawn_numbers(["wear.factor"])["wear.factor"]
    assert len(np.unique(drawn)) == 3


@pytest.mark.parametrize(
    ("cylinder", "message"),
    [
        ({**RATE, "k_over_h": "1e-14 1/Pa"}, "cylinder: gives the wear factor twice, got k_over_h"),
        ({"specific_wear_rate": "1e-5 mm^3/(N m)"}, "measured_friction is missing"),
        ({"measured_friction": 0.5}, "specific_wear_rate is missing"),
        ({**RATE, "measured_friction": 0}, "measured_friction is not a coefficient of friction"),
        ({**RATE, "measured_friction": "0.5"}, 'friction, got "0.5", expected a number above 0'),
        ({**RATE, "specific_wear_rate": "1e-5 mm"}, "wrong dimension"),
        ({**RATE, "specific_wear_rate": "-1 mm^3/(N m)"}, "must not be negative"),
        ({}, "k_over_h: is missing, expected a wear factor"),
        ({**RATE, "friction": 0.3}, "unknown key"),
    ],
)
def test_mistake_of_a_rate_is_one_clear_line(cylinder, message):
    with pytest.raises(ScenarioError) as caught:
        rig(cylinder)
    lines = [line for line in str(caught.value).splitlines() if "wear" in line]
    assert len(lines) == 1
    assert message in lines[0]


def test_random_rate_is_refused():
    random = {"distribution": "uniform", "low": "1e-5 mm^3/(N m)", "high": "2e-5 mm^3/(N m)"}
    with pytest.raises(ScenarioError, match="specific_wear_rate: cannot be random"):
        rig({**RATE, "specific_wear_rate": random})


@pytest.mark.parametrize("unit", ["mm^3/(N m)", "mm³/(N·m)", "mm^3/Nm", "m^3/(N m)", "mm^2/N"])
def test_unit_of_a_rate_under_wear_factor_gives_a_note(unit):
    notes = rig({"k_over_h": f"1e-5 {unit}"}).notes
    assert [note for note in notes if "wear.cylinder.specific_wear_rate" in note]


@pytest.mark.parametrize("unit", ["1/Pa", "mm^3/J", "1/MPa", "m^3/J", "mm^3/(W s)"])
def test_unit_of_a_wear_factor_gives_no_note(unit):
    assert not rig({"k_over_h": f"1e-11 {unit}"}).notes
