"""Coverage of 95 % intervals for the wear depth k (x1 x2 x3)^(2/3) of log-normal x.

Its logarithm is normal, so that its mean, standard deviation and quantiles are known.
"""

import math

import numpy as np
import pytest
from scipy.special import ndtri

from wearsim.uq.estimation.estimates import estimate
from wearsim.uq.estimation.standard_errors import Control
from wearsim.uq.sampling.sampler import REPLICATES, drawing

REPEATS = 500
SPREADS = np.array([0.2, 0.12, 0.08])  # of ln x
SIGMA = float(np.sqrt((SPREADS**2).sum())) * 2.0 / 3.0
MEAN = math.exp(SIGMA**2 / 2.0)
STD = MEAN * math.sqrt(math.expm1(SIGMA**2))
EXACT = (MEAN, STD, 1.0, math.exp(SIGMA * ndtri(0.95)))


def depth(scores):
    """Return the depth from normal scores, (realisations, 3)."""
    return np.exp(2.0 / 3.0 * scores @ SPREADS)


def coverage(estimates):
    """Return the coverage of mean, standard deviation, median and 95 % quantile."""
    held, number = np.zeros(4), 0
    for number, found in enumerate(estimates, 1):  # noqa: B007
        parts = (found.mean, found.std, found.quantile(0.5), found.quantile(0.95))
        held += [part.low <= exact <= part.high for part, exact in zip(parts, EXACT, strict=True)]
    return held / number


def draws(count, seed):
    rng = np.random.default_rng(seed)
    return (rng.standard_normal((count, 3)) for _ in range(REPEATS))


@pytest.mark.parametrize("count", [200, 1000])
def test_independent_intervals_cover_the_exact_values(count):
    found = coverage(estimate(depth(scores), (0.5, 0.95)) for scores in draws(count, 1))
    assert (found >= 0.93).all(), found
    assert (found <= 0.97).all(), found


@pytest.mark.parametrize("count", [256])
def test_sobol_replicate_intervals_cover_the_exact_values(count):
    def estimates():
        for seed in range(REPEATS // 2):
            draw = drawing("sobol", seed, None, REPLICATES)
            uniform = np.hstack([draw(name, 1, 0, count) for name in ("one", "two", "three")])
            replicate = np.arange(count) % REPLICATES
            yield estimate(depth(ndtri(uniform)), (0.5, 0.95), "sobol", replicate)

    found = coverage(estimates())
    assert (found[:3] >= 0.93).all(), found
    assert (found[:3] <= 0.97).all(), found
    # few realisations of a replicate are in the tail: the interval is too wide
    assert found[3] >= 0.93


def test_control_variate_intervals_cover_the_exact_values():
    # the control variate does not depend on the third input
    rest = math.exp((2.0 / 3.0) ** 2 * (SPREADS[:2] ** 2).sum() / 2.0)

    def estimates():
        for scores in draws(300, 2):
            control = np.exp(2.0 / 3.0 * scores[:, :2] @ SPREADS[:2])
            known = Control(control, rest)
            yield estimate(depth(scores), (0.5, 0.95), "control-variate", control=known)

    found = coverage(estimates())
    assert (found >= 0.93).all(), found
    assert (found <= 0.97).all(), found


def test_sobol_and_control_variate_intervals_are_narrower():
    count = 1024
    scores = next(draws(count, 3))
    plain = estimate(depth(scores)).mean.half_width
    control = Control(np.exp(2.0 / 3.0 * scores[:, :2] @ SPREADS[:2]), 1.0)
    controlled = estimate(depth(scores), plan="control-variate", control=control)
    # remaining variance: that of the third input
    left = SPREADS[2] ** 2 / (SPREADS**2).sum()
    assert controlled.mean.half_width / plain == pytest.approx(math.sqrt(left), rel=0.15)
    assert controlled.variance_saved == pytest.approx(1.0 - left, abs=0.03)
    draw = drawing("sobol", 3, None, REPLICATES)
    uniform = np.hstack([draw(name, 1, 0, count) for name in ("load.normal_force", "a", "b")])
    found = estimate(depth(ndtri(uniform)), (), "sobol", np.arange(count) % REPLICATES)
    assert found.mean.half_width < plain / 3.0
