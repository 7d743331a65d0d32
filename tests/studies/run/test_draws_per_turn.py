"""Inputs drawn once per turn, for all rollers."""

import numpy as np
import pytest

from tests.studies.random_examples import CREEPAGE, FRICTION, end_of, scenario_of
from wearsim.errors import ScenarioError
from wearsim.evolution.quantities import ContactInputs
from wearsim.studies.run.draws import draw
from wearsim.studies.run.nodes import redrawing

PER_TURN = {**FRICTION, "persistence": "per-turn"}


def drawn(first, count, **inputs):
    scenario = scenario_of(operation__rollers=3, **inputs)
    redraw = redrawing(scenario, draw(scenario).passes)
    return redraw(ContactInputs(*np.zeros((6, count, 1))), first)


def test_rollers_share_the_draw_of_a_turn():
    friction = drawn(0, 12, friction__coefficient=PER_TURN).friction[:, 0]
    turns = friction.reshape(4, 3)
    assert (turns == turns[:, :1]).all()
    assert len(set(turns[:, 0])) == 4
    later = drawn(4, 5, friction__coefficient=PER_TURN).friction[:, 0]
    assert (later == friction[4:9]).all()


def test_draws_per_turn_and_per_pass_can_be_mixed():
    inputs = drawn(
        0,
        6,
        friction__coefficient=PER_TURN,
        creepage__longitudinal={**CREEPAGE, "persistence": "per-pass"},
    )
    assert len(set(inputs.friction[:, 0])) == 2
    assert len(set(inputs.longitudinal[:, 0])) == 6


@pytest.mark.parametrize("rollers", [1, 3])
def test_scatter_of_turns_is_that_of_fewer_draws(rollers):
    variances = []
    for persistence in ("per-pass", "per-turn"):
        _, state = end_of(
            scenario_of(
                operation__rollers=rollers,
                friction__coefficient={**FRICTION, "persistence": persistence},
                contact__strips=41,
                passes=900,
            )
        )
        variances.append(state.scatter[1, 0])
    assert variances[1] == pytest.approx(rollers * variances[0], rel=1e-9)


def test_single_turns_have_the_mean_of_the_expectation():
    inputs = {"friction__coefficient": PER_TURN, "contact__strips": 41, "passes": 900}
    _, expected = end_of(scenario_of(**inputs))
    _, single = end_of(scenario_of(evolution__stepper="per-pass", **inputs))
    difference = np.abs(single.cylinder_depth.max() - expected.cylinder_depth.max())
    assert 0.0 < difference <= expected.depth_error[0]


def test_random_process_has_no_turns():
    process = {
        "distribution": "ornstein-uhlenbeck",
        "correlation_time": "1 min",
        "marginal": FRICTION,
        "persistence": "per-turn",
    }
    with pytest.raises(ScenarioError, match="is not for a process"):
        scenario_of(friction__coefficient=process)
