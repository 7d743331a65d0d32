"""Tests stepped together: results independent of the batch, failures, compatibility."""

from dataclasses import replace

import numpy as np
import pytest

from tests.evolution import SCENARIOS, built, never, stepped
from wearsim.errors import ContactError, StepError
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.integrate import Evolution, bisect_failures
from wearsim.models.contact.slender import Slender
from wearsim.scenario import load_scenario
from wearsim.studies.ensemble.batch import can_step_together, compatible, joined_problem
from wearsim.studies.run.assemble import assemble_problem, prepared_model
from wearsim.studies.run.draws import draw

PASSES = 20_000
LOG = "time [min], load [N]\n0, 300\n5, 340\n6, 280\n15.5, 320\n"
EACH = [
    {"wear__cylinder__k_over_h": "1.1e-11 1/Pa"},
    {"wear__cylinder__k_over_h": "5e-11 1/Pa", "friction__coefficient": 0.13},
    {"creepage__longitudinal": 2e-4},
    {"friction__coefficient": 0.06, "creepage__longitudinal": 3e-4},
    {"wear__cylinder__k_over_h": "9e-11 1/Pa", "creepage__longitudinal": 2e-3},
]
CASES = {
    "one contact": {},
    "spring": {"load__kind": "spring", "load__stiffness": "690 N/mm"},
    "three rollers": {"creepage__tilt": ["1 mrad", "-0.5 mrad", "2 mrad"]},
    "both wear": {
        "wear__roller__k_over_h": "1.1e-11 1/Pa",
        "roller__offset": ["0 mm", "0.5 mm", "1 mm"],
    },
    "differential slip": {"creepage__differential_slip": True},
}


def problems_of(changes, each=EACH):
    """Return problems that share strips and model, their stepper and their passes."""
    common = {"operation__passes": PASSES, "contact__strips": 61}
    common |= {"contact__width": "22 mm", "evolution__tolerance": 1e-2}
    problems, grid, model = [], None, None
    for own in each:
        overrides = {k.replace("__", "."): v for k, v in {**common, **changes, **own}.items()}
        scenario = load_scenario(SCENARIOS / "rig-450min.toml", overrides=overrides)
        if model is None:
            grid = assemble_problem(draw(scenario))[0].grid
            model = prepared_model(scenario, grid)
        problem, stepper, _ = assemble_problem(draw(scenario), grid, lambda *_, model=model: model)
        problems.append(problem)
    return problems, stepper, float(scenario.total_passes)


def ends_of(problems, stepper, stop, max_steps=10**6):
    """Step tests together, or apart if they cannot start; return end state or error of each."""

    def step(places):
        return _ends_of([problems[place] for place in places], stepper, stop, max_steps)

    done, failed = bisect_failures(step, np.arange(len(problems)))
    for places, found in done:
        failed |= dict(zip(places.tolist(), found, strict=True))
    return [failed[place] for place in range(len(problems))]


def _ends_of(problems, stepper, stop, max_steps):
    problem = joined_problem(problems)
    tests = Evolution(problem, fresh_state(problem), stepper, stop, max_steps, never)
    ends = {}
    for advance in tests:
        for place in np.flatnonzero(advance.end.passes >= stop):
            ends[int(advance.numbers[place])] = advance.end.at(np.array([place]))
    ends |= tests.failures
    return [ends[number] for number in range(len(problems))]


def bits(found):
    """Return all arrays of the end of a test as bytes, or its error."""
    if isinstance(found, Exception):
        return type(found), str(found)
    return {name: array.tobytes() for name, array in found.to_arrays().items()}


@pytest.mark.parametrize("case", list(CASES))
def test_results_are_equal_to_the_bit_in_any_batch(case):
    problems, stepper, stop = problems_of(CASES[case])
    alone = [bits(ends_of([problem], stepper, stop)[0]) for problem in problems]
    for batch in ([0, 1, 2, 3, 4], [4, 2], [3, 1, 0], [1, 1, 1, 4, 0, 2, 3, 3]):
        found = ends_of([problems[k] for k in batch], stepper, stop)
        assert [bits(one) for one in found] == [alone[k] for k in batch]


@pytest.mark.parametrize("case", list(CASES))
def test_batched_test_equals_single_run(case):
    problems, stepper, stop = problems_of(CASES[case])
    for problem, end in zip(problems, ends_of(problems, stepper, stop), strict=True):
        assert bits(end) == bits(stepped(problem, stepper, stop)[0])


def test_tests_have_individual_step_counts():
    problems, stepper, stop = problems_of({})
    assert len({int(end.steps[0]) for end in ends_of(problems, stepper, stop)}) > 1


