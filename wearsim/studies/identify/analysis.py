"""Wear factor of each test: traces against the trajectories of its draws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from wearsim.errors import Mistake, mistake_in
from wearsim.studies.cam.cam_wear import size_of
from wearsim.studies.cam.observables import CURVE_ANGLES
from wearsim.studies.identify.checks import (
    check_covered,
    check_width,
    extents_of,
    other_depth,
    other_form,
    profiles_of_depth,
)
from wearsim.studies.identify.lifts import LiftLikelihood
from wearsim.studies.identify.likelihood import (
    DrawLikelihood,
    TraceLikelihood,
    depth_likelihood,
)
from wearsim.studies.identify.measurements import Measurement
from wearsim.studies.identify.traces import Trace, level, measured_depth
from wearsim.studies.identify.trajectories import Grown, Trajectories
from wearsim.types import FloatArray
from wearsim.uq.hierarchy.kernels import LikelihoodMixture
from wearsim.uq.hierarchy.noise import Noise, fit_noise

_FIRST_NOISE = Noise(1e-6, 0.2e-3, 0.1e-6)  # of a trace without shoulders, before its own is fitted
_NOISE_OF_LIFT = Noise(1e-6, 0.05, 1e-6)  # before noise is fitted to the residuals; lengths in rad
_BAND = 100  # draws of the band of fitted profiles
_SUSPECT = 1.6


@dataclass(frozen=True)
class Fit:
    """A trace with the profiles that the model predicts for it.

    Parameters
    ----------
    trace : Trace
    fitted, low, high : ndarray, shape (points,)
        Best profile, and the band that holds 95 % of the profiles [m].
    ratio, probability, correlation : float, optional
        Mean square of the residuals whitened by the noise of the shoulders, 1 where model and noise
        are right; probability of a greater one; autocorrelation of neighbouring whitened residuals.
        None without shoulders, where the residuals themselves give the noise.
    suspects : tuple of str
        Warnings on depth and form of the groove.
    """

    trace: Trace
    fitted: FloatArray
    low: FloatArray
    high: FloatArray
    ratio: float | None = None
    probability: float | None = None
    correlation: float | None = None
    suspects: tuple[str, ...] = ()

    @property
    def warnings(self) -> list[str]:
        """Warnings if the model does not describe the trace."""
        texts = [f"{self.trace.name}: {text}" for text in self.suspects]
        if self.ratio is not None and self.ratio >= _SUSPECT:
            texts.append(
                f"{self.trace.name}: residuals are {np.sqrt(self.ratio):.1f} times the noise of the"
                " shoulders: the model does not describe this groove, and its interval may be too"
                " small; is it of another rig, or are inputs missing that the scenario should draw?"
            )
        return texts


@dataclass(frozen=True)
class Identified:
    """Wear factor from one measured groove, or from several of the same test.

    Parameters
    ----------
    item : Measurement
    likelihood : DrawLikelihood
        For the draws of the test.
    kernel : LikelihoodMixture
        Likelihood of ln K/H.
    depth : tuple of float, optional
        Measured depth: value, and ends of the 95 % interval [m]; None without shoulders, and where
        the surface was not flat before wear.
    model_depth, area, energy : tuple of float
        Depth, or peak to peak of a change of the lift [m], worn area [m^2] and energy [J] of the
        model: value and 95 % interval; no area of a lift.
    fit : Fit, optional
        None for a measured depth.
    passes : float
    shares : mapping of str to float
        Part of the variance of ln K/H that follows each input.
    """

    item: Measurement
    likelihood: DrawLikelihood
    kernel: LikelihoodMixture
    depth: tuple[float, float, float] | None
    model_depth: tuple[float, float, float]
    area: tuple[float, float, float] | None
    energy: tuple[float, float, float]
    fit: Fit | None
    passes: float
    shares: Mapping[str, float] = field(default_factory=dict)


def kernel_of(likelihood: DrawLikelihood, name: str) -> LikelihoodMixture:
    """Return the likelihood of ln K/H, the draws of the other inputs averaged.

    Raises
    ------
    ScenarioError
        If no draw describes the test.
    """
    known = np.isfinite(likelihood.log_evidence)
    if not known.any():
        raise mistake_in(name, "no draw of the inputs describes this groove")
    return LikelihoodMixture.of(
        likelihood.log_evidence[known], likelihood.mean[known], likelihood.std[known]
    )


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
    fit, depth, suspects = None, None, []
    if trace is None:
        assert item.depth is not None
        assert item.depth_std is not None
        depth = _around(item.depth, item.depth_std)
        likelihood = depth_likelihood(item.depth, item.depth_std, grown, item.surface)
    elif item.lift is not None:
        model: TraceLikelihood = LiftLikelihood(
            trace.y,
            trace.height,
            _NOISE_OF_LIFT,
            replace(grown, start=np.zeros(len(CURVE_ANGLES)), y=CURVE_ANGLES),
            item.surface,
            lateral=False,
            start=False,
            curvature=item.runout,
        )
        model = _with_noise(model)
        likelihood = model.integrated()
        fit = _fit(model, likelihood, trace)
    else:
        if trace.noise is not None and trace.depth is not None:
            rows = profiles_of_depth(grown, item.surface, trace.depth)
            suspects = check_width(trace, grown.y, rows)
            if item.shoulders is None:  # beyond the predicted groove, if there is something
                again = level(trace, None, crown_radius, extents_of(grown.y, rows))
                trace = trace if again.noise is None else again
            if trace.difference or not grown.start.any():
                depth = _around(*measured_depth(trace, crown_radius, item.curvature))
        elif item.curvature:
            raise item.refused(
                Mistake(
                    "",
                    "curvature",
                    "cannot be distinguished from the groove, since the trace has no unworn"
                    " shoulders",
                    "true",
                    "a trace with shoulders, or no curvature",
                )
            )
        model = TraceLikelihood(
            trace.y,
            trace.height,
            trace.noise or _FIRST_NOISE,
            grown,
            item.surface,
            start=item.body == "cylinder" and not trace.difference,
            curvature=item.curvature,
            least=trace.spread,
        )
        if trace.noise is None:
            model = _with_noise(model)
        likelihood = model.integrated()
        check_covered(likelihood, grown, trace)
        fit = _fit(model, likelihood, trace)
    kernel = kernel_of(likelihood, item.name)
    sizes, step = grown.depth[item.surface], grown.y[1] - grown.y[0]
    model_depth = _interval(size_of(item.surface, sizes), grown, likelihood)
    area = None if item.lift else _interval(sizes.sum(axis=2) * step, grown, likelihood)
    energy = _interval(grown.energy, grown, likelihood)
    if fit is not None and fit.trace.noise is not None:
        suspects += [*other_depth(depth, model_depth)] if depth is not None else []
        fit = replace(fit, suspects=(*suspects, *other_form(model, likelihood)))
    return Identified(item, likelihood, kernel, depth, model_depth, area, energy, fit, passes)


def _around(value: float, std: float) -> tuple[float, float, float]:
    """Return a normal value with its 95 % interval."""
    return value, value - 1.96 * std, value + 1.96 * std


def _with_noise(model: TraceLikelihood) -> TraceLikelihood:
    """Return a model with the noise of the residuals from its best profile."""
    for _ in range(2):
        position, _, chi2 = model.maximum()
        best = np.array([int(chi2.argmin())])
        residual = model.height + model.worn(best, *position[best].T)[:, 0]
        model = replace(model, noise=fit_noise(model.y, residual))
    return model


def _fit(model: TraceLikelihood, likelihood: DrawLikelihood, trace: Trace) -> Fit:
    """Return the best profile, the band of profiles, and the check of residuals."""
    from scipy.special import fdtrc  # noqa: PLC0415  (slow to import)

    score = np.where(np.isfinite(likelihood.log_evidence), likelihood.log_evidence, -np.inf)
    weight = np.exp(score - score.max())
    order = np.argsort(-weight)[:_BAND]
    # equally spaced quantiles of the draws, and of ln K within a draw
    bound = np.cumsum(weight[order]) / weight[order].sum()
    draws = order[np.searchsorted(bound, (np.arange(_BAND) + 0.5) / _BAND)]
    spread = np.sqrt(2.0) * np.sin(2.4 * np.arange(_BAND))  # unit variance, no pattern
    worn = model.worn(
        draws, likelihood.mean[draws] + spread * likelihood.std[draws], likelihood.shift[draws]
    )
    best = np.array([int(order[0])])
    at_best = likelihood.mean[best], likelihood.shift[best]
    worn = np.column_stack([model.worn(best, *at_best), worn])
    forms = model.forms
    white = model.noise.whitened(trace.y, np.column_stack([forms, trace.height[:, None] + worn]))
    count = forms.shape[1]
    profiles = forms @ np.linalg.lstsq(white[:, :count], white[:, count:], rcond=None)[0] - worn
    low, high = np.quantile(profiles[:, 1:], (0.025, 0.975), axis=1)
    fit = Fit(trace, profiles[:, 0], low, high)
    if trace.noise is None:
        return fit
    residual = model.residual(best, *at_best)[:, 0]
    squares, freedom = float(residual @ residual), len(trace.y) - 2 - count
    ratio = squares / freedom
    return replace(
        fit,
        ratio=ratio,
        # the noise is estimated from the points of the shoulders
        probability=float(fdtrc(freedom, np.count_nonzero(trace.unworn), ratio)),
        correlation=float(residual[1:] @ residual[:-1]) / squares,
    )


def _interval(
    sizes: FloatArray, grown: Grown, likelihood: DrawLikelihood
) -> tuple[float, float, float]:
    """Return a size of the groove and its 95 % interval, from sizes (draws, records)."""
    score = np.where(np.isfinite(likelihood.log_evidence), likelihood.log_evidence, -np.inf)
    weight = np.exp(score - score.max())
    weight /= weight.sum()
    logs = np.log(np.maximum(sizes, 1e-300))
    mean, slope = np.empty((2, len(logs)))
    for draw, (known, values) in enumerate(zip(grown.ln_k, logs, strict=True)):
        mean[draw] = np.interp(likelihood.mean[draw], known, values)
        place = int(np.clip(np.searchsorted(known, likelihood.mean[draw]), 1, len(known) - 1))
        slope[draw] = (values[place] - values[place - 1]) / (known[place] - known[place - 1])
    centre = float(weight @ mean)
    variance = float(weight @ ((mean - centre) ** 2 + (slope * likelihood.std) ** 2))
    ends = centre + 1.96 * np.sqrt(variance) * np.array([0.0, -1.0, 1.0])
    value, low, high = np.exp(ends).tolist()
    return value, low, high


def exponent(rows: Sequence[Identified]) -> tuple[float, float, float] | None:
    """Return the exponent p of depth ~ n^p from traces of one test, and its 95 % interval.

    Parameters
    ----------
    rows : sequence of Identified
        Traces of one test; traces of the same place as the first are used.
    """
    rows = [row for row in rows if row.item.surface == rows[0].item.surface]
    if len(rows) < 2:
        return None
    x = np.log([row.passes for row in rows])
    depth = np.array([row.depth or row.model_depth for row in rows])
    weight = (np.log(depth[:, 2] / depth[:, 1]) / 3.92) ** -2
    middle = np.average(x, weights=weight)
    spread = float((weight * (x - middle) ** 2).sum())
    slope = float((weight * (x - middle) * np.log(depth[:, 0])).sum()) / spread
    half = 1.96 * spread**-0.5
    return slope, slope - half, slope + half
