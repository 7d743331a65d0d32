"""Note on sampling keys without random inputs."""

from pathlib import Path

import pytest

from wearsim.scenario import load_scenario

RIG = Path(__file__).parents[2] / "scenarios" / "rig-450min.toml"
RANDOM = {"friction.coefficient": {"distribution": "uniform", "low": 0.08, "high": 0.12}}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"sampling.plan": "sobol"}, "sampling.plan has no effect: no input is random"),
        (
            {"sampling.plan": "sobol", "sampling.realisation": 3},
            "sampling.plan, sampling.realisation have no effect: no input is random",
        ),
    ],
)
def test_sampling_keys_without_random_inputs_give_a_note(changes, message):
    assert load_scenario(RIG, changes).notes == (message,)


@pytest.mark.parametrize("changes", [{}, {"sampling.plan": "sobol", **RANDOM}])
def test_used_or_absent_sampling_keys_give_no_note(changes):
    assert not load_scenario(RIG, changes).notes
