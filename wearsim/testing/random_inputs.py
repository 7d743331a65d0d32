"""Conformance tests of random inputs: distributions, joint ones, friction fields, processes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from wearsim.plugins import (
    Distribution,
    FrictionField,
    JointDistribution,
    Process,
    RandomInputSpec,
    Uniforms,
)
from wearsim.plugins.manager import described_value
from wearsim.testing.checks import (
    Checks,
    ConfiguredSpec,
    Fixture,
    agree,
    require,
    require_repeatable,
    require_values,
    spec_checks,
)
from wearsim.types import FloatArray
from wearsim.uq.sampling.sobol import Stream

_CLASSES: dict[str, type] = {
    "scalar": Distribution,
    "joint": JointDistribution,
    "field": FrictionField,
    "process": Process,
}
_REALISATIONS = 400
ANY: Checks[RandomInputFixture] = spec_checks()
SCALAR: Checks[RandomInputFixture] = Checks()
JOINT: Checks[RandomInputFixture] = Checks()
FIELD: Checks[RandomInputFixture] = Checks()
PROCESS: Checks[RandomInputFixture] = Checks()
_QUANTILE = "wearsim.plugins.Distribution.quantile"
_DISTRIBUTION = "wearsim.plugins.Distribution"
_VALUES = "wearsim.plugins.JointDistribution.values"


@dataclass(frozen=True)
class RandomInputFixture(Fixture[RandomInputSpec]):
    """A random input under test.

    Parameters
    ----------
    configured : ConfiguredSpec
        Its spec and options.
    marginal : ConfiguredSpec, optional
        Marginal distribution of a field or a process.
    """

    marginal: ConfiguredSpec[RandomInputSpec] | None = None

    def fresh(self) -> Any:
        """Return a new random input."""
        if self.marginal is None:
            return super().fresh()
        marginal = self.marginal.spec.factory(self.marginal.options)
        return self.configured.spec.factory(self.configured.options, marginal)

    def uniforms(self, realisation: int = 0) -> Uniforms:
        """Return the stream of uniform numbers of one realisation."""
        stream = Stream(1, self.configured.spec.name, "field")
        return partial(stream.uniforms, realisation=realisation)


@ANY.specified_in("wearsim.plugins.RandomInputSpec")
def factory_matches_role(fixture: RandomInputFixture) -> None:
    """The factory builds a new instance of the class of the role at each call."""
    role = fixture.configured.spec.role
    require(
        isinstance(fixture.instance, _CLASSES[role]),
        f"{role} requires a {_CLASSES[role].__name__}, not a {type(fixture.instance).__name__}",
    )
    require(fixture.fresh() is not fixture.instance, "the factory returns the same object twice")


def _probabilities() -> FloatArray:
    """Return increasing probabilities from 0 to 1, dense towards both ends."""
    middle = np.linspace(0.0, 1.0, 2001)[1:-1]
    tail = np.logspace(-15.0, -3.5, 60)
    return np.unique(np.concatenate([[0.0, 1.0], tail, middle, 1.0 - tail]))


def _require_support(distribution: Distribution, values: FloatArray, name: str) -> None:
    """Raise ConformanceError unless all values are within the support."""
    low, high = distribution.support
    inside = (values >= low).all() and (values <= high).all()
    require(inside, f"{name} leaves the support {low:g} to {high:g}")


@SCALAR.specified_in(_QUANTILE)
def quantile_rises_within_support(fixture: RandomInputFixture) -> None:
    """The quantile function rises from one end of the support to the other."""
    probability = _probabilities()
    values = fixture.instance.quantile(probability)
    require(isinstance(values, np.ndarray), f"quantile returns {described_value(values)}")
    low, high = fixture.instance.support
    require(values.shape == probability.shape, f"quantile returns the shape {values.shape}")
    require(not np.isnan(values).any(), "quantile returns NaN")
    require(low <= high, f"the support is {low:g} to {high:g}")
    ends = (float(values[0]), float(values[-1]))
    require(ends == (low, high), f"quantile rises from {ends}, and the support is {(low, high)}")
    require(np.isfinite(values[1:-1]).all(), "quantile is infinite between 0 and 1")
    # a quantile function that is inverted by iteration has a few rounding errors
    noise = 1e-12 * np.abs(values[1:-1]).max()
    slope = float(np.diff(values[1:-1]).min(initial=0.0))
    require(slope >= -noise, f"quantile falls by {-slope:.3g}")
    _require_support(fixture.instance, values, "quantile")


@SCALAR.specified_in(_QUANTILE)
def quantile_keeps_shape(fixture: RandomInputFixture) -> None:
    """Quantiles have the shape of the probabilities."""
    probability = np.linspace(0.05, 0.95, 12)
    flat = fixture.instance.quantile(probability)
    for shape, part in (((3, 4), slice(None)), ((12, 1), slice(None)), ((), 5)):
        reshaped, expected = probability[part].reshape(shape)[()], flat[part].reshape(shape)
        agree(f"quantile of shape {shape}", fixture.instance.quantile(reshaped), expected, 1e-14)


@SCALAR.specified_in(_QUANTILE)
def quantile_is_reproducible(fixture: RandomInputFixture) -> None:
    """The same probability has the same quantile, bit for bit."""
    new = {"a new object": fixture.fresh().quantile}
    require_repeatable("quantile", fixture.instance.quantile, new, _probabilities())


@SCALAR.specified_in(_DISTRIBUTION)
def mean_and_std_match_quantile(fixture: RandomInputFixture) -> None:
    """Mean and standard deviation follow from the quantile function."""
    from scipy.special import ndtr  # noqa: PLC0415  (slow to import)

    scores = np.linspace(-8.1, 8.1, 40_001)
    weights = np.exp(-0.5 * scores * scores)
    weights /= weights.sum()
    distribution = fixture.instance
    values = distribution.quantile(ndtr(scores))
    mean = float(np.dot(weights, values))
    std = float(np.sqrt(np.dot(weights, (values - mean) ** 2)))
    agree("mean, compared with the quantiles,", distribution.mean, mean, 1e-4, max(std, 1e-300))
    agree("std, compared with the quantiles,", distribution.std, std, 2e-3, 1e-12 * abs(mean))


@SCALAR.specified_in(_DISTRIBUTION)
def cdf_and_pdf_match_quantile(fixture: RandomInputFixture) -> None:
    """The optional `cdf` and `pdf` of a distribution match its quantile function."""
    distribution, probability = fixture.instance, np.linspace(0.02, 0.98, 97)
    values = distribution.quantile(probability)
    if callable(getattr(distribution, "cdf", None)):
        agree("cdf(quantile(p)), compared with p,", distribution.cdf(values), probability, 1e-6)
    if callable(getattr(distribution, "pdf", None)):
        step = 1e-5
        low, high = (distribution.quantile(probability + sign * step) for sign in (-1.0, 1.0))
        slope = 2.0 * step / (high - low)
        agree("pdf, compared with the quantiles,", distribution.pdf(values), slope, 1e-3)


@JOINT.specified_in("wearsim.plugins.JointDistribution")
def components_are_named(fixture: RandomInputFixture) -> None:
    """The components have distinct names, and each has a mean and a reach."""
    joint, names = fixture.instance, fixture.instance.components
    require(len(names) > 1 and len(set(names)) == len(names), f"the components are {names}")
    require(joint.dimension >= 1, f"the dimension is {joint.dimension}")
    for name in ("mean", "reach"):
        count = len(getattr(joint, name))
        require(count == len(names), f"{name} has {count} values for {len(names)} components")


def _uniform_rows(fixture: RandomInputFixture, draws: int) -> FloatArray:
    stream = Stream(1, fixture.configured.spec.name, "test")
    return stream.rows(0, draws, fixture.instance.dimension)


@JOINT.specified_in(_VALUES)
def joint_draws_match_mean_and_reach(fixture: RandomInputFixture) -> None:
    """Joint draws have the specified means and stay within the specified reach."""
    draws, joint = 20_000, fixture.instance
    values = np.asarray(joint.values(_uniform_rows(fixture, draws)))
    require_values("values", values, (draws, len(joint.components)))
    for k, name in enumerate(joint.components):
        column, reach = values[:, k], joint.reach[k]
        largest = float(np.abs(column).max())
        require(
            largest <= reach * (1.0 + 1e-12), f"{name} is up to {largest:.6g}, above {reach:.6g}"
        )
        agree(
            f"the mean of {name} over {draws} draws, in standard errors,",
            column.mean() - joint.mean[k],
            0.0,
            5.0,
            max(float(column.std()) / draws**0.5, 1e-12 * reach),
        )
    ends = np.full((2, joint.dimension), [[2.0**-53], [1.0 - 2.0**-53]])
    require(np.isfinite(joint.values(ends)).all(), "extreme draws are not finite")


@JOINT.specified_in(_VALUES)
def joint_draws_independent_of_batch(fixture: RandomInputFixture) -> None:
    """A draw depends only on its own uniform numbers."""

    def separate(uniform: FloatArray) -> FloatArray:
        return np.concatenate([fixture.fresh().values(row[None]) for row in uniform])

    single = {"a draw without the other draws": separate}
    require_repeatable("values", fixture.instance.values, single, _uniform_rows(fixture, 50))


def _points() -> tuple[FloatArray, FloatArray]:
    """Return points as in a contact: from the leading edge, narrower towards both sides."""
    y = np.linspace(-1.5e-3, 1.5e-3, 15)
    a = 1.3e-4 * np.sqrt(1.0 - (y / 1.6e-3) ** 2)
    return np.linspace(1.0, -1.0, 12)[:, None] * a, y


def _require_marginal(marginal: Distribution, values: FloatArray, where: str) -> None:
    """Compare independent values at one place with the marginal, in standard errors."""
    count, std = len(values), marginal.std
    require_values(f"values at {where}", values, (count,))
    how = f"at {where}, over {count} realisations, in standard errors,"
    agree(f"the mean {how}", values.mean() - marginal.mean, 0.0, 5.0, std / count**0.5)
    # a wide margin, since the fourth moment of the distribution is unknown
    agree(f"the std {how}", values.std() - std, 0.0, 10.0, std / count**0.5)


@FIELD.specified_in("wearsim.plugins.FrictionField")
def field_matches_marginal(fixture: RandomInputFixture) -> None:
    """At any point a field has the distribution of its marginal."""
    x, y = _points()
    field = fixture.instance
    require(field.frame in {"contact", "cylinder", "roller"}, f"frame is {field.frame}")
    values = np.array([field.values(x, y, fixture.uniforms(k)) for k in range(_REALISATIONS)])
    require_values("values", values, (_REALISATIONS, *x.shape))
    _require_marginal(field.marginal, values[:, 3, 5], "one point")
    _require_support(field.marginal, values, "the field")


@FIELD.specified_in("wearsim.plugins.FrictionField.values")
def field_is_reproducible(fixture: RandomInputFixture) -> None:
    """The same stream gives the same field, bit for bit, and another stream a different one."""
    field, new = (
        lambda x, y, item=item: item.values(x, y, fixture.uniforms())
        for item in (fixture.instance, fixture.fresh())
    )
    first = require_repeatable("values", field, {"a new object": new}, *_points())
    other = fixture.instance.values(*_points(), fixture.uniforms(1))
    require(not np.array_equal(first, other), "another realisation is identical")


@FIELD.specified_in("wearsim.plugins.FrictionField.unresolved")
def field_reports_coarse_grids(fixture: RandomInputFixture) -> None:
    """A field describes why a grid spacing is too coarse, and some spacing resolves it."""
    for spacing in (1e-9, 1.0):
        reason = fixture.instance.unresolved(spacing, spacing)
        require(
            reason is None or (isinstance(reason, str) and reason), f"unresolved returns {reason!r}"
        )
    require(fixture.instance.unresolved(1e-9, 1e-9) is None, "no grid resolves the field")


@PROCESS.specified_in("wearsim.plugins.Process.path")
def longer_path_extends_shorter(fixture: RandomInputFixture) -> None:
    """A longer path begins with the shorter one, bit for bit."""
    process = fixture.instance
    require(process.spacing > 0.0, f"the spacing is {process.spacing:g} s")
    long = np.array(process.path(200, fixture.uniforms()))
    require(long.shape == (200,), f"a path of 200 points has the shape {long.shape}")
    for points in (1, 2, 77):
        require(
            np.array_equal(process.path(points, fixture.uniforms()), long[:points]),
            f"a path of 200 points does not begin with that of {points}, bit for bit",
        )
    require(
        np.array_equal(long, fixture.fresh().path(200, fixture.uniforms())), "a new object differs"
    )
    other = process.path(200, fixture.uniforms(1))
    require(not np.array_equal(long, other), "another realisation is identical")


@PROCESS.specified_in("wearsim.plugins.Process")
def process_matches_marginal(fixture: RandomInputFixture) -> None:
    """At any time a process has the distribution of its marginal."""
    process = fixture.instance
    paths = np.array([process.path(60, fixture.uniforms(k)) for k in range(_REALISATIONS)])
    for k in (0, 59):
        _require_marginal(process.marginal, paths[:, k], f"point {k} of the path")
    _require_support(process.marginal, paths, "the path")


# the requirements above are complete here
BY_ROLE = {
    role: Checks(ANY | checks)
    for role, checks in (
        ("scalar", SCALAR),
        ("joint", JOINT),
        ("field", FIELD),
        ("process", PROCESS),
    )
}
