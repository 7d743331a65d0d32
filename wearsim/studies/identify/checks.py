"""Checks of a measured groove against the model: width, depth, form of the trace, residuals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from wearsim.errors import mistake_in
from wearsim.studies.identify.likelihood import DrawLikelihood, TraceLikelihood
from wearsim.studies.identify.traces import Trace, half_depth_width, smoothed
from wearsim.studies.identify.trajectories import Grown
from wearsim.types import FloatArray

_EDGE = 0.01  # of the depth, where a groove ends
_WIDTH_WARNED, _WIDTH_REFUSED = 0.08, 0.25  # relative difference of measured and predicted width
_FOREIGN = 100.0  # mean square of the residuals over the variance of the noise
_LEAST_PART = 0.1  # of a variance, that a difference of two estimates has at least
_OTHER_DEPTH = 2.58  # standard deviations: 2 to 3 sound grooves of a hundred are warned of
_OTHER_FORM = 1.645  # the same: 6 straight traces of a hundred, since a curvature is seen late


def profiles_of_depth(grown: Grown, body: str, depth: float) -> FloatArray:
    """Return the worn profile of each draw at a depth, shape (draws, strips) [m].

    The profile of the nearest record is scaled as a groove that grows.
    """
    rows = grown.depth[body]
    record = np.abs(np.log(np.maximum(rows.max(axis=2), 1e-12) / depth)).argmin(axis=1)
    chosen = rows[np.arange(len(rows)), record]
    stretch = np.sqrt(depth / chosen.max(axis=1))
    centre = (chosen * grown.y).sum(axis=1) / chosen.sum(axis=1)
    return np.array(
        [
            factor**2 * np.interp((grown.y - middle) / factor + middle, grown.y, row)
            for factor, middle, row in zip(stretch, centre, chosen, strict=True)
        ]
    )


def extents_of(y: FloatArray, rows: FloatArray) -> tuple[float, float]:
    """Return the predicted extents of a groove to the left and right of its centroid [m]."""
    worn = rows > _EDGE * rows.max(axis=1, keepdims=True)
    middle = (rows * y).sum(axis=1) / rows.sum(axis=1)
    left = middle - y[worn.argmax(axis=1)]
    right = y[len(y) - 1 - worn[:, ::-1].argmax(axis=1)] - middle
    # a trace may run in either direction
    reach = float(np.quantile(np.concatenate([left, right]), 0.975))
    return reach, reach


def check_width(trace: Trace, y: FloatArray, rows: FloatArray) -> list[str]:
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
        return []
    assert trace.depth is not None
    what = (
        f"the groove is {1e6 * trace.depth:.4g} um deep and {1e3 * width:.4g} mm wide at half of"
        f" its depth, where the model predicts {1e3 * low:.4g}"
        + (f" to {1e3 * high:.4g}" if high > 1.005 * low else "")
        + " mm for this depth: is it of another rig, or are its units others?"
    )
    if away > _WIDTH_REFUSED:
        raise mistake_in(trace.name, what)
    return [what]


def check_covered(likelihood: DrawLikelihood, grown: Grown, trace: Trace) -> None:
    """Refuse a trace whose best wear factor is at the end of those computed."""
    best = int(likelihood.chi2.argmin())
    reach = likelihood.mean[best] + likelihood.std[best]
    if trace.depth is None and reach > grown.ln_k[best, -1]:
        raise mistake_in(
            trace.name,
            "the groove may be wider than the trace: without its edges and the unworn"
            " surface beside it nothing can be identified",
            f"a trace of {1e3 * (trace.y[-1] - trace.y[0]):.4g} mm",
            "a longer one",
        )
    ratio = float(likelihood.chi2.min()) / (len(trace.y) - 4)
    if ratio > _FOREIGN:
        raise mistake_in(
            trace.name,
            f"the model does not describe this groove: residuals are {ratio**0.5:.0f} times"
            " the noise of the shoulders",
            None,
            "a trace of the rig of the scenario, and its units",
        )


def other_depth(
    measured: tuple[float, float, float], model: tuple[float, float, float]
) -> list[str]:
    """Return a warning if the model's depth is not the measured one.

    Of two estimates of the same depth the more precise one, usually the model's from the whole
    trace, is taken as efficient: the variance of the difference is then that of the variances
    (Hausman, Econometrica 46 (1978), DOI 10.2307/1913827).
    """
    less, more = sorted(((ends[2] - ends[1]) / 3.92) ** 2 for ends in (measured, model))
    scale = np.sqrt(max(more - less, _LEAST_PART * more))
    if abs(measured[0] - model[0]) < _OTHER_DEPTH * scale:
        return []
    what = (
        f"the measured depth is {_micrometres(measured)}, and the model's {_micrometres(model)}:"
        " the model does not describe the shape of this groove, and K/H and its interval are wrong;"
        " does the roller wear too (--share k=cylinder,roller, or its K/H in the scenario), or is"
        " the crown radius another?"
    )
    return [what]


def _micrometres(ends: tuple[float, float, float]) -> str:
    value, low, high = (1e6 * end for end in ends)
    return f"{value:.2f} um ({low:.2f} to {high:.2f})"


def other_form(model: TraceLikelihood, likelihood: DrawLikelihood) -> list[str]:
    """Return a warning if a curvature of the trace changes K/H by more than chance.

    Only the most probable draw of the inputs is considered.
    """
    if model.curvature:
        return []
    best = [int(np.nanargmax(likelihood.log_evidence))]
    grown = model.grown
    depth = {model.body: grown.depth[model.body][best]}
    alone = replace(grown, ln_k=grown.ln_k[best], depth=depth, energy=grown.energy[best])
    curve = replace(model, grown=alone, curvature=True).integrated()
    change = float(curve.mean[0] - likelihood.mean[best[0]])
    straight = float(likelihood.std[best[0]] ** 2)
    more = max(float(curve.std[0] ** 2) - straight, _LEAST_PART * straight)
    if abs(change) < _OTHER_FORM * np.sqrt(more):
        return []
    what = (
        "the residuals may follow a curvature of the trace; with it K/H changes by"
        f" {100.0 * change:+.1f} %: fit it with curvature = true (--curvature), or measure the same"
        " place before the test"
    )
    return [what]
