"""Random inputs in a scenario: parsing, mistakes, and substitution of values."""

# ruff: noqa: E501  (long messages)

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scenario_examples import Parse

from wearsim.errors import ScenarioError
from wearsim.scenario import Scenario, load_scenario, parse_override, parse_scenario, realise
from wearsim.units import ANGLE, FORCE

RIG = Path(__file__).parents[2] / "scenarios" / "rig-450min.toml"

FORCE_LINE = 'normal_force = "300 N"'
MU = "coefficient = 0.1"
XI = "longitudinal = 1e-3"
K = 'k_over_h = "1.1e-11 1/Pa"'

LOAD = (FORCE_LINE, 'normal_force = {distribution = "flat", low = "200 N", high = "0.4 kN"}')
FRICTION = (
    MU,
    'coefficient = {distribution = "patches", length = "50 um", persistence = "per-pass", marginal = {distribution = "bell", mean = 0.1, std = 0.02, support = [0.01, "inf"]}}',
)
SLACK = (
    XI,
    f'{XI}\nmisalignment = {{distribution = "square", side = "4 mrad", persistence = "per-roller"}}',
)
WEAR = (K, 'k_over_h = {distribution = "flat", low = "1e-11 1/Pa", high = "3e-11 1/Pa"}')
TABLE = ("[wear]", "[sampling]\n{}\n[wear]")


def _sampling(text: str) -> tuple[str, str]:
    return TABLE[0], TABLE[1].format(text)


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


# --- substituted values


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
def test_any_float_survives_conversion_to_text(rig: Scenario, force: float) -> None:
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


def test_stored_scenario_has_the_same_random_inputs(rig: Scenario) -> None:
    again = parse_scenario(rig.text, rig.file, rig.files.__getitem__)
    assert [item.describe() for item in again.random] == [item.describe() for item in rig.random]


# --- overrides


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


# --- sampling


def test_sampling_holds_plan_and_correlations(parse: Parse) -> None:
    text = 'plan = "sobol"\nrealisation = 7\ncorrelation = [["load.normal_force", "wear.cylinder.k_over_h", -0.5]]'
    table = parse(LOAD, WEAR, _sampling(text)).sampling
    assert (table.plan, table.realisation) == ("sobol", 7)
    assert table.correlation == (("load.normal_force", "wear.cylinder.k_over_h", -0.5),)


PROCESS = (MU, 'coefficient = {distribution = "flat", low = 0, high = 1, persistence = "per-pass"}')
SAMPLING_MISTAKES = {
    "an unknown plan": (
        (),
        'plan = "sobl"\nrealisation = -1',
        """\
rig.toml: [sampling] plan: unknown choice (did you mean 'sobol'?), got "sobl", expected one of "monte-carlo", "latin-hypercube", "sobol"
rig.toml: [sampling] realisation: is out of range, got -1, expected a whole number of at least 0""",
    ),
    "unknown inputs": (
        (LOAD,),
        'correlation = [["load.normal_forc", "friction.coefficient", 0.5]]',
        """\
rig.toml: [sampling] correlation (entry 1): 'load.normal_forc' is not a random input (did you mean 'load.normal_force'?)
rig.toml: [sampling] correlation (entry 1): 'friction.coefficient' is not a random input (known: load.normal_force)""",
    ),
    "different persistences, and inputs of several numbers": (
        (LOAD, PROCESS, SLACK),
        'correlation = [["load.normal_force", "friction.coefficient", 0.5], ["load.normal_force", "creepage.misalignment", 0.1]]',
        """\
rig.toml: [sampling] correlation (entry 1): needs two random inputs of the same persistence, got per-test and per-pass
rig.toml: [sampling] correlation (entry 2): 'creepage.misalignment' is a joint, and only single numbers can be correlated, got "square"
rig.toml: [sampling] correlation (entry 2): needs two random inputs of the same persistence, got per-test and per-roller""",
    ),
    "a correlation above one, and one without a number": (
        (LOAD, WEAR),
        'correlation = [["load.normal_force", "wear.cylinder.k_over_h", 1.5], ["load.normal_force", "x"]]',
        """\
rig.toml: [sampling] correlation (entry 1) (entry 3): is out of range, got 1.5, expected less than or equal to 1
rig.toml: [sampling] correlation (entry 2) (entry 3): is missing""",
    ),
}


