"""Sampling plans against each other: laws whose truth is known, and the studies that are timed."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ndtr

from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.ensemble.api import ensemble
from wearsim.studies.ensemble.control_variate import closed_form_depths
from wearsim.studies.run.draws import Drawer
from wearsim.uq.sampling.plans import PLANS, REPLICATES
from wearsim.uq.sampling.sampler import Sampler
from wearsim_bench.measure.measurement import Effort
from wearsim_bench.sampling.errors import MEAN, PROBABILITY, QUANTILE, Study, Truth, truths
from wearsim_bench.sampling.jobs import CheapDraws, Part, rig
from wearsim_bench.sampling.topic import (
    DEFAULT,
    METHODS,
    QUICK,
    Size,
    measurements,
    sampling,
    studies_of,
)

pytestmark = pytest.mark.bench

LOW, HIGH, FACTOR = 0.08, 0.12, 1.5
SIZE = Size((16, 64, 256), 16)


@pytest.fixture(scope="module")
def full_slip():
    """Return studies of the closed form of full slip, two of whose inputs are drawn.

    The control is the closed form at the mean friction: what one of the inputs does.
    """
    found = {}
    for asked in SIZE.studies:
        scenario = shipped_scenario(
            "rig-450min",
            {
                "seed": asked.seed,
                "friction.coefficient": {"distribution": "uniform", "low": LOW, "high": HIGH},
                "wear.cylinder.k_over_h": {
                    "distribution": "lognormal",
                    "median": "1e-11 1/Pa",
                    "factor": FACTOR,
                },
            },
        )
        columns = Drawer(scenario, asked.plan, asked.tests).columns(0, asked.tests)
        depths = closed_form_depths(scenario, columns, asked.tests)
        at_mean = {**columns, "friction.coefficient": np.full(asked.tests, 0.5 * (LOW + HIGH))}
        controls = closed_form_depths(scenario, at_mean, asked.tests)
        known = full_slip_depth(scenario, 0.5 * (LOW + HIGH)) * mean_factor()
        for part in asked.parts:
            own = slice(part.first, part.first + part.count)
            found[part] = np.array([depths[own], controls[own]])
        found[SIZE.controls[asked.replicate]] = np.array([known, 0.0])
    return scenario, studies_of(SIZE, found)


def full_slip_depth(scenario, friction):
    """Return the depth at the median wear factor [m]."""
    worn = friction * 1e-3 * 1e-11 * 300.0
    crown = 2.0 * scenario.roller.crown_radius
    return (0.75 * worn * scenario.total_passes / np.sqrt(crown)) ** (2.0 / 3.0)


def mean_factor():
    """Return the mean of K/H^(2/3), by that of its median, as a log-normal law has it."""
    return np.exp(0.5 * (2.0 / 3.0 * np.log(FACTOR)) ** 2)


def exact(scenario):
    """Return mean and quantile of the depth by quadrature over friction [m]."""

    def averaged(function):
        return quad(function, LOW, HIGH, epsabs=0.0)[0] / (HIGH - LOW)

    def below(depth):
        return averaged(
            lambda friction: ndtr(
                1.5 * np.log(depth / full_slip_depth(scenario, friction)) / np.log(FACTOR)
            )
        )

    mean = mean_factor() * averaged(lambda friction: full_slip_depth(scenario, friction))
    quantile = brentq(lambda depth: below(depth) - PROBABILITY, 0.5 * mean, 3.0 * mean, xtol=1e-15)
    return {MEAN: mean, QUANTILE: quantile}


def test_that_all_tests_together_tell_what_quadrature_does(full_slip):
    scenario, studies = full_slip
    found = truths([study for some in studies.values() for study in some])
    for group, value in exact(scenario).items():
        assert 0.0 < found[group].error < 4e-3 * value
        assert abs(found[group].value - value) < 4.0 * found[group].error


@pytest.fixture(scope="module")
def rows(full_slip):
    """Return what is measured of the closed form, with the truth exact."""
    scenario, studies = full_slip
    known = {group: Truth(value, 0.0) for group, value in exact(scenario).items()}
    return list(measurements(SIZE, studies, known, {}))


def test_that_errors_are_those_of_the_theory_of_each_plan(full_slip, rows):
    _, studies = full_slip
    errors = {(row.group, row.method, row.setting): row.errors["error"] for row in rows}
    depths = np.concatenate([study.depths for study in studies["monte-carlo", 256]])
    spread = float(depths.std() / depths.mean())
    for tests in SIZE.tests:
        plain, hypercube, sobol, control = (
            errors[MEAN, method, f"n = {tests}"] for method in METHODS.values()
        )
        expected = spread / np.sqrt(tests)
        chance = 1.0 / np.sqrt(2.0 * SIZE.replicates * SIZE.tests[-1] / tests)
        assert plain == pytest.approx(expected, rel=4.0 * chance)
        assert max(hypercube, control) < 0.5 * expected
        # of 16 points each of the independent sequences has but two; then they gain more and more
        assert sobol < {16: 0.8, 64: 0.4, 256: 0.2}[tests] * expected


def test_that_intervals_hold_the_truth_as_often_as_they_say(rows):
    (row,) = (
        row
        for row in rows
        if (row.group, row.method, row.setting) == (MEAN, "Monte Carlo", "n = 16")
    )
    assert row.counts["studies"] == 16 * SIZE.replicates
    assert row.counts["held"] == pytest.approx(0.95, abs=0.05)


def test_that_it_is_said_how_well_an_error_is_known(rows):
    found = [row.counts for row in rows if (row.group, row.method) == (MEAN, "Monte Carlo")]
    for counts in found:
        # the mean of n squares of a normal error is known to sqrt(2/n), its root to half of that
        assert counts["known"] == pytest.approx(np.sqrt(0.5 / counts["studies"]), rel=0.7)
    assert [counts["studies"] for counts in found] == [
        SIZE.replicates * SIZE.tests[-1] / tests for tests in SIZE.tests
    ]


def test_that_every_block_of_a_sobol_study_is_spread_as_evenly_as_the_first():
    sampler = Sampler(3, [("load.normal_force", 1)], "sobol", replicates=REPLICATES)
    uniform = sampler.uniforms(0, 512)["load.normal_force"][:, 0]
    whole = Study(0, uniform, uniform, (0.5, 0.0))
    for block in whole.blocks(128):
        for replicate in range(REPLICATES):
            cells = np.sort(np.floor(16 * block.depths[replicate::REPLICATES]))
            np.testing.assert_array_equal(cells, np.arange(16))
    assert sum(len(block.depths) for block in whole.blocks(128)) == 512


def test_that_no_two_studies_share_a_seed():
    seeds = [asked.seed for asked in QUICK.studies]
    assert len(set(seeds)) == len(seeds)
    assert {asked.plan for asked in QUICK.studies} == set(PLANS)


def test_that_tests_are_those_of_an_ensemble(tmp_path):
    found = Part("monte-carlo", seed=0, total=512, first=1, count=2).done()
    result = ensemble(rig(0), 3, tmp_path / "e.h5", plan="control-variate", scheduler="serial")
    np.testing.assert_array_equal(found[0], result.at_end("depth")[1:])
    np.testing.assert_array_equal(found[1], result.values("control")[1:])
    mean, error = CheapDraws(0, 100_000).done()
    assert abs(mean - result.raw.control["mean"]) < 4.0 * error


@pytest.mark.slow
def test_that_every_plan_and_size_is_measured():
    told = []
    topic = sampling(Effort(quick=True, repetitions=1), lambda what, part: told.append(part))
    assert topic.groups == [MEAN, QUANTILE]
    assert told == sorted(told)
    assert told[-1] == pytest.approx(1.0)
    for group in topic.groups:
        rows = topic.of(group)
        assert {row.method for row in rows} == set(METHODS.values())
        assert {row.setting for row in rows} == {f"n = {tests}" for tests in QUICK.tests}
        assert {row.method for row in rows if row.default} == {METHODS[DEFAULT]}
        assert all(row.seconds > 0.0 and 0.0 < row.errors["error"] < 0.5 for row in rows)
        assert topic.front(group)
