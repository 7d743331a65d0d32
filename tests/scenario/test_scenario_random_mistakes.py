"""Mistakes in the random inputs of a scenario."""

# ruff: noqa: E501  (long messages)

from __future__ import annotations

import pytest
from scenario_examples import FORCE_LINE, MU, RIG, XI, K, Parse

from wearsim.errors import ScenarioError
from wearsim.scenario import load_scenario

PLACES = (
    "a value; only the values of [load], [friction], [creepage] and [wear], roller.offset, and those"
    " of axial_profile except its length can be random"
)
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
rig.toml: [load.normal_force] persistence: unknown choice (did you mean 'per-pass'?), got "per-pas", expected one of "per-test", "per-roller", "per-pass", "per-turn"
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
    "a table of a number": (
        'radius = "25 mm"',
        "radius = {si = 0.025}",
        'rig.toml: [cylinder] radius: is not a quantity, got a table, expected a length above zero such as "20 mm"',
    ),
    "a table of a number among the options": (
        MU,
        'coefficient = {distribution = "patches", length = {si = 1e-6}, marginal = {distribution = "flat", low = 0, high = 1}}',
        'rig.toml: [friction.coefficient] length: is not a quantity, got a table, expected a length above zero such as "20 mm"',
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


@pytest.mark.parametrize("key", ["wear.cylinder.k_over_h", "roller.offset"])
def test_only_contact_values_can_vary_in_time(key):
    unit = "1/Pa" if "wear" in key else "m"
    marginal = {"distribution": "uniform", "low": f"1e-11 {unit}", "high": f"2e-11 {unit}"}
    process = {"distribution": "ornstein-uhlenbeck", "correlation_time": "1 min"}
    with pytest.raises(ScenarioError, match="varies in time, which only"):
        load_scenario(RIG, {key: {**process, "marginal": marginal}})


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


def test_fields_are_among_the_expected_friction_inputs():
    with pytest.raises(ScenarioError, match=r'"gaussian-field".*"ornstein-uhlenbeck".*"white"'):
        load_scenario(RIG, {"friction.coefficient": {"distribution": "disc", "radius": "1 mrad"}})