def test_recorded_load_follows_the_time_of_each_test(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(LOG)
    problems, stepper, stop = problems_of({"load": {"kind": "recorded", "file": str(path)}})
    together = ends_of(problems, stepper, stop)
    for problem, found in zip(problems, together, strict=True):
        assert bits(found) == bits(ends_of([problem], stepper, stop)[0])
        run, _ = stepped(problem, stepper, stop)
        assert bits(found) == bits(run)


def test_failures_are_isolated_with_their_own_message():
    fails = [{"wear__cylinder__k_over_h": "4e-9 1/Pa"}, {"load__normal_force": "90 kN"}]
    each = [EACH[0], fails[0], EACH[3], fails[1], EACH[1]]
    problems, stepper, stop = problems_of({}, each)
    found = ends_of(problems, stepper, stop)
    assert [isinstance(one, Exception) for one in found] == [False, True, False, True, False]
    for problem, one in zip(problems, found, strict=True):
        assert bits(one) == bits(ends_of([problem], stepper, stop)[0])
        if isinstance(one, Exception):
            with pytest.raises((StepError, ContactError)) as failure:
                stepped(problem, stepper, stop)
            assert str(failure.value) == str(one)


def test_max_steps_applies_to_each_test():
    problems, stepper, stop = problems_of({})
    most = sorted(int(end.steps[0]) for end in ends_of(problems, stepper, stop))[2]
    found = ends_of(problems, stepper, stop, most)
    failed = [one for one in found if isinstance(one, Exception)]
    assert 0 < len(failed) < len(problems)
    assert all(f"{most} steps have reached pass" in str(one) for one in failed)


class Recording(Slender):
    """Model that records the sizes of its batches."""

    def __init__(self, model):
        vars(self).update(vars(model))
        self.sizes = []

    def solve(self, batch, *args, **kwargs):
        self.sizes.append(len(batch))
        return super().solve(batch, *args, **kwargs)


@pytest.fixture
def recorded():
    """Problems of a recording model, their stepper and passes, and the sizes of its batches."""
    problems, stepper, stop = problems_of({})
    model = Recording(problems[0].model)
    return [replace(problem, model=model) for problem in problems], stepper, stop, model.sizes


def test_tests_without_failures_are_solved_in_one_batch(recorded):
    problems, stepper, stop, sizes = recorded
    ends = ends_of(problems, stepper, stop)
    assert max(sizes) == len(problems)
    # every step begins with all tests in progress
    steps = [int(end.steps[0]) for end in ends]
    assert sizes.count(len(problems)) >= min(steps)
    assert len(sizes) < sum(steps)


def test_converged_realisations_are_not_solved_again(recorded):
    problems, stepper, stop, sizes = recorded
    ends_of(problems, stepper, stop)
    together = sum(sizes)
    sizes.clear()
    for problem in problems:
        ends_of([problem], stepper, stop)
    assert together == sum(sizes)


def test_plain_test_can_be_stepped_with_others():
    problem, stepper, _ = built()
    assert can_step_together(problem, stepper)


@pytest.mark.parametrize(
    "changes",
    [
        {"evolution__stepper": "stabilised"},
        {"evolution__stepper": "per-pass"},
        {"load__thermal": {"gain": "0.1 N/W", "time_constant": "1 min"}},
    ],
    ids=["stabilised", "per-pass", "load term"],
)
def test_unsupported_tests_are_stepped_alone(changes):
    problem, stepper, _ = built(**changes)
    assert not can_step_together(problem, stepper)


def test_only_compatible_tests_are_joined():
    (one, other), _, _ = problems_of({}, EACH[:2])
    assert compatible(one, other)
    assert not compatible(one, replace(other, iteration_tolerance=2.0 * other.iteration_tolerance))
    faster = replace(other.kinematics, rolling_speed=2.0 * other.kinematics.rolling_speed)
    assert not compatible(one, replace(other, kinematics=faster))
    assert not compatible(one, built()[0])


def test_bisection_isolates_failures():
    done = []

    def work(places):
        if {3, 6} & set(places.tolist()):
            raise StepError(f"fails: {places.tolist()}")
        done.append(places.tolist())
        return places * 10

    parts, failed = bisect_failures(work, np.arange(8))
    assert {place: str(error) for place, error in failed.items()} == {
        3: "fails: [3]",
        6: "fails: [6]",
    }
    assert np.concatenate([places for places, _ in parts]).tolist() == [0, 1, 2, 4, 5, 7]
    assert all((made == 10 * places).all() for places, made in parts)
    assert len(done) == 4


@pytest.mark.parametrize("named", [[2, 5], [2], [], [9]])
def test_failures_that_are_named_are_processed_apart(named):
    parts = []

    def work(places):
        parts.append(places.tolist())
        failing = {2, 5} & set(places.tolist())
        if failing:
            known = [k for k, place in enumerate(places.tolist()) if place in named] or named
            raise StepError("fails", places=known)
        return places

    done, failed = bisect_failures(work, np.arange(8))
    assert failed.keys() == {2, 5}
    assert sorted(np.concatenate([places for places, _ in done]).tolist()) == [0, 1, 3, 4, 6, 7]
    if named == [2, 5]:
        assert parts == [[*range(8)], [0, 1, 3, 4, 6, 7], [2, 5], [2], [5]]


def test_joined_problem_can_be_split():
    problems, _, _ = problems_of(CASES["three rollers"])
    joined = joined_problem(problems)
    states = fresh_state(joined)
    for k, problem in enumerate(problems):
        one = joined.at(np.array([k]))
        assert (one.laws, one.loads) == (problem.laws, problem.loads)
        assert (one.flat_gap == problem.flat_gap).all()
        assert (one.inputs.friction == problem.inputs.friction).all()
        assert bits(states.at(np.array([k]))) == bits(fresh_state(problem))
