"""Results of an ensemble's realisations, stepped individually and in batches."""

from dataclasses import replace

import numpy as np
import pytest

from tests.evolution import never
from tests.studies.random_examples import CREEPAGE, FRICTION, LOAD, SLACK, WANDERING, scenario_of
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.integrate import evolve
from wearsim.evolution.observables import errors_of_simultaneous_passes
from wearsim.evolution.steppers.stabilised import StabilisedStepper
from wearsim.studies.ensemble import realisation
from wearsim.studies.ensemble.batch import RealisationRun, batch_groups, observe
from wearsim.studies.ensemble.realisation import profile_axis
from wearsim.studies.run.assemble import assemble_problem, prepared_model
from wearsim.studies.run.draws import Drawer
from wearsim.studies.run.grid import strips_of_run
from wearsim.studies.run.recorder import ERRORS, Recorder
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


def runs_of(count, **changes):
    """Return runs of realisations on common strips."""
    common = {"evolution__tolerance": 1e-2, "outputs__records": 6, "passes": 3000}
    scenario = scenario_of(**{**common, **changes})
    drawer = Drawer(scenario, "monte-carlo")
    draws = [drawer.draw(number) for number in range(count)]
    grids = [strips_of_run(one) for one in draws]
    half = max(float(np.abs(grid.y).max() + grid.spacing) for grid in grids)
    grid = Grid.spanning(-half, half, 71)
    model = prepared_model(scenario, grid)

    def models(scenario, strips):
        return model if strips is grid else prepared_model(scenario, strips)

    built = [assemble_problem(one, grid, models)[:2] for one in draws]
    return [RealisationRun(k, one.values, one, *built[k]) for k, one in enumerate(draws)]


def bits(results):
    """Return all results of a test, for bitwise comparison."""
    return results.rows, results.scalars, results.curves["depth_profile"].tobytes()


@pytest.mark.parametrize("case", list(CASES))
def test_results_are_bitwise_independent_of_the_batch(case):
    runs = runs_of(4, **CASES[case])
    assert len(batch_groups(runs)) == 1
    alone = [bits(observe([run])[0]) for run in runs]
    random = np.random.default_rng(1)
    for size in (4, 3, 2):
        batch = random.permutation(4)[:size].tolist()
        found = observe([runs[k] for k in batch])
        assert [bits(one) for one in found] == [alone[k] for k in batch]


@pytest.mark.parametrize("case", list(CASES))
def test_batched_results_equal_those_of_a_recorded_run(case):
    runs = runs_of(3, **CASES[case], evolution__strip_error=False)
    for run, found in zip(runs, observe(runs), strict=True):
        fresh, stop = fresh_state(run.problem), run.stop
        recorder = Recorder(run.problem, run.stepper, run.schedule, 1e-6, fresh)
        for advance in evolve(run.problem, fresh, run.stepper, stop, never, 10**6):
            recorder.add(advance, stop)
        end = recorder.state
        simultaneous = dict(
            zip(ERRORS, errors_of_simultaneous_passes(run.stepper, run.problem, end), strict=True)
        )
        for name, value in found.scalars.items():
            assert value == getattr(end, name)[0] + simultaneous.get(name, [0.0])[0]
        assert (found.curves["depth_profile"] == end.cylinder_depth[0, 0, 0]).all()
        depths = recorder.records["cylinder_depth_profile"].max(axis=(1, 2, 3))
        assert [row["depth"] for row in found.rows] == depths.tolist()


def test_realisations_are_recorded_at_the_same_passes():
    runs = runs_of(4, **CASES["one contact"])
    found = observe(runs)
    assert len({len(one.rows) for one in found}) == 1
    for one in found:
        depths = [row["depth"] for row in one.rows]
        assert depths[0] == 0.0
        assert (np.diff(depths) > 0.0).all()


def test_incompatible_realisations_are_in_separate_groups():
    runs = runs_of(4, **ONE)
    stepper = StabilisedStepper(runs[0].stepper.tolerance)
    other = runs_of(1, **ONE)[0]  # with separate strips and model
    groups = batch_groups([runs[0], replace(runs[1], stepper=stepper), *runs[2:], other])
    assert [[run.number for run in group] for group in groups] == [[0, 2, 3], [1], [0]]


def test_group_size_is_limited_by_number_of_strips(monkeypatch):
    monkeypatch.setattr("wearsim.studies.ensemble.batch.MAX_STRIPS", 2 * 71)
    groups = batch_groups(runs_of(5, **ONE))
    assert [len(group) for group in groups] == [1, 2, 2]
    assert [run.number for group in groups for run in group] == list(range(5))


def test_failed_realisation_does_not_change_others():
    runs = runs_of(4, **CASES["one contact"])
    heavy = replace(runs[1].problem.inputs, normal_force_offset=np.array([[1e5]]))
    runs[1] = replace(runs[1], problem=replace(runs[1].problem, inputs=heavy))
    found = observe(runs)
    assert str(found[1]).startswith("the contact reaches the edge of its strips")
    for k in (0, 2, 3):
        assert bits(found[k]) == bits(observe([runs[k]])[0])


def test_plugin_error_fails_one_realisation_only(monkeypatch):
    runs = runs_of(3, **ONE)

    class Broken(type(runs[1].problem.loads[0])):
        constant = False

        def __init__(self):
            pass

        def mean(self, start, stop):
            if start > 0.0:
                raise ZeroDivisionError("broken")
            return 300.0

        def force(self, time):
            return np.full_like(time, 300.0)

    runs[1] = replace(runs[1], problem=replace(runs[1].problem, loads=(Broken(),)))
    found = observe(runs)
    assert isinstance(found[1], ZeroDivisionError)
    for k in (0, 2):
        assert bits(found[k]) == bits(observe([runs[k]])[0])


@pytest.mark.parametrize("missing", [set(), {"solve_slender"}])
def test_missing_kernels_are_compiled_by_one_step(missing, monkeypatch):
    taken = []

    class Watched(realisation.Evolution):
        def __iter__(self):
            for advance in super().__iter__():
                taken.append(advance)
                yield advance

    monkeypatch.setattr(realisation, "not_cached", lambda names: missing)
    monkeypatch.setattr(realisation, "Evolution", Watched)
    scenario = scenario_of(1000, load__normal_force=LOAD)
    runner = realisation.RealisationRunner(scenario, "monte-carlo", 4, profile_axis(scenario))
    runner.compile_kernels()
    assert len(taken) == len(missing)