@pytest.mark.parametrize("case", SAMPLING_MISTAKES)
def test_sampling_mistakes_are_reported(parse: Parse, case: str) -> None:
    changes, text, message = SAMPLING_MISTAKES[case]
    with pytest.raises(ScenarioError) as caught:
        parse(*changes, _sampling(text))
    assert str(caught.value) == message


def test_inconsistent_correlations_are_mistakes(parse: Parse) -> None:
    flat = (MU, 'coefficient = {distribution = "flat", low = 0, high = 1}')
    a, b, c = "friction.coefficient", "load.normal_force", "wear.cylinder.k_over_h"
    triangle = f"correlation = {[[a, b, 0.9], [b, c, 0.9], [a, c, -0.9]]}"
    with pytest.raises(ScenarioError, match=r"\[sampling\] correlation: .*not positive definite"):
        parse(LOAD, WEAR, flat, _sampling(triangle))
    twice = f"correlation = {[[a, b, 0.9], [b, a, 0.9]]}"
    with pytest.raises(ScenarioError, match=r"\[sampling\] correlation: .*is given twice"):
        parse(LOAD, WEAR, flat, _sampling(twice))


def test_invalid_input_is_reported_once(parse: Parse) -> None:
    text = 'correlation = [["load.normal_force", "wear.cylinder.k_over_h", 0.5]]'
    with pytest.raises(ScenarioError) as caught:
        parse((FORCE_LINE, 'normal_force = {distribution = "flt"}'), WEAR, _sampling(text))
    assert len(caught.value.mistakes) == 1


# --- mistakes

