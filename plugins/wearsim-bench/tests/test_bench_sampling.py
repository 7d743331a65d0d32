"""Topic `sampling`: errors on a problem with exact results, and timed studies."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ndtr

from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.ensemble.api import ensemble
from wearsim.studies.ensemble.realisation import closed_form_depths
from wearsim.studies.run.draws import Drawer
from wearsim.uq.sampling.sampler import PLANS, REPLICATES, Sampler
from wearsim_bench.measure.measurement import Effort
from wearsim_bench.sampling.errors import MEAN, PROBABILITY, QUANTILE, Reference, Study, references
from wearsim_bench.sampling.jobs import ControlDraws, Part, rig
from wearsim_bench.sampling.topic import (
    DEFAULT,
    METHODS,
    QUICK,
    StudySizes,
    measurements,
    sampling,
    studies_of,
)

LOW, HIGH, FACTOR = 0.08, 0.12, 1.5
SIZES = StudySizes((16, 64, 256), 16)


@pytest.fixture(scope="module")
def full_slip():
    """Return studies of the closed form of full slip with two random inputs.

    The control variate is the closed form at the mean friction.
    """
    results = {}
    for planned in SIZES.studies:
        scenario = shipped_scenario(
            "rig-450min",
            {
                "seed": planned.seed,
                "friction.coefficient": {"distribution": "uniform", "low": LOW, "high": HIGH},
                "wear.cylinder.k_over_h": {
                    "distribution": "lognormal",
                    "median": "1e-11 1/Pa",
                    "factor": FACTOR,
                },
            },
        )
        columns = Drawer(scenario, planned.plan, planned.tests).columns(0, planned.tests)
        depths = closed_form_depths(scenario, columns, planned.tests)
        at_mean = {**columns, "friction.coefficient": np.full(planned.tests, 0.5 * (LOW + HIGH))}
        controls = closed_form_depths(scenario, at_mean, planned.tests)
        known = full_slip_depth(scenario, 0.5 * (LOW + HIGH)) * mean_factor()
        for part in planned.parts:
            tests = slice(part.first, part.first + part.count)
            results[part] = np.array([depths[tests], controls[tests]])
        results[SIZES.controls[planned.replicate]] = np.array([known, 0.0])
    return scenario, studies_of(SIZES, results)


def full_slip_depth(scenario, friction):
    """Return the depth at the median wear factor [m]."""
    worn = friction * 1e-3 * 1e-11 * 300.0
    crown = 2.0 * scenario.roller.crown_radius
    return (0.75 * worn * scenario.total_passes / np.sqrt(crown)) ** (2.0 / 3.0)


def mean_factor():
    """Return the mean of (K/H)^(2/3) over that of its median, for a log-normal distribution."""
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


def test_reference_values_agree_with_quadrature(full_slip):
    scenario, studies = full_slip
    values = references([study for some in studies.values() for study in some])
    for group, value in exact(scenario).items():
        assert 0.0 < values[group].error < 4e-3 * value
        assert abs(values[group].value - value) < 4.0 * values[group].error


@pytest.fixture(scope="module")
def rows(full_slip):
    """Return the measurements of the closed form with exact reference values."""
    scenario, studies = full_slip
    known = {group: Reference(value, 0.0) for group, value in exact(scenario).items()}
    return list(measurements(SIZES, studies, known, {}))


def test_errors_agree_with_theory(full_slip, rows):
    _, studies = full_slip
    errors = {(row.group, row.method, row.setting): row.errors["error"] for row in rows}
    depths = np.concatenate([study.depths for study in studies["monte-carlo", 256]])
    spread = float(depths.std() / depths.mean())
    for tests in SIZES.tests:
        plain, hypercube, sobol, control = (
            errors[MEAN, method, f"n = {tests}"] for method in METHODS.values()
        )
        expected = spread / np.sqrt(tests)
        chance = 1.0 / np.sqrt(2.0 * SIZES.replicates * SIZES.tests[-1] / tests)
        assert plain == pytest.approx(expected, rel=4.0 * chance)
        assert max(hypercube, control) < 0.5 * expected
        # with 16 points each independent sequence has only two
        assert sobol < {16: 0.8, 64: 0.4, 256: 0.2}[tests] * expected


def test_coverage_of_the_intervals(rows):
    (row,) = (
        row
        for row in rows
        if (row.group, row.method, row.setting) == (MEAN, "Monte Carlo", "n = 16")
    )
    assert row.counts["studies"] == 16 * SIZES.replicates
    assert row.counts["held"] == pytest.approx(0.95, abs=0.05)


def test_standard_error_of_the_rms(rows):
    every = [row.counts for row in rows if (row.group, row.method) == (MEAN, "Monte Carlo")]
    for counts in every:
        # relative standard error of the mean of n squares: sqrt(2/n); of its root: half of it
        assert counts["known"] == pytest.approx(np.sqrt(0.5 / counts["studies"]), rel=0.7)
    assert [counts["studies"] for counts in every] == [
        SIZES.replicates * SIZES.tests[-1] / tests for tests in SIZES.tests
    ]


def test_blocks_of_a_sobol_study_are_equidistributed():
    sampler = Sampler(3, [("load.normal_force", 1)], "sobol", replicates=REPLICATES)
    uniform = sampler.uniforms(0, 512)["load.normal_force"][:, 0]
    whole = Study(0, uniform, uniform, (0.5, 0.0))
    for block in whole.blocks(128):
        for replicate in range(REPLICATES):
            cells = np.sort(np.floor(16 * block.depths[replicate::REPLICATES]))
            np.testing.assert_array_equal(cells, np.arange(16))
    assert sum(len(block.depths) for block in whole.blocks(128)) == 512


def test_seeds_of_studies_are_different():
    seeds = [planned.seed for planned in QUICK.studies]
    assert len(set(seeds)) == len(seeds)
    assert {planned.plan for planned in QUICK.studies} == set(PLANS)


def test_parts_equal_an_ensemble(tmp_path):
    values = Part("monte-carlo", seed=0, total=512, first=1, count=2).run()
    result = ensemble(rig(0), 3, tmp_path / "e.h5", plan="control-variate", scheduler="serial")
    np.testing.assert_array_equal(values[0], result.at_end("depth")[1:])
    np.testing.assert_array_equal(values[1], result.values("control")[1:])
    mean, error = ControlDraws(0, 100_000).run()
    assert abs(mean - result.raw.control["mean"]) < 4.0 * error


@pytest.mark.slow
def test_all_plans_and_sizes_are_measured():
    progress = []
    topic = sampling(Effort(quick=True, repetitions=1), lambda what, part: progress.append(part))
    assert topic.groups == [MEAN, QUANTILE]
    assert progress == sorted(progress)
    assert progress[-1] == pytest.approx(1.0)
    for group in topic.groups:
        rows = topic.of(group)
        assert {row.method for row in rows} == set(METHODS.values())
        assert {row.setting for row in rows} == {f"n = {tests}" for tests in QUICK.tests}
        assert {row.method for row in rows if row.default} == {METHODS[DEFAULT]}
        assert all(row.seconds > 0.0 and 0.0 < row.errors["error"] < 0.5 for row in rows)
        assert topic.front(group)
