"""Calibration on synthetic tests with known truth: coverage of intervals, and a round trip."""

from __future__ import annotations

import numpy as np
import pytest

from tests.studies.identify.grooves import NOISE, K, groove, grown, rig
from wearsim.studies.identify.analysis import kernel_of
from wearsim.studies.identify.likelihood import TraceLikelihood
from wearsim.studies.identify.traces import Trace, level
from wearsim.studies.identify.trajectories import Grower, Grown
from wearsim.uq.hierarchy.kernels import Kernel
from wearsim.uq.hierarchy.noise import Noise
from wearsim.uq.hierarchy.pooled import Posterior

REPEATS = 1000
ENDS = np.array([0.025, 0.975])
PASSES = 1_350_000.0
SCATTERED = {
    "load.normal_force": {"distribution": "lognormal", "median": "300 N", "factor": 1.1},
    "creepage.longitudinal": {"distribution": "lognormal", "median": 1e-3, "factor": 1.3},
    "creepage.misalignment": {"distribution": "disc", "radius": "1 mrad"},
}


def levelled(y: np.ndarray, height: np.ndarray) -> Trace:
    """Return a trace that is levelled on its shoulders, with their noise."""
    unworn = np.zeros(len(y), dtype=bool)
    return level(Trace("t", y, height, unworn, "", None, None, None, 0.0), None, 0.5)


def holds(trace: Trace, noise: Noise, profiles: Grown, ln_k: float) -> bool:
    """Return whether the 95 % interval of ln K holds the truth."""
    found = TraceLikelihood(trace.y, trace.height, noise, profiles).integrated()
    low, high = kernel_of(found, "t").quantile(ENDS)
    return bool(low < ln_k < high)


@pytest.mark.slow
def test_intervals_hold_the_truth_with_correlated_noise():
    rng = np.random.default_rng(11)
    held = np.zeros(2)
    for _ in range(REPEATS):
        shift = rng.uniform(-1e-3, 1e-3)
        trace = levelled(*groove(rng, K, shift, 12e-3))
        assert trace.noise is not None
        independent = Noise(1e-12, 1e-3, trace.noise.std)
        for place, noise in enumerate((trace.noise, independent)):
            held[place] += holds(trace, noise, grown(), np.log(K))
    coverage, naive = held / REPEATS

    assert 0.93 <= coverage <= 0.97
    assert naive < 0.75


@pytest.mark.slow
def test_intervals_hold_the_truth_with_scattered_inputs():
    scenario = rig().changed(SCATTERED)
    profiles = Grower(scenario, 48).grow((28e-6, 62e-6), [PASSES]).by_passes[PASSES]
    # the truths are other draws of the same inputs
    other = rig().changed({**SCATTERED, "seed": 5})
    truths = Grower(other, 256).grow((28e-6, 62e-6), [PASSES]).by_passes[PASSES]
    rng, held = np.random.default_rng(12), 0
    y = np.arange(-12e-3, 12e-3, 60e-6)
    source = TraceLikelihood(y, np.zeros_like(y), NOISE, truths)
    for number in range(REPEATS):
        draw = number % 256
        ln_k = float(truths.ln_k[draw].mean()) + rng.uniform(-0.3, 0.3)
        worn = source.worn(np.array([draw]), np.array([ln_k]), np.array([rng.uniform(-1e-3, 1e-3)]))
        noise = NOISE.sample(y, rng.standard_normal((2, len(y))))
        trace = levelled(y, 2e-4 * y - worn[:, 0] + noise)
        assert trace.noise is not None
        held += holds(trace, trace.noise, profiles, ln_k)
    coverage = held / REPEATS

    assert 0.93 <= coverage <= 0.97


@pytest.mark.slow
@pytest.mark.parametrize("tests", [3, 8])
def test_next_life_lies_in_its_predictive_interval(tests: int):
    # truth: m ~ N(-25, 0.5^2), t half-normal(0.5); inputs scatter ln of the energy by 0.3; a life
    # is shorter by the factor K x energy
    rng, inputs, held = np.random.default_rng(13), 0.3, 0
    for _ in range(REPEATS):
        m, t = rng.normal(-25.0, 0.5), abs(rng.normal(0.0, 0.5))
        apparent = rng.normal(m, np.hypot(t, inputs), tests + 1)
        kernels = [Kernel(np.ones(1), np.array([c]), np.array([inputs])) for c in apparent[:-1]]
        posterior = Posterior.of(kernels, 60)
        low, high = posterior.next(ENDS.tolist(), more=inputs)
        held += low < apparent[-1] < high

    assert 0.93 <= held / REPEATS <= 0.97
