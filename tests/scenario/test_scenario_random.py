"""Random inputs in a scenario: parsing, substitution of values, and overrides."""

# ruff: noqa: E501  (long messages)

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from scenario_examples import FORCE_LINE, FRICTION, LOAD, MU, RIG, SLACK, WEAR, XI, Parse

from wearsim.errors import ScenarioError
from wearsim.quantities import Quantity
from wearsim.scenario import Scenario, load_scenario, parse_override, parse_scenario, realise
from wearsim.units import ANGLE, FORCE


@pytest.fixture
def rig(parse: Parse) -> Scenario:
    return parse(LOAD, FRICTION, SLACK, WEAR)


def test_tables_hold_the_means(rig: Scenario) -> None:
    assert rig.load.options.normal_force == pytest.approx(300.0, rel=1e-12)
    assert rig.friction.coefficient == 0.1
    assert (rig.creepage.yaw, rig.creepage.tilt) == (0.0, 0.0)
    assert rig.wear.options.cylinder.k_over_h == pytest.approx(2e-11, rel=1e-12)
    assert rig.wear.options.roller.k_over_h == 0.0


def test_random_inputs_are_in_the_order_of_their_names(rig: Scenario) -> None:
    assert [(item.name, item.kind, item.role, item.persistence) for item in rig.random] == [
        ("creepage.misalignment", "square", "joint", "per-roller"),
        ("friction.coefficient", "patches", "field", "per-pass"),
        ("load.normal_force", "flat", "scalar", "per-test"),
        ("wear.cylinder.k_over_h", "flat", "scalar", "per-test"),
    ]
    slack, friction, load, _ = rig.random
    assert slack.keys == ("creepage.yaw", "creepage.tilt")
    assert (slack.dimension, load.dimension, friction.dimension) == (2, 1, 0)
    assert (slack.quantity.kind, load.quantity.kind, friction.quantity) == (ANGLE, FORCE, None)


def test_draws_are_in_si(rig: Scenario) -> None:
    slack, friction, load, _ = rig.random
    np.testing.assert_allclose(load.values(np.array([[0.0], [0.75]])), [[200.0], [350.0]])
    np.testing.assert_allclose(slack.values(np.array([[0.0, 1.0]])), [[-2e-3, 2e-3]])
    with pytest.raises(TypeError, match="no single value per draw"):
        friction.values(np.zeros((1, 0)))


def test_random_inputs_are_described_in_engineering_units(rig: Scenario) -> None:
    assert [item.describe() for item in rig.random] == [
        "square, yaw up to 2 mrad, tilt up to 2 mrad, per-roller",
        "patches, length 50 um, frame contact, of bell, mean 0.1, std 0.02, on [0.01, inf), per-pass",
        f"flat, mean 300 N, std {200 / math.sqrt(12):.6g} N, on [200 N, 400 N], per-test",
        f"flat, mean 2e-11 1/Pa, std {2e-11 / math.sqrt(12):.6g} 1/Pa, on [1e-11 1/Pa, 3e-11 1/Pa], per-test",
    ]


def test_sub_tables_and_inline_tables_are_equivalent(parse: Parse, rig: Scenario) -> None:
    table = '[load.normal_force]\ndistribution = "flat"\nlow = "200 N"\nhigh = "0.4 kN"\n'
    other = parse((FORCE_LINE, table), FRICTION, SLACK, WEAR)
    assert [item.describe() for item in other.random] == [item.describe() for item in rig.random]


def test_scenario_without_random_inputs_has_none(parse: Parse) -> None:
    scenario = parse()
    assert (scenario.random, dict(scenario.drawn)) == ((), {})
    assert (scenario.sampling.plan, scenario.sampling.realisation) == ("monte-carlo", 0)


def test_terms_offsets_and_creepages_can_be_random(parse: Parse) -> None:
    flat = '{{distribution = "flat", low = "{}", high = "{}"}}'
    term = f'\n[load.thermal]\ntime_constant = "3 min"\ngain = {flat.format("0 N/W", "8 N/W")}'
    offset = f"offset = {flat.format('-1 mm', '3 mm')}\n"
    torque = f'drive = "free"\nbearing_torque = {flat.format("0 N mm", "1 N mm")}'
    scenario = parse(
        ("[roller]\n", f"[roller]\n{offset}"), (FORCE_LINE, FORCE_LINE + term), (XI, torque)
    )
    assert [item.name for item in scenario.random] == [
        "creepage.bearing_torque",
        "load.thermal.gain",
        "roller.offset",
    ]
    assert scenario.roller.offset == pytest.approx(1e-3)
    assert scenario.load.terms[0].options.gain == pytest.approx(4.0)
    assert scenario.creepage.bearing_torque == pytest.approx(5e-4)


def test_process_is_represented_by_its_marginal_mean(parse: Parse) -> None:
    wander = '{distribution = "wander", time = "3 min", marginal = {distribution = "flat", low = "1 N", high = "3 N"}}'
    scenario = parse((FORCE_LINE, f"normal_force = {wander}"))
    assert scenario.random[0].role == "process"
    assert scenario.load.options.normal_force == pytest.approx(2.0)