PLACES = "a value; only the values of [load], [friction], [creepage] and [wear], and roller.offset can be random"
CONTACT = "load.normal_force, friction.coefficient, creepage.longitudinal, creepage.bearing_torque, creepage.yaw, creepage.tilt, creepage.misalignment"
MISTAKES = {
    "an unknown distribution": (
        FORCE_LINE,
        'normal_force = {distribution = "bel", mean = "3 N"}',
        "rig.toml: [load.normal_force] distribution: no random input is named 'bel'; known: bell, flat, logged, pair, patches, square, wander; did you mean 'bell'?",
    ),
    "a distribution that is not text": (
        FORCE_LINE,
        "normal_force = {distribution = 3}",
        "rig.toml: [load.normal_force] distribution: is not text, got 3, expected text",
    ),
    "options that are wrong, missing, misplaced and misspelt": (
        FORCE_LINE,
        'normal_force = {distribution = "bell", men = "3 N", std = "3 m", low = "3 N", persistance = "per-pass", persistence = "per-pas"}',
        """\
rig.toml: [load.normal_force] persistence: unknown choice (did you mean 'per-pass'?), got "per-pas", expected one of "per-test", "per-roller", "per-pass"
rig.toml: [load.normal_force] mean: is missing, expected a force such as "300 N"
rig.toml: [load.normal_force] std: wrong dimension, got "3 m" (a length), expected a force above zero such as "300 N"
rig.toml: [load.normal_force] men: unknown key (did you mean 'mean'?)
rig.toml: [load.normal_force] low: unknown key (it belongs in a random input with distribution = "flat")
rig.toml: [load.normal_force] persistance: unknown key (did you mean 'persistence'?)""",
    ),
    "infeasible moments": (
        MU,
        'coefficient = {distribution = "bell", mean = 2, std = 0.2, support = [0, 1]}',
        "rig.toml: [friction.coefficient]: the mean is outside the support, got 2, expected one inside",
    ),
    "an unbounded distribution of a force": (
        FORCE_LINE,
        'normal_force = {distribution = "bell", mean = "307 N", std = "32 N"}',
        'rig.toml: [load] normal_force: takes values down to -inf, and must be above 0, got bell, mean 307 N, std 32 N, on (-inf, inf), per-test, expected maxent with support ["0 N", "inf"] or truncated-normal',
    ),
    "a distribution that includes an excluded bound": (
        MU,
        'coefficient = {distribution = "bell", mean = 0.01, std = 0.2, support = [0, 1]}',
        'rig.toml: [friction] coefficient: takes values down to 0, and must be above 0, got bell, mean 0.01, std 0.2, on [0, 1], per-test, expected maxent with support [0, "inf"] or truncated-normal',
    ),
    "a marginal below zero": (
        MU,
        'coefficient = {distribution = "patches", length = "1 um", marginal = {distribution = "bell", mean = 1, std = 2}}',
        'rig.toml: [friction] coefficient: takes values down to -inf, and must be above 0, got patches, length 1 um, frame contact, of bell, mean 1, std 2, on (-inf, inf), per-test, expected maxent with support [0, "inf"] or truncated-normal',
    ),
    "a radius": (
        'radius = "25 mm"',
        'radius = {distribution = "flat"}',
        f"rig.toml: [cylinder] radius: cannot be random, got a table with a distribution, expected {PLACES}",
    ),
    "a seed": (
        "seed = 3",
        'seed = {distribution = "flat"}',
        f"rig.toml: seed: cannot be random, got a table with a distribution, expected {PLACES}",
    ),
    "a choice": (
        FORCE_LINE,
        f'kind = {{distribution = "flat"}}\n{FORCE_LINE}',
        f"rig.toml: [load] kind: cannot be random, got a table with a distribution, expected {PLACES}",
    ),
    "a whole table": (
        'cylinder = { k_over_h = "1.1e-11 1/Pa" }',
        'cylinder = { distribution = "flat" }',
        f"rig.toml: [wear] cylinder: cannot be random, got a table with a distribution, expected {PLACES}",
    ),
    "an entry of a list": (
        XI,
        f'{XI}\nyaw = ["1 mrad", {{distribution = "flat"}}, "2 mrad"]',
        'rig.toml: [creepage] yaw (entry 2): cannot be random, got a table, expected one random input for all rollers, with persistence = "per-roller" to differ',
    ),
    "a misspelt value": (
        FORCE_LINE,
        f'{FORCE_LINE}\nnormal_forse = {{distribution = "flat"}}',
        "rig.toml: [load] normal_forse: unknown key (did you mean 'normal_force'?)",
    ),
    "a field of loads": (
        FORCE_LINE,
        'normal_force = {distribution = "patches"}',
        'rig.toml: [load.normal_force] distribution: varies within the contact, which only friction.coefficient can, got "patches", expected one of "bell", "flat", "logged", "wander"',
    ),
    "a field without a marginal": (
        MU,
        'coefficient = {distribution = "patches", length = "3"}',
        """\
rig.toml: [friction.coefficient] marginal: is missing, expected a table with a distribution and its options
rig.toml: [friction.coefficient] length: needs a unit, got "3", expected a length above zero such as "20 mm\"""",
    ),
    "an unknown marginal": (
        MU,
        'coefficient = {distribution = "patches", length = "3 um", marginal = {distribution = "bll"}}',
        "rig.toml: [friction.coefficient.marginal] distribution: no random input is named 'bll'; known: bell, flat, logged, pair, patches, square, wander; did you mean 'bell'?",
    ),
    "a marginal with mistakes": (
        MU,
        'coefficient = {distribution = "patches", length = "3 um", marginal = {distribution = "bell", men = 1, std = 1, persistence = "per-pass"}}',
        """\
rig.toml: [friction.coefficient.marginal] persistence: belongs in [friction.coefficient], not in its marginal, got "per-pass"
rig.toml: [friction.coefficient.marginal] mean: is missing, expected a number
rig.toml: [friction.coefficient.marginal] men: unknown key (did you mean 'mean'?)""",
    ),
    "a process as the marginal": (
        MU,
        'coefficient = {distribution = "patches", length = "3 um", marginal = {distribution = "wander"}}',
        'rig.toml: [friction.coefficient.marginal] distribution: is a process, but a marginal is the distribution of one number, got "wander", expected one of "bell", "flat", "logged"',
    ),
    "a marginal that is no table": (
        MU,
        'coefficient = {distribution = "patches", length = "3 um", marginal = 3}',
        "rig.toml: [friction.coefficient] marginal: is not a table, got 3, expected a table",
    ),
    "a marginal that is empty": (
        MU,
        'coefficient = {distribution = "patches", length = "3 um", marginal = {}}',
        'rig.toml: [friction.coefficient.marginal] distribution: is missing, expected one of "bell", "flat", "logged"',
    ),
    "a marginal of a scalar": (
        MU,
        'coefficient = {distribution = "flat", low = 0, high = 1, marginal = {distribution = "flat"}}',
        "rig.toml: [friction.coefficient] marginal: is only for a field or a process; 'flat' is neither",
    ),
    "a process per pass": (
        MU,
        'coefficient = {distribution = "wander", time = "3 s", persistence = "per-pass", marginal = {distribution = "flat", low = 0, high = 1}}',
        'rig.toml: [friction.coefficient] persistence: is not for a process, which runs through the whole test, got "per-pass", expected "per-test" or "per-roller"',
    ),
    "a wear factor per pass": (
        K,
        'k_over_h = {distribution = "flat", low = "0 1/Pa", high = "1 1/Pa", persistence = "per-pass"}',
        f'rig.toml: [wear.cylinder.k_over_h] persistence: is only for {CONTACT}, got "per-pass", expected "per-test"',
    ),
    "a wear factor per roller": (
        K,
        'k_over_h = {distribution = "flat", low = "0 1/Pa", high = "1 1/Pa", persistence = "per-roller"}',
        f'rig.toml: [wear.cylinder.k_over_h] persistence: is only for {CONTACT}, roller.offset, got "per-roller", expected "per-test"',
    ),
    "an offset per pass": (
        "[roller]\n",
        '[roller]\noffset = {distribution = "flat", low = "0 m", high = "1 mm", persistence = "per-pass"}\n',
        f'rig.toml: [roller.offset] persistence: is only for {CONTACT}, got "per-pass", expected "per-test" or "per-roller"',
    ),
    "a scalar misalignment": (
        XI,
        f'{XI}\nmisalignment = {{distribution = "flat", low = "0 rad", high = "1 mrad"}}',
        'rig.toml: [creepage.misalignment] distribution: sets one value, but creepage.misalignment sets yaw and tilt, got "flat", expected one of "pair", "square"',
    ),
    "a misalignment that is not random": (
        XI,
        f'{XI}\nmisalignment = "2 mrad"',
        'rig.toml: [creepage] misalignment: is not a random input, got "2 mrad", expected a table such as {distribution = "disc", radius = "2 mrad"}',
    ),
    "a misalignment with other components": (
        XI,
        f'{XI}\nmisalignment = {{distribution = "pair", side = "2 mrad"}}',
        'rig.toml: [creepage.misalignment] distribution: sets left and right, got "pair", expected a distribution of yaw and tilt',
    ),
    "a misalignment and angles": (
        XI,
        f'{XI}\nyaw = "1 mrad"\nmisalignment = {{distribution = "square", side = "2 mrad"}}\ntilt = {{distribution = "flat", low = "0 rad", high = "1 mrad"}}',
        """\
rig.toml: [creepage] yaw: is set by misalignment already, got "1 mrad", expected one of the two
rig.toml: [creepage] tilt: is set by misalignment already, got a table, expected one of the two""",
    ),
    "a joint input for one angle": (
        XI,
        f'{XI}\nyaw = {{distribution = "square", side = "2 mrad"}}',
        'rig.toml: [creepage.yaw] distribution: sets several values together, which only creepage.misalignment can, got "square", expected one of "bell", "flat", "logged", "wander"',
    ),
    "a missing file": (
        FORCE_LINE,
        'normal_force = {distribution = "logged", file = "gone.csv"}',
        'rig.toml: [load.normal_force] file: the file cannot be read, got "gone.csv"',
    ),
    "a file with mistakes": (
        FORCE_LINE,
        'normal_force = {distribution = "logged", file = "log.csv"}',
        "rig.toml: [load.normal_force] file: log.csv line 1: column 'value': wrong dimension, got m (a length), expected a unit of force such as N",
    ),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_random_input_mistake_is_reported_in_full(parse: Parse, case: str) -> None:
    good, bad, message = MISTAKES[case]
    with pytest.raises(ScenarioError) as caught:
        parse((good, bad), files={"log.csv": "value [m]\n1\n2\n"})
    assert str(caught.value) == message


def test_mistakes_of_all_random_inputs_are_reported_together(parse: Parse) -> None:
    with pytest.raises(ScenarioError) as caught:
        parse(
            (FORCE_LINE, 'normal_force = {distribution = "flt"}'),
            (MU, 'coefficient = {distribution = "flat", low = -1, high = 1}'),
            (K, 'k_over_h = {distribution = "flat", low = 3, high = "1 1/Pa"}'),
            ('"1000 rpm"', '"1000 mm"'),
        )
    assert [(mistake.table, mistake.key) for mistake in caught.value.mistakes] == [
        ("operation", "speed"),
        ("load.normal_force", "distribution"),
        ("friction", "coefficient"),
        ("wear.cylinder.k_over_h", "low"),
    ]


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("creepage.tilt", "90 deg", "1.571 rad"),
        ("creepage.yaw", ["0 rad", "-0.2 rad", "0 rad"], "0.2 rad"),
        ("creepage.misalignment", {"distribution": "disc", "radius": "90 deg"}, "1.571 rad"),
        (
            "creepage.tilt",
            {"distribution": "uniform", "low": "0 rad", "high": "0.2 rad"},
            "0.2 rad",
        ),
    ],
)
def test_angle_that_is_not_small_is_a_mistake(key, value, message):
    with pytest.raises(ScenarioError, match="too large an angle") as caught:
        load_scenario(RIG, {"operation.rollers": 3, key: value})
    assert message in str(caught.value)


