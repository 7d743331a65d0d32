"""Measured traces: spikes and dropouts, levelling on unworn shoulders, and noise."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from wearsim.errors import ScenarioError, mistake_in
from wearsim.profiles import load_lines, load_profile
from wearsim.studies.identify.measurements import Measurement
from wearsim.types import BoolArray, FloatArray, Profile
from wearsim.uq.hierarchy.noise import MOST_POINTS, Noise, fit_noise, noise_models

_FEWEST = 40  # points
_WINDOW = 1e-3  # m, of the running median that finds spikes
_SPIKE = 10.0  # robust standard deviations
_MOST_SPIKES = 0.2  # fraction of the points
_RUN = 10  # equal readings in a row that are a dropout
_MARGIN = 0.4e-3  # m, between the predicted groove and its shoulders
_LEAST_SHOULDER = 0.4e-3  # m, on each side
_BOTTOM = 0.5  # part of the half-width of a groove in which its bottom is a parabola


@dataclass(frozen=True)
class Trace:
    """A trace ready for the likelihood.

    Parameters
    ----------
    name : str
    y, height : ndarray, shape (points,)
        Rising positions and heights, levelled where there are shoulders [m].
    unworn : ndarray of bool, shape (points,)
        Points of the shoulders; none where there are no shoulders.
    levelled : str
        What the trace was levelled on, in words.
    noise : Noise, optional
        None where there are no shoulders to fit it on.
    depth, area : float, optional
        Greatest depth below the shoulders [m] and worn area [m^2]; None without shoulders.
    middle : float
        Centroid of the groove [m].
    inclination : float
        Slope that levelling removed [rad].
    spread : float
        Standard error of the mean of several lines if it exceeds the noise of the shoulders [m].
    difference : bool
        Whether it is the difference of traces after and before the test.
    notes : tuple of str
    """

    name: str
    y: FloatArray
    height: FloatArray
    unworn: BoolArray
    levelled: str
    noise: Noise | None
    depth: float | None
    area: float | None
    middle: float
    inclination: float = 0.0
    spread: float = 0.0
    difference: bool = False
    notes: tuple[str, ...] = ()

    @property
    def relative_noise(self) -> float:
        """Standard deviation of the noise over the depth; infinite where it is not known."""
        if self.noise is None or not self.depth:
            return math.inf
        return self.noise.std / self.depth


def read_trace(item: Measurement, crown_radius: float) -> Trace:
    """Read the trace of a measurement and level it.

    Parameters
    ----------
    item : Measurement
        With a profile.
    crown_radius : float
        Crown radius of the roller, which gives the width of a groove of any depth [m].

    Raises
    ------
    ScenarioError
        If the trace cannot be used: too short, too many spikes, reversed sign, wrong units, or a
        groove wider than the trace.
    """
    notes: list[str] = []
    profile, spread = _mean_line(item.profile, item, notes)
    if item.before is not None:
        before, other = _mean_line(item.before, item, notes)
        low, high = max(profile.y[0], before.y[0]), min(profile.y[-1], before.y[-1])
        kept = (profile.y >= low) & (profile.y <= high)
        if kept.sum() < _FEWEST:
            raise _error(item, "the traces before and after the test do not overlap")
        y = profile.y[kept]
        height = profile.height[kept] - np.interp(y, before.y, before.height)
        profile, spread = Profile(y, height), float(np.hypot(spread, other))
    levelled = _thinned(profile, item, crown_radius, averaged=False)
    noise = levelled.noise
    if len(profile.y) > MOST_POINTS and noise is not None and noise.white > noise.sigma:
        levelled = _thinned(profile, item, crown_radius, averaged=True)
    if levelled.noise is not None and spread > levelled.noise.std:
        # lines of a map differ more in the groove than on the shoulders
        ratio = spread / levelled.noise.std
        noise = levelled.noise
        noise = Noise(noise.sigma * ratio, noise.length, noise.white * ratio)
        levelled = replace(levelled, noise=noise, spread=spread)
        notes.append(f"noise from the spread of the lines, {1e6 * spread:.2g} um")
    return replace(levelled, notes=(*notes, *levelled.notes))


def _error(item: Measurement, what: str, expected: str | None = None) -> ScenarioError:
    return mistake_in(item.name, what, None, expected)


def _mean_line(path: object, item: Measurement, notes: list[str]) -> tuple[Profile, float]:
    """Return a profile without spikes, and the standard error of the mean of several lines [m]."""
    assert path is not None
    spread = 0.0
    lines = [] if item.choice.rows or item.choice.columns else load_lines(path)  # type: ignore[arg-type]
    if len(lines) > 1:
        y = lines[0].y
        inside = [line for line in lines if len(line.y) == len(y)]
        heights = np.array([line.height for line in inside])
        heights -= heights.mean(axis=1, keepdims=True)
        mean = np.median(heights, axis=0) if len(inside) > 4 else heights.mean(axis=0)
        spread = float(np.sqrt(heights.var(axis=0, ddof=1).mean() / len(inside)))
        profile = Profile(y, mean)
        notes.append(f"mean of {len(inside)} lines")
    else:
        profile = load_profile(path, item.choice)  # type: ignore[arg-type]
    good = _without_spikes(profile)
    removed = len(good) - int(good.sum())
    level = int(_in_runs(profile.height).sum())
    if level > _MOST_SPIKES * len(good):
        raise _error(
            item,
            f"{level} of {len(good)} points are at its greatest or least height, {_RUN} or more in"
            " a row, as where an instrument is out of range or noise is missing",
            "a trace as it was measured",
        )
    if removed > _MOST_SPIKES * len(good):
        raise _error(
            item,
            f"{removed} of {len(good)} points are spikes or dropouts",
            "a trace with fewer of them",
        )
    if removed:
        notes.append(f"{removed} spikes or dropouts left out")
    if good.sum() < _FEWEST:
        raise _error(item, f"has {int(good.sum())} points", f"{_FEWEST} or more")
    return Profile(profile.y[good], profile.height[good]), spread


def _without_spikes(profile: Profile) -> BoolArray:
    """Return which points are neither spikes nor dropouts."""
    y, good = profile.y, ~_in_runs(profile.height)
    for _ in range(2):
        kept = np.flatnonzero(good)
        # at the ends the window is mirrored, where an inclination looks like a bend
        height = profile.height - np.polyval(_line_of_ends(y[kept], profile.height[kept]), y)
        half = int(np.clip(0.5 * _WINDOW / float(np.median(np.diff(y[kept]))), 3, len(kept) // 4))
        padded = np.pad(height[kept], half, mode="symmetric")
        median = np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1), axis=1)
        away = np.abs(height[kept] - median)
        scale = 1.4826 * float(np.median(away))
        limit = np.full(len(kept), max(_SPIKE * scale, 1e-9))
        limit[:half] *= 4.0  # the window is cut off at the ends, which may be inclined
        limit[-half:] *= 4.0
        far = away > limit
        if scale == 0.0 or not far.any():
            break
        good[kept[far]] = False
    return good


def _in_runs(height: FloatArray) -> BoolArray:
    """Return which points belong to runs of equal readings at either end of the range."""
    inside = np.zeros(len(height), dtype=np.bool_)
    for part in np.split(np.arange(len(height)), np.flatnonzero(np.diff(height) != 0.0) + 1):
        extreme = height[part[0]] in {height.min(), height.max()}
        if len(part) >= _RUN and extreme and len(part) < len(height):
            inside[part] = True
    return inside


def _line_of_ends(y: FloatArray, height: FloatArray) -> tuple[float, float]:
    """Return slope and offset of the line through the medians of both ends of a trace."""
    ends = max(2, int(0.06 * len(y)))
    first, last = float(np.median(height[:ends])), float(np.median(height[-ends:]))
    start = float(y[:ends].mean())
    slope = (last - first) / (float(y[-ends:].mean()) - start)
    return slope, first - slope * start


def block_means(length: int, *arrays: FloatArray) -> tuple[FloatArray, ...]:
    """Return the means of arrays over blocks of neighbouring points, the last may be shorter."""
    starts = np.arange(0, len(arrays[0]), length)
    sizes = np.diff(np.append(starts, len(arrays[0])))
    return tuple(np.add.reduceat(values, starts) / sizes for values in arrays)


def _thinned(profile: Profile, item: Measurement, crown_radius: float, averaged: bool) -> Trace:
    """Return a levelled trace of at most `MOST_POINTS` points.

    Means over neighbouring points lessen white noise. Of correlated noise single points are kept,
    since means of an exponentially correlated process are not exponentially correlated.
    """
    y, height = profile.y, profile.height
    count = -(-len(y) // MOST_POINTS)
    y, height = block_means(count, y, height) if averaged else (y[::count], height[::count])
    points, less = (y, height, np.zeros(len(y), dtype=np.bool_)), item.before is not None
    trace = Trace(item.name, *points, "", None, None, None, 0.0, difference=less)
    return level(trace, item.shoulders, crown_radius)


def level(
    trace: Trace,
    given: float | None,
    crown_radius: float,
    extents: tuple[float, float] | None = None,
) -> Trace:
    """Level a trace on its unworn shoulders and fit the noise on them.

    Parameters
    ----------
    trace : Trace
    given : float, optional
        Distance from the middle of the groove beyond which the surface is unworn [m].
    crown_radius : float
        Crown radius of the roller [m].
    extents : tuple of float, optional
        Predicted extents of the groove to the left and right of its middle [m]; shoulders begin
        beyond them and a margin. By default the extents of a conforming groove as deep as measured.

    Raises
    ------
    ScenarioError
        As `read_trace`.
    """
    y, height = trace.y, trace.height
    item = Measurement(trace.name)
    level_ = height - np.polyval(_line_of_ends(y, height), y)
    _check_sign(item, level_)
    unworn = np.zeros(len(y), dtype=np.bool_)
    middle = 0.5 * (y[0] + y[-1])
    for _ in range(4):
        depth = float(np.quantile(-level_, 0.98))
        deep = np.maximum(-level_ - 0.3 * depth, 0.0)
        middle = float((deep * y).sum() / max(deep.sum(), 1e-300))
        half = float(np.sqrt(2.0 * crown_radius * max(depth, 0.0)))
        first, last = extents or (half, half)
        reach = (given, given) if given is not None else (first + _MARGIN, last + _MARGIN)
        unworn = (y < middle - reach[0]) | (y > middle + reach[1])
        sides = (unworn & (y < middle)), (unworn & (y > middle))
        if min(_length(y, side) for side in sides) < _LEAST_SHOULDER or unworn.sum() < 16:
            return _without_shoulders(trace, item, given, level_, middle)
        line = np.polyfit(y[unworn], height[unworn], 1)
        level_ = height - np.polyval(line, y)
    depth = float(-smoothed(level_).min())
    try:
        noise = fit_noise(y[unworn], level_[unworn])
    except ValueError as error:
        raise _error(item, str(error)) from error
    area = float(-np.trapezoid(np.where(unworn, 0.0, level_), y))
    words = (
        f"y < {1e3 * (middle - reach[0]):.1f}, > {1e3 * (middle + reach[1]):.1f} mm"
        f" ({'given' if given is not None else 'found'})"
    )
    if trace.difference:
        words += ", less the trace before"
    return replace(
        trace,
        height=level_,
        unworn=unworn,
        levelled=words,
        noise=noise,
        depth=depth,
        area=area,
        middle=middle,
        inclination=trace.inclination + float(line[0]),
    )


def _length(y: FloatArray, side: BoolArray) -> float:
    return float(np.ptp(y[side])) if side.any() else 0.0


def _without_shoulders(
    trace: Trace, item: Measurement, given: float | None, level_: FloatArray, middle: float
) -> Trace:
    """Return a trace of which only the shape can be used, or refuse it."""
    if given is not None:
        raise _error(
            item,
            f"there is no unworn surface on both sides beyond {1e3 * given:.4g} mm from the middle"
            f" of the groove at {1e3 * middle:.4g} mm",
            "a smaller distance, or a longer trace",
        )
    note = "no unworn shoulders: its depth is unknown, and K/H follows from shape and width only"
    return replace(
        trace, height=level_, levelled="nothing: shape and width only", middle=middle, notes=(note,)
    )


def _check_sign(item: Measurement, level_: FloatArray) -> None:
    """Refuse a trace that rises where it should be worn."""
    smooth = smoothed(level_)
    above, below = float(smooth.max()), float(-smooth.min())
    if above > 3.0 * max(below, 0.0):
        raise _error(
            item,
            f"rises {1e6 * above:.4g} um above its ends and falls {1e6 * max(below, 0.0):.3g} um"
            " below them; heights are positive up, and worn material is negative: if the column"
            " holds depths, choose it with --columns y,-NAME, or call it depth",
        )


def measured_depth(
    trace: Trace, crown_radius: float, curvature: bool = False
) -> tuple[float, float]:
    """Return the greatest depth of a groove below its shoulders, and its standard deviation [m].

    It is taken from a parabola through the bottom of the groove, fitted together with offset,
    inclination and perhaps curvature of the shoulders under correlated noise; no wear model is
    used. The deepest point, even of a smoothed trace, is too deep on average.

    Parameters
    ----------
    trace : Trace
        With shoulders.
    crown_radius : float
        Crown radius of the roller, which is nearly the radius of the bottom [m].
    curvature : bool
        Whether the trace has an unknown curvature.
    """
    assert trace.depth is not None
    reach = _BOTTOM * np.sqrt(2.0 * crown_radius * trace.depth)
    bottom = np.abs(trace.y - trace.middle) < reach
    used = bottom | trace.unworn
    y, height = trace.y[used], trace.height[used]
    inside = bottom[used][:, None] * np.vander((y - trace.middle) / reach, 3, True)
    forms = np.hstack(
        [inside, np.vander((y - trace.middle) / np.ptp(y), 3 if curvature else 2, True)]
    )
    models = noise_models(y, height, forms, trace.spread)
    white = models.whitened(np.column_stack([height, forms])).transpose(1, 0, 2)
    z, lines = white[:, :, :1], white[:, :, 1:]
    inverse = np.linalg.inv(lines.transpose(0, 2, 1) @ lines)
    coefficients = (inverse @ lines.transpose(0, 2, 1) @ z)[..., 0]
    squares = ((z[..., 0] - np.einsum("mjf,mf->mj", lines, coefficients)) ** 2).sum(axis=1)
    score = models.log_weight - models.exponent * np.log(squares)
    vertex = np.clip(-0.5 * coefficients[:, 1] / coefficients[:, 2], -1.0, 1.0)
    slope = np.zeros_like(coefficients)
    slope[:, :3] = np.column_stack([np.ones_like(vertex), vertex, vertex**2])
    depth = -(slope * coefficients).sum(axis=1)
    variance = np.einsum("mf,mfg,mg->m", slope, inverse, slope) * squares / (2.0 * models.exponent)
    weight = np.exp(score - score.max())
    weight /= weight.sum()
    mean = float(weight @ depth)
    return mean, float(np.sqrt(weight @ (variance + (depth - mean) ** 2)))


def half_depth_width(y: FloatArray, worn: FloatArray) -> float:
    """Return the width of a groove at half of its depth [m].

    Parameters
    ----------
    y, worn : ndarray, shape (points,)
        Rising positions and worn depth [m].
    """
    deep = np.flatnonzero(worn > 0.5 * worn.max())
    ends = []
    for inner, outer in ((deep[0], deep[0] - 1), (deep[-1], deep[-1] + 1)):
        if not 0 <= outer < len(y):
            return float("nan")
        part = (0.5 * worn.max() - worn[inner]) / (worn[outer] - worn[inner])
        ends.append(float(y[inner] + part * (y[outer] - y[inner])))
    return ends[1] - ends[0]


def smoothed(height: FloatArray, points: int = 9) -> FloatArray:
    """Return a moving mean, whose minimum is less biased by noise than the deepest point."""
    padded = np.pad(height, points // 2, mode="edge")
    return np.convolve(padded, np.full(points, 1.0 / points), mode="valid")
