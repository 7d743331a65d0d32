"""Intervals of a dissipation study: coverage, and the spread of scrambled Sobol sequences."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from dissipation_examples import COARSE, contact, paper

from wearsim.studies.dissipation.monte_carlo import dissipation
from wearsim.studies.dissipation.result import DissipationResult
from wearsim.studies.opening import open_dissipation

REPEATS = 200


def held(plan: str, count: int, mean: float, std: float) -> np.ndarray:
    """Return how many intervals of mean and standard deviation hold the converged values."""
    found = np.zeros(2, dtype=np.int64)
    for seed in range(1, REPEATS + 1):
        scenario = paper(**COARSE, sampling__plan=plan, seed=seed)
        power = dissipation(scenario, count).summaries["power"]
        pairs = (power.mean_interval, mean), (power.std_interval, std)
        found += [interval.low <= exact <= interval.high for interval, exact in pairs]
    return found


@pytest.fixture(scope="module")
def converged() -> DissipationResult:
    """Return a study of many Sobol points."""
    return dissipation(paper(**COARSE, sampling__plan="sobol", seed=1001), 2**16)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("plan", "count"), [("monte-carlo", 50), ("monte-carlo", 200), ("sobol", 64), ("sobol", 256)]
)
def test_intervals_hold_the_converged_values(converged, plan, count):
    power = converged.summaries["power"]
    assert power.std_interval.half_width < 0.002 * power.std
    found = held(plan, count, power.mean, power.std)
    assert np.abs(found / REPEATS - 0.95).max() <= 2.0 * np.sqrt(0.95 * 0.05 / REPEATS), found


def test_sobol_intervals_are_those_of_independent_sequences(tmp_path: Path):
    path = tmp_path / "a.h5"
    study = dissipation(contact(sampling__plan="sobol"), 256, path)
    power = study.summaries["power"]
    means = study.power.reshape(-1, 8).mean(axis=0)
    assert power.mean_error == pytest.approx(means.std(ddof=1) / np.sqrt(8.0), rel=1e-9)
    plain = dissipation(contact(), 256).summaries["power"]
    assert power.mean_interval.half_width < 0.1 * plain.mean_interval.half_width
    assert power.std_interval.half_width < 0.5 * plain.std_interval.half_width
    again = open_dissipation(path)
    assert again.summaries == study.summaries
    assert study.convergence().mean_error[-1] == pytest.approx(power.mean_error)


def test_one_realisation_has_no_interval():
    power = dissipation(contact(sampling__plan="sobol"), 1).summaries["power"]
    assert not np.isfinite(power.mean_interval.half_width)
    assert np.isnan(power.mean_error)