def test_distribution_can_read_a_file(parse: Parse) -> None:
    logged = 'normal_force = {distribution = "logged", file = "log.csv"}'
    files = {"log.csv": "value [kN]\n0.1\n0.4\n"}
    scenario = parse((FORCE_LINE, logged), files=files)
    assert scenario.files == files
    assert scenario.load.options.normal_force == 250.0


def test_distribution_warnings_become_notes(parse: Parse) -> None:
    scenario = parse(
        (FORCE_LINE, 'normal_force = {distribution = "flat", low = "3 N", high = "3 N"}')
    )
    assert scenario.notes == ("load.normal_force: has a constant value",)


def test_continuous_support_may_end_at_an_excluded_bound(parse: Parse) -> None:
    scenario = parse((MU, 'coefficient = {distribution = "flat", low = 0, high = 1}'))
    assert scenario.friction.coefficient == pytest.approx(0.5)


def test_realisation_has_the_values_bit_for_bit(rig: Scenario) -> None:
    values = {
        "load.normal_force": 1000.0 / 3.0,
        "creepage.yaw": 1e-3 / 3.0,
        "creepage.tilt": -2e-3 / 7.0,
        "wear.cylinder.k_over_h": 1e-11 / 3.0,
    }
    drawn = realise(rig, values)
    assert drawn.load.options.normal_force == values["load.normal_force"]
    assert (drawn.creepage.yaw, drawn.creepage.tilt) == (1e-3 / 3.0, -2e-3 / 7.0)
    assert drawn.wear.options.cylinder.k_over_h == values["wear.cylinder.k_over_h"]
    assert dict(drawn.drawn) == values
    assert [item.name for item in drawn.random] == ["friction.coefficient"]
    assert drawn.friction.coefficient == 0.1
    assert (drawn.text, drawn.sha256, drawn.seed) == (rig.text, rig.sha256, rig.seed)
    assert rig.load.options.normal_force == pytest.approx(300.0)


@pytest.mark.parametrize("force", [5e-324, 0.1 + 0.2, math.nextafter(300.0, 301.0), 1e22, 1.7e308])
def test_realisation_has_any_float_bit_for_bit(rig: Scenario, force: float) -> None:
    drawn = realise(rig, {"load.normal_force": np.float64(force), "friction.coefficient": force})
    assert drawn.load.options.normal_force == force
    assert drawn.friction.coefficient == force


def test_stepwise_realisation_equals_a_single_one(rig: Scenario) -> None:
    first = realise(realise(rig, {"load.normal_force": 250.0}), {"friction.coefficient": 0.07})
    both = realise(rig, {"friction.coefficient": 0.07, "load.normal_force": 250.0})
    assert dict(first.drawn) == dict(both.drawn)
    assert (first.load, first.friction) == (both.load, both.friction)
    assert [item.name for item in first.random] == [item.name for item in both.random]


def test_value_per_roller_is_a_tuple(rig: Scenario) -> None:
    angles = (1e-3, -1e-3 / 3.0, 2e-3)
    drawn = realise(rig, {"creepage.yaw": angles, "creepage.tilt": angles[::-1]})
    assert (drawn.creepage.yaw, drawn.creepage.tilt) == (angles, angles[::-1])
    with pytest.raises(ScenarioError, match="a list has one value per roller, got 2 values"):
        realise(rig, {"creepage.yaw": angles[:2], "creepage.tilt": angles})


def test_realisation_uses_the_stored_files(parse: Parse) -> None:
    recorded = '[load]\nkind = "recorded"\nfile = "log.csv"\n'
    term = '[load.thermal]\ntime_constant = "3 min"\ngain = {distribution = "flat", low = "0 N/W", high = "8 N/W"}\n'
    files = {"log.csv": "time [s],load [N]\n0,1\n1,2\n"}
    scenario = parse((f"[load]\n{FORCE_LINE}\n", recorded + term), files=files)
    assert realise(scenario, {"load.thermal.gain": 3.0}).load.terms[0].options.gain == 3.0


def test_realisation_values_are_checked(rig: Scenario) -> None:
    with pytest.raises(ScenarioError, match=r"\[load\] normal_force: must be above zero"):
        realise(rig, {"load.normal_force": -1.0})
    with pytest.raises(ScenarioError, match=r"\[friction\] coefficient: must be finite"):
        realise(rig, {"friction.coefficient": math.nan})
    with pytest.raises(ValueError, match=r"no random input sets load\.stiffness; known: creepage"):
        realise(rig, {"load.stiffness": 1.0})
    with pytest.raises(ValueError, match=r"sets creepage\.tilt too"):
        realise(rig, {"creepage.yaw": 1e-3})
    with pytest.raises(ScenarioError) as caught:
        realise(rig, {"wear.cylinder.k_over_h": -2e-11, "load.normal_force": math.inf})
    assert str(caught.value) == (
        'rig.toml: [load] normal_force: must be finite, got "inf N", expected a force above zero such as "300 N"\n'
        'rig.toml: [wear.cylinder] k_over_h: must not be negative, got "-2e-11 1/Pa", expected a wear factor of zero or more such as "1.1e-11 1/Pa"'
    )
    with pytest.raises(
        ScenarioError, match=r"\[creepage\] yaw: is too large an angle, got 0\.2 rad"
    ):
        realise(rig, {"creepage.yaw": 0.2, "creepage.tilt": 0.0})
    with pytest.raises(ScenarioError, match=r"yaw \(entry 2\): must be finite"):
        realise(rig, {"creepage.yaw": (0.0, math.nan, 0.0), "creepage.tilt": 0.0})


