"""What any random input keeps: distributions, joint ones, friction fields and processes."""

from __future__ import annotations

import numpy as np

from wearsim.plugins import (
    Distribution,
    FrictionField,
    JointDistribution,
    Process,
)
from wearsim.testing.checks import Checks, agree, require
from wearsim.testing.random_bench import RandomBench
from wearsim.testing.specs import spec_checks
from wearsim.types import FloatArray
from wearsim.uq.sampling.philox import Stream

_ROLES: dict[str, type] = {
    "scalar": Distribution,
    "joint": JointDistribution,
    "field": FrictionField,
    "process": Process,
}
_REALISATIONS = 400


ANY: Checks[RandomBench] = Checks(spec_checks())
SCALAR: Checks[RandomBench] = Checks()
JOINT: Checks[RandomBench] = Checks()
FIELD: Checks[RandomBench] = Checks()
PROCESS: Checks[RandomBench] = Checks()
_SPEC = "wearsim.plugins.RandomInputSpec"
_DISTRIBUTION = "wearsim.plugins.Distribution"
_JOINT = "wearsim.plugins.JointDistribution"
_FIELD = "wearsim.plugins.FrictionField"
_PROCESS = "wearsim.plugins.Process"


@ANY.promised_in(_SPEC)
def role_is_what_the_factory_builds(bench: RandomBench) -> None:
    """The factory builds what the spec's role says, anew each time."""
    role = bench.chosen.spec.role
    built = type(bench.thing).__name__
    wanted = _ROLES[role]
    require(
        isinstance(bench.thing, wanted), f"{role} needs a {wanted.__name__}, and {built} is none"
    )
    require(bench.fresh() is not bench.thing, "the factory returns the same object twice")


def _probabilities() -> FloatArray:
    """Return rising probabilities from 0 to 1, dense towards both ends."""
    middle = np.linspace(0.0, 1.0, 2001)[1:-1]
    tail = np.logspace(-15.0, -3.5, 60)
    return np.unique(np.concatenate([[0.0, 1.0], tail, middle, 1.0 - tail]))


@SCALAR.promised_in("wearsim.plugins.Distribution.quantile")
def quantile_rises_within_the_support(bench: RandomBench) -> None:
    """The quantile function rises from one end of the support to the other."""
    probability = _probabilities()
    values = np.asarray(bench.thing.quantile(probability))
    low, high = bench.thing.support
    require(values.shape == probability.shape, f"quantile returns the shape {values.shape}")
    require(not np.isnan(values).any(), "quantile is not a number somewhere")
    require(low <= high, f"the support goes from {low:g} to {high:g}")
    ends = (float(values[0]), float(values[-1]))
    require(ends == (low, high), f"quantile goes from {ends} where the support is {(low, high)}")
    require(bool(np.isfinite(values[1:-1]).all()), "quantile is infinite between 0 and 1")
    # inverting a law by iteration leaves a few roundings
    noise = 1e-12 * np.abs(values[1:-1]).max()
    fall = float(np.diff(values[1:-1]).min(initial=0.0))
    require(fall >= -noise, f"quantile falls by {-fall:.3g} somewhere")
    inside = (values >= low).all() and (values <= high).all()
    require(bool(inside), f"quantile leaves the support {low:g} to {high:g}")


@SCALAR.promised_in("wearsim.plugins.Distribution.quantile")
def quantile_takes_any_shape(bench: RandomBench) -> None:
    """Quantiles have the shape of the probabilities."""
    probability = np.linspace(0.05, 0.95, 12)
    flat = bench.thing.quantile(probability)
    for shape in ((3, 4), (12, 1), ()):
        asked = probability.reshape(shape) if shape else probability[5]
        expected = flat.reshape(shape) if shape else flat[5]
        agree(f"quantile of shape {shape}", bench.thing.quantile(asked), expected, 1e-14)


@SCALAR.promised_in("wearsim.plugins.Distribution.quantile")
def quantile_has_the_same_bits_twice(bench: RandomBench) -> None:
    """The same probability has the same quantile, to the bit."""
    probability = _probabilities()
    kept = probability.copy()
    first = np.array(bench.thing.quantile(probability))
    require(np.array_equal(probability, kept), "quantile changes the probabilities it is given")
    require(np.array_equal(first, bench.thing.quantile(kept)), "a second call differs")
    require(np.array_equal(first, bench.fresh().quantile(kept)), "a new object differs")


