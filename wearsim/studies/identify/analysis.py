"""Wear factor of each test: traces against the trajectories of its draws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from wearsim.errors import Mistake, ScenarioError
from wearsim.studies.identify.likelihood import (
    DrawLikelihood,
    TraceLikelihood,
    depth_likelihood,
)
from wearsim.studies.identify.measurements import Measurement
from wearsim.studies.identify.traces import Trace, half_depth_width, level, smoothed
from wearsim.studies.identify.trajectories import Grown, Trajectories
from wearsim.types import FloatArray
from wearsim.uq.hierarchy.kernels import Kernel
from wearsim.uq.hierarchy.noise import Noise, fit_noise

_EDGE = 0.01  # of the depth, where a groove ends
_FIRST_NOISE = Noise(1e-6, 0.2e-3, 0.1e-6)  # of a trace without shoulders, before its own is fitted
_BAND = 100  # draws of the band of fitted profiles
_WIDTH_WARNED, _WIDTH_REFUSED = 0.08, 0.25  # relative difference of measured and predicted width
_FOREIGN = 100.0  # mean square of the residuals over that of the noise
_SUSPECT = 1.6


@dataclass(frozen=True)
class Fit:
    """A trace with the profiles that the model predicts for it.

    Parameters
    ----------
    trace : Trace
    fitted, low, high : ndarray, shape (points,)
        Best profile, and the band that holds 95 % of the profiles [m].
    ratio : float
        Mean square of the whitened residuals, 1 where the model and the noise are right.
    probability : float
        Probability of a greater one.
    correlation : float
        Autocorrelation of neighbouring whitened residuals.
    suspect : str
        Warning on the shape of the groove.
    """

    trace: Trace
    fitted: FloatArray
    low: FloatArray
    high: FloatArray
    ratio: float
    probability: float
    correlation: float
    suspect: str = ""

    @property
    def warning(self) -> str | None:
        """Warning if the model does not describe the trace."""
        if self.ratio < _SUSPECT:
            return f"{self.trace.name}: {self.suspect}" if self.suspect else None
        return (
            f"{self.trace.name}: residuals are {np.sqrt(self.ratio):.1f} times the noise of the"
            " shoulders: the model does not describe this groove, and its interval is too small;"
            " is it of another rig, or are inputs missing that the scenario should draw?"
        )


@dataclass(frozen=True)
class Identified:
    """Wear factor from one measured groove, or from several of the same test.

    Parameters
    ----------
    item : Measurement
    likelihood : DrawLikelihood
        For the draws of the test.
    kernel : Kernel
        Likelihood of ln K/H.
    depth, area, energy : tuple of float
        Depth [m], worn area [m^2] and energy [J]: value, and ends of the 95 % interval.
    fit : Fit, optional
        None for a measured depth.
    passes : float
    shares : mapping of str to float
        Part of the variance of ln K/H that follows each input.
    """

    item: Measurement
    likelihood: DrawLikelihood
    kernel: Kernel
    depth: tuple[float, float, float]
    area: tuple[float, float, float]
    energy: tuple[float, float, float]
    fit: Fit | None
    passes: float
    shares: Mapping[str, float] = field(default_factory=dict)


def kernel_of(found: DrawLikelihood, name: str) -> Kernel:
    """Return the likelihood of ln K/H, the draws of the other inputs averaged.

    Raises
    ------
    ScenarioError
        If no draw describes the test.
    """
    known = np.isfinite(found.log_evidence)
    if not known.any():
        raise ScenarioError(name, [Mistake("", "", "no draw of the inputs describes this groove")])
    return Kernel.of(found.log_evidence[known], found.mean[known], found.std[known])


def identified(
    item: Measurement,
    trace: Trace | None,
    trajectories: Trajectories,
    passes: float,
    crown_radius: float,
) -> Identified:
    """Return the wear factor from one measured groove.

    Parameters
    ----------
    item : Measurement
    trace : Trace, optional
        None for a measured depth.
    trajectories : Trajectories
    passes : float
        Passes of the measurement.
    crown_radius : float
        Crown radius of the roller [m].

    Raises
    ------
    ScenarioError
        If the trace does not fit the model at all.
    """
    grown = trajectories.by_passes[passes]
    fit, suspect = None, ""
    if trace is None:
        assert item.depth is not None
        assert item.depth_std is not None
        found = depth_likelihood(item.depth, item.depth_std, grown, item.body)
    else:
        if trace.noise is not None and trace.depth is not None:
            rows = _profiles_of_depth(grown, item.body, trace.depth)
            suspect = _check_shape(trace, grown.y, rows)
            trace = _levelled_again(trace, item, crown_radius, _extents(grown.y, rows))
        cylinder = item.body == "cylinder" and not trace.difference
        noise = trace.noise or _FIRST_NOISE
        model = TraceLikelihood(trace.y, trace.height, noise, grown, item.body, start=cylinder)
        if trace.noise is None:
            model = _with_noise(model)
            trace = replace(trace, noise=model.noise)
        found = model.integrated()
        _check_covered(found, grown, trace)
        fit = replace(_fit(model, found, trace), suspect=suspect)
    kernel = kernel_of(found, item.name)
    depth = _interval(grown.depth[item.body].max(axis=2), grown, found)
    step = grown.y[1] - grown.y[0]
    area = _interval(grown.depth[item.body].sum(axis=2) * step, grown, found)
    energy = _interval(grown.energy, grown, found)
    if item.depth is not None and item.depth_std is not None:
        depth = (item.depth, item.depth - 1.96 * item.depth_std, item.depth + 1.96 * item.depth_std)
    return Identified(item, found, kernel, depth, area, energy, fit, passes)


def _levelled_again(
    trace: Trace, item: Measurement, crown_radius: float, extents: tuple[float, float]
) -> Trace:
    """Level a trace on the shoulders beyond the predicted groove, if there are any."""
    if item.shoulders is not None:
        return trace
    again = level(trace, None, crown_radius, extents)
    return trace if again.noise is None else again


def _profiles_of_depth(grown: Grown, body: str, depth: float) -> FloatArray:
    """Return the worn profile of each draw at a depth, shape (draws, strips) [m].

    It is that of the nearest record, scaled as a groove that grows.
    """
    rows = grown.depth[body]
    record = np.abs(np.log(np.maximum(rows.max(axis=2), 1e-12) / depth)).argmin(axis=1)
    chosen = rows[np.arange(len(rows)), record]
    stretch = np.sqrt(depth / chosen.max(axis=1))
    centre = (chosen * grown.y).sum(axis=1) / chosen.sum(axis=1)
    scaled = [
        factor**2 * np.interp((grown.y - middle) / factor + middle, grown.y, row)
        for factor, middle, row in zip(stretch, centre, chosen, strict=True)
    ]
    return np.array(scaled)


def _extents(y: FloatArray, rows: FloatArray) -> tuple[float, float]:
    """Return the predicted extents of a groove to the left and right of its centroid [m]."""
    worn = rows > _EDGE * rows.max(axis=1, keepdims=True)
    middle = (rows * y).sum(axis=1) / rows.sum(axis=1)
    left = middle - y[worn.argmax(axis=1)]
    right = y[len(y) - 1 - worn[:, ::-1].argmax(axis=1)] - middle
    # a trace may run in either direction
    reach = float(np.quantile(np.concatenate([left, right]), 0.975))
    return reach, reach


def _check_shape(trace: Trace, y: FloatArray, rows: FloatArray) -> str:
    """Return a warning if the groove has not the width that the model predicts for its depth.

    Raises
    ------
    ScenarioError
        If it differs much.
    """
    width = half_depth_width(trace.y, -smoothed(trace.height))
    widths = [half_depth_width(y, row) for row in rows]
    low, high = float(np.nanmin(widths)), float(np.nanmax(widths))
    away = max(low / width, width / high) - 1.0
    if not away > _WIDTH_WARNED:
        return ""
    assert trace.depth is not None
    what = (
        f"the groove is {1e6 * trace.depth:.4g} um deep and {1e3 * width:.4g} mm wide at half of"
        f" its depth, where the model predicts {1e3 * low:.4g}"
        + (f" to {1e3 * high:.4g}" if high > 1.005 * low else "")
        + " mm for this depth: is it of another rig, or are its units others?"
    )
    if away > _WIDTH_REFUSED:
        raise ScenarioError(trace.name, [Mistake("", "", what)])
    return what


def _with_noise(model: TraceLikelihood) -> TraceLikelihood:
    """Return a model with the noise of the residuals from its best profile."""
    for _ in range(2):
        position, _, chi2 = model.maximum()
        best = np.array([int(chi2.argmin())])
        residual = model.height + model.worn(best, *position[best].T)[:, 0]
        model = replace(model, noise=fit_noise(model.y, residual))
    return model


def _check_covered(found: DrawLikelihood, grown: Grown, trace: Trace) -> None:
    """Refuse a trace whose best wear factor is at the end of those computed."""
    best = int(found.chi2.argmin())
    top = grown.ln_k[best, -1]
    if trace.depth is None and found.mean[best] + found.std[best] > top:
        raise ScenarioError(
            trace.name,
            [
                Mistake(
                    "",
                    "",
                    "the groove is wider than the trace: without its edges and the unworn surface"
                    " beside it nothing can be identified",
                    f"a trace of {1e3 * (trace.y[-1] - trace.y[0]):.4g} mm",
                    "a longer one",
                )
            ],
        )
    freedom = len(trace.y) - 4
    ratio = float(found.chi2.min()) / freedom
    if ratio > _FOREIGN:
        raise ScenarioError(
            trace.name,
            [
                Mistake(
                    "",
                    "",
                    f"the model does not describe this groove: residuals are {ratio**0.5:.0f} times"
                    " the noise of the shoulders",
                    None,
                    "a trace of the rig of the scenario, and its units",
                )
            ],
        )


def _fit(model: TraceLikelihood, found: DrawLikelihood, trace: Trace) -> Fit:
    """Return the best profile, the band of profiles, and the check of residuals."""
    from scipy.special import fdtrc  # noqa: PLC0415  (slow to import)

    score = np.where(np.isfinite(found.log_evidence), found.log_evidence, -np.inf)
    weight = np.exp(score - score.max())
    order = np.argsort(-weight)[:_BAND]
    # equally spaced quantiles of the draws, and of ln K within a draw
    bound = np.cumsum(weight[order]) / weight[order].sum()
    draws = order[np.searchsorted(bound, (np.arange(_BAND) + 0.5) / _BAND)]
    spread = np.sqrt(2.0) * np.sin(2.4 * np.arange(_BAND))  # unit variance, no pattern
    ln_k = found.mean[draws] + spread * found.std[draws]
    worn = model.worn(draws, ln_k, found.shift[draws])
    best = np.array([int(order[0])])
    residual = model.residual(best, found.mean[best], found.shift[best])[:, 0]
    freedom = len(trace.y) - 4
    squares = float(residual @ residual)
    ratio = squares / freedom
    lines = np.column_stack([np.ones_like(trace.y), trace.y])
    white = model.noise.whitened(trace.y, np.column_stack([lines, trace.height[:, None] + worn]))
    coefficients = np.linalg.lstsq(white[:, :2], white[:, 2:], rcond=None)[0]
    profiles = lines @ coefficients - worn
    middle = model.worn(best, found.mean[best], found.shift[best])
    own = model.noise.whitened(trace.y, np.column_stack([lines, trace.height[:, None] + middle]))
    line = np.linalg.lstsq(own[:, :2], own[:, 2], rcond=None)[0]
    low, high = np.quantile(profiles, (0.025, 0.975), axis=1)
    return Fit(
        trace,
        lines @ line - middle[:, 0],
        low,
        high,
        ratio,
        # the noise is estimated from the points of the shoulders
        float(fdtrc(freedom, np.count_nonzero(trace.unworn) or freedom, ratio)),
        float(residual[1:] @ residual[:-1]) / squares,
    )


def _interval(sizes: FloatArray, grown: Grown, found: DrawLikelihood) -> tuple[float, float, float]:
    """Return a size of the groove and its 95 % interval, from sizes (draws, records)."""
    score = np.where(np.isfinite(found.log_evidence), found.log_evidence, -np.inf)
    weight = np.exp(score - score.max())
    weight /= weight.sum()
    logs = np.log(np.maximum(sizes, 1e-300))
    mean, slope = np.empty((2, len(logs)))
    for draw, (known, values) in enumerate(zip(grown.ln_k, logs, strict=True)):
        mean[draw] = np.interp(found.mean[draw], known, values)
        place = int(np.clip(np.searchsorted(known, found.mean[draw]), 1, len(known) - 1))
        slope[draw] = (values[place] - values[place - 1]) / (known[place] - known[place - 1])
    centre = float(weight @ mean)
    variance = float(weight @ ((mean - centre) ** 2 + (slope * found.std) ** 2))
    ends = centre + 1.96 * np.sqrt(variance) * np.array([0.0, -1.0, 1.0])
    value, low, high = np.exp(ends).tolist()
    return value, low, high


def exponent(rows: Sequence[Identified]) -> tuple[float, float, float] | None:
    """Return the exponent p of depth ~ n^p from traces of one test, and its 95 % interval.

    Parameters
    ----------
    rows : sequence of Identified
        Traces of one test at different passes.
    """
    if len(rows) < 2:
        return None
    x = np.log([row.passes for row in rows])
    depth = np.array([row.depth for row in rows])
    std = np.log(depth[:, 2] / depth[:, 1]) / 3.92
    weight = std**-2
    middle = np.average(x, weights=weight)
    spread = float((weight * (x - middle) ** 2).sum())
    slope = float((weight * (x - middle) * np.log(depth[:, 0])).sum()) / spread
    half = 1.96 * spread**-0.5
    return slope, slope - half, slope + half