def test_realisation_reads_and_writes_no_units(
    rig: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Quantity, "parse", None)
    monkeypatch.setattr(Quantity, "write", None)
    drawn = realise(rig, {"load.normal_force": 250.0, "wear.cylinder.k_over_h": 1e-11})
    assert drawn.load.options.normal_force == 250.0
    assert drawn.wear.options.roller == rig.wear.options.roller


def test_realised_scenario_can_be_pickled(rig: Scenario) -> None:
    drawn = pickle.loads(pickle.dumps(realise(rig, {"load.normal_force": 250.0})))
    assert drawn.load.options.normal_force == 250.0
    assert (drawn.text, dict(drawn.drawn)) == (rig.text, {"load.normal_force": 250.0})


def test_realisation_runs_the_validators_of_a_plugin() -> None:
    low, high = ({"distribution": "uniform", "low": f"{k} ug/J", "high": "6 ug/J"} for k in (1, 5))
    law = {"wear.law": "t-gamma", "wear.cylinder.mild": high, "wear.roller.mild": low}
    text = RIG.read_text().split("[wear]")[0] + "[wear]\n"
    scenario = parse_scenario(text, "rig.toml", {}.__getitem__, law)
    drawn = realise(scenario, {"wear.cylinder.mild": 5.5e-9})
    assert drawn.wear.options.cylinder.mild == 5.5e-9
    assert drawn.wear.options.cylinder.severe == scenario.wear.options.cylinder.severe
    assert [item.name for item in drawn.random] == ["wear.roller.mild"]
    with pytest.raises(ScenarioError) as caught:
        realise(scenario, {"wear.roller.mild": 0.5e-9})
    [mistake] = caught.value.mistakes
    assert (mistake.table, mistake.key) == ("wear", "roller")
    assert mistake.what == "catastrophic wear would begin before severe wear does"


def test_stored_scenario_has_the_same_random_inputs(rig: Scenario) -> None:
    again = parse_scenario(rig.text, rig.file, rig.files.__getitem__)
    assert [item.describe() for item in again.random] == [item.describe() for item in rig.random]


def test_overrides_reach_options_of_a_random_input(parse: Parse) -> None:
    key, value = parse_override("load.normal_force.high=500 N")
    assert parse(LOAD, overrides={key: value}).load.options.normal_force == pytest.approx(350.0)


def test_override_makes_a_value_random_or_fixed(parse: Parse) -> None:
    key, value = parse_override('load.normal_force={distribution="flat", low="1 N", high="3 N"}')
    scenario = parse(overrides={key: value})
    assert [item.name for item in scenario.random] == ["load.normal_force"]
    assert scenario.load.options.normal_force == pytest.approx(2.0)
    assert "# not the diameter" in scenario.text
    table = '[load.normal_force]\ndistribution = "flat"\nlow = "200 N"\nhigh = "0.4 kN"\n'
    for random in (LOAD, (FORCE_LINE, table)):
        plain = parse(random, overrides={"load.normal_force": "350 N"})
        assert (plain.random, plain.load.options.normal_force) == ((), 350.0)


def test_angles_and_misalignment_replace_each_other(parse: Parse) -> None:
    fixed = parse(SLACK, overrides={"creepage.yaw": "1 mrad", "creepage.tilt": "2 mrad"})
    assert (fixed.random, fixed.creepage.yaw, fixed.creepage.tilt) == ((), 1e-3, 2e-3)
    slack = {"distribution": "square", "side": "1 mrad"}
    loose = parse((XI, f'{XI}\nyaw = "1 mrad"'), overrides={"creepage.misalignment": slack})
    assert (len(loose.random), loose.creepage.yaw) == (1, 0.0)


def test_normally_distributed_angle_is_accepted():
    angle = {"distribution": "normal", "mean": "0 rad", "std": "1 mrad"}
    assert load_scenario(RIG, {"creepage.tilt": angle}).random


def test_friction_field_selects_a_capable_contact_model():
    marginal = {"distribution": "uniform", "low": 0.09, "high": 0.11}
    field = {"friction.coefficient": {"distribution": "white", "marginal": marginal}}
    rig = RIG.parent / "mean-contact.toml"
    text = rig.read_text().split("[contact]")[0]
    chosen = parse_scenario(text, "bare.toml", {}.__getitem__, field)
    assert chosen.contact.model == "hertz-fastsim"
    assert any("is a field, white" in note for note in chosen.notes)
    given = parse_scenario(text, "bare.toml", {}.__getitem__, {**field, "contact.model": "slender"})
    assert given.contact.model == "slender"
