"""RealisationRunner of an ensemble: what is observed of each, alone and together."""

from dataclasses import replace

import numpy as np
import pytest

from tests.studies.random_examples import CREEPAGE, FRICTION, LOAD, SLACK, WANDERING, scenario_of
from wearsim.evolution.steppers.rkl2 import StabilisedStepper
from wearsim.studies.ensemble.batch import RealisationRun, batch_groups, observe, observe_single
from wearsim.studies.run.assemble import assemble_problem, prepared_model, strips_of_run
from wearsim.studies.run.draws import Drawer
from wearsim.types import Grid

ONE = {"load__normal_force": LOAD, "friction__coefficient": FRICTION}
WEAR = {"distribution": "lognormal", "median": "2e-9 1/Pa", "factor": 1.5}
CASES = {
    "one contact": {**ONE, "creepage__longitudinal": CREEPAGE, "k_over_h": WEAR},
    "three rollers": {**ONE, "creepage__misalignment": {**SLACK, "persistence": "per-roller"}},
    "process": {**ONE, "load__normal_force": {**WANDERING, "marginal": LOAD}},
    "process of each roller": {
        "friction__coefficient": {**WANDERING, "marginal": FRICTION, "persistence": "per-roller"}
    },
}


def members_of(count, **changes):
    """Return realisations on strips that hold them all, ready to be run."""
    common = {"evolution__tolerance": 1e-2, "outputs__records": 6, "passes": 3000}
    scenario = scenario_of(**{**common, **changes})
    drawer = Drawer(scenario, "monte-carlo")
    draws = [drawer.draw(number) for number in range(count)]
    grids = [strips_of_run(one) for one in draws]
    half = max(float(np.abs(grid.y).max() + grid.spacing) for grid in grids)
    grid = Grid.spanning(-half, half, 71)
    model = prepared_model(scenario, grid)
    built = [assemble_problem(one.scenario, grid, one, model)[:2] for one in draws]
    return [RealisationRun(k, one.values, one, *built[k]) for k, one in enumerate(draws)]


def bits(found):
    """Return everything that was observed, to the last bit."""
    return found.rows, found.scalars, found.profile.tobytes()


@pytest.mark.parametrize("case", list(CASES))
def test_that_what_is_observed_is_the_same_to_the_bit_in_any_company(case):
    members = members_of(6, **CASES[case])
    assert len(batch_groups(members)) == 1
    alone = [bits(observe([member])[0]) for member in members]
    random = np.random.default_rng(1)
    for size in (6, 4, 2):
        company = random.permutation(6)[:size].tolist()
        found = observe([members[k] for k in company])
        assert [bits(one) for one in found] == [alone[k] for k in company]


@pytest.mark.parametrize("case", list(CASES))
def test_that_a_member_together_is_the_run_of_itself(case):
    members = members_of(3, **CASES[case])
    for member, found in zip(members, observe(members), strict=True):
        run = observe_single(member)
        assert found.scalars == pytest.approx(run.scalars, rel=1e-9)
        assert found.profile == pytest.approx(run.profile, rel=1e-11, abs=1e-300)
        assert len(found.rows) == len(run.rows)
        for row, expected in zip(found.rows, run.rows, strict=True):
            assert row == pytest.approx(expected, rel=1e-11)


def test_that_members_are_recorded_at_the_same_passes():
    members = members_of(4, **CASES["one contact"])
    found = observe(members)
    assert len({len(one.rows) for one in found}) == 1
    for one in found:
        depths = [row["depth"] for row in one.rows]
        assert depths[0] == 0.0
        assert (np.diff(depths) > 0.0).all()


def test_that_members_that_differ_in_more_than_inputs_go_apart():
    members = members_of(4, **ONE)
    stepper = StabilisedStepper(members[0].stepper.control)
    other = members_of(1, **ONE)[0]  # on strips and with a model of its own
    groups = batch_groups([members[0], replace(members[1], stepper=stepper), *members[2:], other])
    assert [[member.number for member in group] for group in groups] == [[0, 2, 3], [1], [0]]


def test_that_a_group_is_no_larger_than_its_strips_allow(monkeypatch):
    monkeypatch.setattr("wearsim.studies.ensemble.batch.MAX_STRIPS", 2 * 71)
    assert [len(group) for group in batch_groups(members_of(5, **ONE))] == [2, 2, 1]


def test_that_a_member_that_fails_leaves_the_others_as_they_are():
    members = members_of(4, **CASES["one contact"])
    heavy = replace(members[1].problem.inputs, normal_force_offset=np.array([[1e5]]))
    members[1] = replace(members[1], problem=replace(members[1].problem, inputs=heavy))
    found = observe(members)
    assert str(found[1]).startswith("the contact reaches the edge of its strips")
    for k in (0, 2, 3):
        assert bits(found[k]) == bits(observe([members[k]])[0])


def test_that_a_plugin_that_breaks_ends_its_own_member_alone(monkeypatch):
    members = members_of(3, **ONE)

    class Broken(type(members[1].problem.load)):
        def __init__(self):
            pass

        def mean(self, start, stop):
            if start > 0.0:
                raise ZeroDivisionError("broken")
            return 300.0

        def force(self, time):
            return np.full_like(time, 300.0)

    members[1] = replace(members[1], problem=replace(members[1].problem, load=Broken()))
    found = observe(members)
    assert isinstance(found[1], ZeroDivisionError)
    for k in (0, 2):
        assert bits(found[k]) == bits(observe([members[k]])[0])