@SCALAR.promised_in(_DISTRIBUTION)
def mean_and_std_are_those_of_the_quantiles(bench: RandomBench) -> None:
    """Mean and standard deviation are those of the quantiles."""
    from scipy.special import ndtr  # noqa: PLC0415  (slow to import)

    scores = np.linspace(-8.1, 8.1, 40_001)
    weights = np.exp(-0.5 * scores * scores)
    weights /= weights.sum()
    values = bench.thing.quantile(ndtr(scores))
    mean = float(np.dot(weights, values))
    std = float(np.sqrt(np.dot(weights, (values - mean) ** 2)))
    agree("mean, against that of the quantiles,", bench.thing.mean, mean, 1e-4, max(std, 1e-300))
    agree("std, against that of the quantiles,", bench.thing.std, std, 2e-3, 1e-12 * abs(mean))


@SCALAR.promised_in(_DISTRIBUTION)
def cdf_and_pdf_belong_to_the_quantiles(bench: RandomBench) -> None:
    """A `cdf` or `pdf`, which a distribution may give besides, belongs to its quantiles."""
    law, probability = bench.thing, np.linspace(0.02, 0.98, 97)
    values = law.quantile(probability)
    if callable(getattr(law, "cdf", None)):
        agree("cdf(quantile(p)), against p,", law.cdf(values), probability, 1e-6)
    if callable(getattr(law, "pdf", None)):
        step = 1e-5
        slope = 2.0 * step / (law.quantile(probability + step) - law.quantile(probability - step))
        agree("pdf, against the slope of the quantiles,", law.pdf(values), slope, 1e-3)


@JOINT.promised_in(_JOINT)
def components_are_named(bench: RandomBench) -> None:
    """Components are named, and each has a mean and a reach."""
    thing = bench.thing
    names = thing.components
    require(len(names) > 1 and len(set(names)) == len(names), f"the components are {names}")
    require(thing.dimension >= 1, f"the dimension is {thing.dimension}")
    for name in ("mean", "reach"):
        given = getattr(thing, name)
        require(len(given) == len(names), f"{name} has {len(given)} values for {len(names)}")


def _rows(bench: RandomBench, draws: int) -> FloatArray:
    stream = Stream(1, bench.chosen.spec.name, "test")
    return stream.rows(0, draws, bench.thing.dimension)


@JOINT.promised_in("wearsim.plugins.JointDistribution.values")
def joint_draws_keep_mean_and_reach(bench: RandomBench) -> None:
    """Joint draws have the means and stay within the reach that are promised."""
    draws = 20_000
    values = np.asarray(bench.thing.values(_rows(bench, draws)))
    wanted = (draws, len(bench.thing.components))
    require(values.shape == wanted, f"values has the shape {values.shape}, not {wanted}")
    require(bool(np.isfinite(values).all()), "values is not finite")
    for k, name in enumerate(bench.thing.components):
        own, reach = values[:, k], bench.thing.reach[k]
        most = float(np.abs(own).max())
        require(most <= reach * (1.0 + 1e-12), f"{name} reaches {most:.6g}, beyond {reach:.6g}")
        told = f"the mean of {name} over {draws} draws, within its standard errors,"
        error = max(float(own.std()) / draws**0.5, 1e-12 * reach)
        agree(told, own.mean() - bench.thing.mean[k], 0.0, 5.0, error)
    ends = np.full((2, bench.thing.dimension), [[2.0**-53], [1.0 - 2.0**-53]])
    require(bool(np.isfinite(bench.thing.values(ends)).all()), "extreme draws are not finite")


@JOINT.promised_in("wearsim.plugins.JointDistribution.values")
def joint_draws_have_the_same_bits_alone(bench: RandomBench) -> None:
    """A draw depends on its own uniform numbers and on no other draw."""
    uniform = _rows(bench, 50)
    kept = uniform.copy()
    all_of_them = np.array(bench.thing.values(uniform))
    require(np.array_equal(uniform, kept), "values changes the numbers it is given")
    alone = np.concatenate([bench.fresh().values(kept[k : k + 1]) for k in range(50)])
    require(np.array_equal(all_of_them, alone), "a draw depends on the others beside it")


def _points() -> tuple[FloatArray, FloatArray]:
    """Return points as a contact has them: from the leading edge on, narrower to both sides."""
    y = np.linspace(-1.5e-3, 1.5e-3, 15)
    a = 1.3e-4 * np.sqrt(1.0 - (y / 1.6e-3) ** 2)
    return np.linspace(1.0, -1.0, 12)[:, None] * a, y


