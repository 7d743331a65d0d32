"""The table [sampling] of a scenario: plan and correlations."""

# ruff: noqa: E501  (long messages)

from __future__ import annotations

import pytest
from scenario_examples import FORCE_LINE, LOAD, MU, SLACK, WEAR, Parse

from wearsim.errors import ScenarioError

TABLE = ("[wear]", "[sampling]\n{}\n[wear]")


def _sampling(text: str) -> tuple[str, str]:
    return TABLE[0], TABLE[1].format(text)


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
