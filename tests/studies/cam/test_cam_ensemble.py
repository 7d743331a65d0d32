"""Random cams: stepped in batches, equal to each cam by itself."""

from __future__ import annotations

import numpy as np
import pytest
from cam_text import SCENARIOS

import wearsim
from wearsim.evolution.observables import peak_to_peak
from wearsim.studies.ensemble.batch import batch_groups, joined_problem
from wearsim.studies.ensemble.realisation import RealisationRunner, shared_grid

RANDOM = {
    "coefficient = 0.1": 'coefficient = {distribution = "uniform", low = 0.08, high = 0.12}',
    'yaw = "1 mrad"': 'yaw = {distribution = "normal", mean = "0 mrad", std = "1 mrad", '
    'persistence = "per-roller"}',
    "turns = 1_350_000": "turns = 20_000",
}


def runner(name: str, **changes: str) -> RealisationRunner:
    text = (SCENARIOS / f"cam-{name}.toml").read_text()
    for old, new in (RANDOM | changes).items():
        assert old in text
        text = text.replace(old, new)
    scenario = wearsim.Scenario.from_toml(f"{text}\n[contact]\nstrips = 41\n")
    return RealisationRunner(scenario, "monte-carlo", 4, shared_grid(scenario))


@pytest.mark.parametrize("name", ["cycloidal", "swinging"])
def test_cam_in_a_batch_equals_the_cam_alone(name):
    run = runner(name)
    groups = batch_groups([run.prepare(number, {}) for number in range(3)])
    assert [len(group) for group in groups] == [3]
    together = run(range(3))
    for number, outcome in enumerate(together):
        assert not outcome.error
        alone = run([number])[0]
        for key, value in alone.values.items():
            assert np.array_equal(outcome.values[key], value), key


def test_cams_with_other_skids_are_stepped_alone():
    run = runner("cycloidal", **{'inertia = "2.94e-5 kg m^2"': 'inertia = "3e-3 kg m^2"'})
    groups = batch_groups([run.prepare(number, {}) for number in range(3)])
    assert [len(group) for group in groups] == [1, 1, 1]


def test_lift_error_does_not_depend_on_the_batch():
    run = runner("cycloidal")
    problems = [run.prepare(number, {}).problem for number in range(3)]
    together = joined_problem(problems)
    errors = np.random.default_rng(3).normal(size=(len(together.kinematics.cam.angle), 1, 3))
    spread = peak_to_peak(together.kinematics.cam, errors)
    for number, problem in enumerate(problems):
        own = peak_to_peak(problem.kinematics.cam, errors[..., [number]])
        assert (spread[:, [number]] == own).all()