@FIELD.promised_in(_FIELD)
def field_stays_in_its_marginal(bench: RandomBench) -> None:
    """At any point a field has the distribution of its marginal."""
    x, y = _points()
    require(bench.thing.frame in {"contact", "cylinder", "roller"}, f"frame is {bench.thing.frame}")
    drawn = [np.asarray(bench.thing.values(x, y, bench.uniforms(k))) for k in range(_REALISATIONS)]
    shape = drawn[0].shape
    require(shape == x.shape, f"values has the shape {shape}, not {x.shape}")
    _keeps_marginal(bench.thing.marginal, np.array([item[3, 5] for item in drawn]), "one point")
    low, high = bench.thing.marginal.support
    for item in drawn:
        inside = (item >= low).all() and (item <= high).all()
        require(bool(inside), f"the field leaves the support {low:g} to {high:g} of its marginal")


def _keeps_marginal(marginal: Distribution, values: FloatArray, where: str) -> None:
    """Compare independent values at one place with the marginal, within 5 standard errors."""
    count, std = len(values), marginal.std
    require(bool(np.isfinite(values).all()), f"values at {where} are not finite")
    told = f"at {where}, over {count} realisations, within its standard errors,"
    agree(f"the mean {told}", values.mean() - marginal.mean, 0.0, 5.0, std / count**0.5)
    # of a law whose fourth moment is not known: a wide margin
    agree(f"the std {told}", values.std() - std, 0.0, 10.0, std / count**0.5)


@FIELD.promised_in("wearsim.plugins.FrictionField.values")
def field_has_the_same_bits_twice(bench: RandomBench) -> None:
    """One stream gives one field, to the bit, and another gives another."""
    x, y = _points()
    kept = x.copy(), y.copy()
    first = np.array(bench.thing.values(x, y, bench.uniforms()))
    unchanged = np.array_equal(x, kept[0]) and np.array_equal(y, kept[1])
    require(unchanged, "values changes the points it is given")
    again, anew = (item.values(*kept, bench.uniforms()) for item in (bench.thing, bench.fresh()))
    require(np.array_equal(first, again), "a second call on the same stream differs")
    require(np.array_equal(first, anew), "a new object on the same stream differs")
    other = bench.thing.values(*kept, bench.uniforms(1))
    require(not np.array_equal(first, other), "another realisation is the same")


@FIELD.promised_in("wearsim.plugins.FrictionField.unresolved")
def field_tells_which_grids_are_too_coarse(bench: RandomBench) -> None:
    """A field says in words which spacings do not resolve it, and some spacing does."""
    for spacing in (1e-9, 1.0):
        told = bench.thing.unresolved(spacing, spacing)
        require(told is None or (isinstance(told, str) and told != ""), f"unresolved says {told!r}")
    require(bench.thing.unresolved(1e-9, 1e-9) is None, "no grid at all resolves the field")


@PROCESS.promised_in("wearsim.plugins.Process.path")
def path_begins_with_the_shorter_one(bench: RandomBench) -> None:
    """A longer path begins with the shorter one, bit for bit."""
    require(bench.thing.spacing > 0.0, f"the spacing is {bench.thing.spacing:g} s")
    long = np.array(bench.thing.path(200, bench.uniforms()))
    require(long.shape == (200,), f"a path of 200 points has the shape {long.shape}")
    for points in (1, 2, 77):
        short = bench.thing.path(points, bench.uniforms())
        same = np.array_equal(short, long[:points])
        require(same, f"a path of 200 points does not begin with that of {points}, bit for bit")
    require(np.array_equal(long, bench.fresh().path(200, bench.uniforms())), "a new object differs")
    other = bench.thing.path(200, bench.uniforms(1))
    require(not np.array_equal(long, other), "another realisation is the same")


@PROCESS.promised_in(_PROCESS)
def process_stays_in_its_marginal(bench: RandomBench) -> None:
    """At any time a process has the distribution of its marginal."""
    paths = np.array([bench.thing.path(60, bench.uniforms(k)) for k in range(_REALISATIONS)])
    for k in (0, 59):
        _keeps_marginal(bench.thing.marginal, paths[:, k], f"point {k} of the path")
    low, high = bench.thing.marginal.support
    inside = (paths >= low).all() and (paths <= high).all()
    require(bool(inside), f"the path leaves the support {low:g} to {high:g} of its marginal")


BY_ROLE = {
    role: Checks(ANY, own)
    for role, own in (("scalar", SCALAR), ("joint", JOINT), ("field", FIELD), ("process", PROCESS))
}