def test_normally_distributed_angle_is_accepted():
    angle = {"distribution": "normal", "mean": "0 rad", "std": "1 mrad"}
    assert load_scenario(RIG, {"creepage.tilt": angle}).random


@pytest.mark.parametrize("key", ["wear.cylinder.k_over_h", "roller.offset"])
def test_only_contact_values_can_vary_in_time(key):
    unit = "1/Pa" if "wear" in key else "m"
    marginal = {"distribution": "uniform", "low": f"1e-11 {unit}", "high": f"2e-11 {unit}"}
    process = {"distribution": "ornstein-uhlenbeck", "correlation_time": "1 min"}
    with pytest.raises(ScenarioError, match="varies in time, which only"):
        load_scenario(RIG, {key: {**process, "marginal": marginal}})


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


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        (
            "load.normal_force",
            {"distributon": "normal", "mean": "300 N", "std": "30 N"},
            "[load.normal_force] distributon: unknown key (did you mean 'distribution'?)",
        ),
        (
            "creepage.longitudinal",
            {"mean": 1e-3, "std": 1e-4},
            "[creepage.longitudinal] distribution: is missing, expected the name of a random input",
        ),
        (
            "friction.coefficient",
            {"distribution": "constant", "value": -1},
            "[friction] coefficient: must be above 0, got -1, expected a value above 0",
        ),
    ],
)
def test_table_without_distribution_is_a_mistake(key, value, message):
    with pytest.raises(ScenarioError) as caught:
        load_scenario(RIG, {key: value})
    assert str(caught.value).endswith(message)


def test_expected_multiple_is_reported():
    with pytest.raises(ScenarioError, match="expected a multiple of 4 of at least 4"):
        load_scenario(RIG, {"evolution.nodes": 6})


def test_fields_are_among_the_expected_friction_inputs():
    with pytest.raises(ScenarioError, match=r'"gaussian-field".*"ornstein-uhlenbeck".*"white"'):
        load_scenario(RIG, {"friction.coefficient": {"distribution": "disc", "radius": "1 mrad"}})
