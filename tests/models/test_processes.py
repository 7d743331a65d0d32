"""The Ornstein-Uhlenbeck process."""

import numpy as np
import pytest
from pydantic import ValidationError
from scipy import stats
from scipy.special import ndtr

from wearsim.models.random.varying import OrnsteinUhlenbeck, OrnsteinUhlenbeckOptions
from wearsim.plugins import Distribution, RandomInputSpec, registry
from wearsim.uq.sampling.sobol import Stream


class Gumbel(Distribution):
    """Skewed distribution with closed forms."""

    def quantile(self, probability):
        return -np.log(-np.log(probability))

    @property
    def warnings(self):
        return ("skew",)


def process(**options):
    return OrnsteinUhlenbeck(OrnsteinUhlenbeckOptions(**options), Gumbel())


def uniforms(realisation):
    stream = Stream(6, "load.normal_force", "process")
    return lambda first, count: stream.uniforms(first, count, realisation)


def scores(values):
    """Return the normal scores of Gumbel values."""
    return stats.norm.ppf(np.exp(-np.exp(-values)))


@pytest.mark.parametrize("spacing", [{}, {"spacing": "6 s"}, {"spacing": "15 s"}])
def test_correlation_of_scores_is_exponential(spacing):
    made = process(correlation_time="1 min", **spacing)
    runs, points = 4000, 13
    paths = scores(np.array([made.path(points, uniforms(k)) for k in range(runs)]))
    time = made.spacing * np.arange(points)
    correlation = np.mean(paths * paths[:, :1], axis=0)
    expected = np.exp(-time / 60.0)
    # the product of two scores of correlation r has the variance 1 + r^2
    np.testing.assert_array_less(
        np.abs(correlation - expected), 4.0 * np.sqrt((1 + expected**2) / runs)
    )


def test_marginal_holds_at_every_time():
    made = process(correlation_time="1 min")
    path = made.path(200_000, uniforms(0))
    thinned = path[:: 10 * 10]  # ten correlation times apart
    assert stats.kstest(thinned, "gumbel_r").pvalue > 1e-4
    starts = [made.path(1, uniforms(k))[0] for k in range(1000)]
    assert stats.kstest(starts, "gumbel_r").pvalue > 1e-4


def test_level_is_constant_and_keeps_the_marginal():
    made = process(correlation_time="1 min", level=0.6)
    runs, far = 4000, 20 * 20  # twenty correlation times apart
    ends = scores(np.array([made.path(far + 1, uniforms(k))[[0, far]] for k in range(runs)]))
    assert stats.kstest(ends[:, 1], "norm").pvalue > 1e-3
    # the remaining correlation is that of the level
    correlation = np.mean(ends[:, 0] * ends[:, 1])
    assert correlation == pytest.approx(0.6, abs=4.0 * np.sqrt((1 + 0.6**2) / runs))
    plain = process(correlation_time="1 min", level=0.0)
    assert (
        plain.path(9, uniforms(3)) == process(correlation_time="1 min").path(9, uniforms(3))
    ).all()


@pytest.mark.parametrize("points", [1, 2, 3, 100, 777])
def test_longer_path_starts_with_the_shorter_one(points):
    made = process(correlation_time="5 min")
    np.testing.assert_array_equal(
        made.path(points, uniforms(3)), made.path(1000, uniforms(3))[:points]
    )


def test_first_value_is_the_quantile_of_the_first_number():
    made = process(correlation_time="5 min")
    first = uniforms(9)(0, 1)
    np.testing.assert_allclose(
        made.path(5, uniforms(9))[:1], Gumbel().quantile(ndtr(stats.norm.ppf(first))), rtol=1e-12
    )


def test_default_spacing_is_1_20_of_the_correlation_time():
    assert process(correlation_time="5 min").spacing == 15.0
    assert process(correlation_time="5 min", spacing="1 min").spacing == 60.0


def test_spacing_above_a_quarter_of_the_time_is_refused():
    with pytest.raises(ValidationError, match=r'does not resolve.*"16 s".*60 s.*"15 s"'):
        process(correlation_time="1 min", spacing="16 s")


def test_process_is_registered_and_passes_on_warnings():
    spec = registry().get(RandomInputSpec, "ornstein-uhlenbeck")
    made = spec.factory(spec.options(correlation_time="1 min"), Gumbel())
    assert spec.role == "process"
    assert made.warnings == ("skew",)
