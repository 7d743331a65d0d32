"""A plan of draws where nothing is drawn is told, once."""

from pathlib import Path

import pytest

from wearsim.scenario import load_scenario

RIG = Path(__file__).parents[2] / "scenarios" / "rig-450min.toml"
RANDOM = {"friction.coefficient": {"distribution": "uniform", "low": 0.08, "high": 0.12}}


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"sampling.plan": "sobol"}, "sampling.plan has no effect: no input is random"),
        (
            {"sampling.plan": "sobol", "sampling.realisation": 3},
            "sampling.plan, sampling.realisation have no effect: no input is random",
        ),
    ],
)
def test_that_a_plan_without_draws_is_told(changes, told):
    assert load_scenario(RIG, changes).notes == (told,)


@pytest.mark.parametrize("changes", [{}, {"sampling.plan": "sobol", **RANDOM}])
def test_that_nothing_is_told_where_a_plan_is_used_or_none_is_given(changes):
    assert not load_scenario(RIG, changes).notes
