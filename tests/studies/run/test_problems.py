"""Wear problems of several realisations, and the number of times that inputs are drawn."""

import numpy as np
import pytest

import wearsim
from tests.studies.random_examples import LOAD, WANDERING, scenario_of
from wearsim.errors import Interrupted
from wearsim.evolution.contacts import fresh_state
from wearsim.models.random.varying import OrnsteinUhlenbeck
from wearsim.studies.run.assemble import build_problem, prepared_model
from wearsim.studies.run.draws import draw
from wearsim.studies.run.grid import strips_of_run
from wearsim.studies.run.setup import Setup

DRAWN = {
    "offset": np.array([[0.0, 2e-4, -1e-4], [1e-4, 0.0, 3e-4]]),
    "tilt": np.array([[0.0, 3e-4, -2e-4], [1e-4, 0.0, 2e-4]]),
    "friction": np.array([[0.1, 0.12, 0.08]]),
    "normal_force_offset": np.array([[0.0], [20.0]]),
}
CASES = {
    "creepage": {},
    "differential slip": {"creepage__differential_slip": True},
    "tilt that shifts nothing": {
        "creepage__differential_slip": True,
        "creepage__tilt_shifts_contact": False,
    },
    "free rollers": {
        "creepage": {
            "drive": "free",
            "bearing_torque": "0.1 N*m",
            "differential_slip": True,
        }
    },
}


@pytest.mark.parametrize("case", CASES)
def test_realisations_equal_problems_of_one(case):
    scenario = scenario_of(contact__strips=81, contact__width="6 mm", **CASES[case])
    grid = strips_of_run(draw(scenario))
    model = prepared_model(scenario, grid)
    whole = build_problem(Setup(scenario), model, grid, DRAWN, rollers=(0, 1), realisations=3)
    powers = whole.values_of(fresh_state(whole).contacts, "power")
    assert whole.shape == powers.shape == (1, 2, 3)
    assert len(np.unique(powers)) == 6
    for roller, realisation in np.ndindex(2, 3):
        single = {
            name: np.broadcast_to(values, (2, 3))[roller, realisation].reshape(1, 1)
            for name, values in DRAWN.items()
        }
        problem = build_problem(Setup(scenario), model, grid, single, rollers=(roller,))
        assert (problem.nominal_gap[0, 0, 0] == whole.nominal_gap[0, roller, realisation]).all()
        power = problem.values_of(fresh_state(problem).contacts, "power").item()
        assert power == pytest.approx(powers[0, roller, realisation], rel=1e-12)


def test_inputs_that_are_not_drawn_take_no_memory():
    scenario = scenario_of(contact__strips=81)
    grid = strips_of_run(draw(scenario))
    model = prepared_model(scenario, grid)
    friction = {"friction": np.full((1, 1000), 0.1)}
    problem = build_problem(Setup(scenario), model, grid, friction, realisations=1000)
    assert problem.nominal_gap.shape == (1, 1, 1000, 81)
    assert problem.nominal_gap.strides[2] == 0


def test_run_draws_once(tmp_path, monkeypatch):
    drawn = []
    original = OrnsteinUhlenbeck.path

    def counted(*arguments):
        drawn.append(arguments)
        return original(*arguments)

    monkeypatch.setattr(OrnsteinUhlenbeck, "path", counted)
    scenario = scenario_of(load__normal_force={**WANDERING, "marginal": LOAD}, contact__strips=61)
    with pytest.raises(Interrupted):
        wearsim.run(scenario, tmp_path / "a.h5", stop_requested=lambda: True)
    assert len(drawn) == 1
    wearsim.resume(tmp_path / "a.h5", until=2.0 * scenario.total_time)
    assert len(drawn) == 2
