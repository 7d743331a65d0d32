"""Panels of the random inputs and of the power."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

import numpy as np
from matplotlib.axes import Axes

from wearsim.report.figures import name_axes
from wearsim.report.panels import BLUE, GREEN, ORANGE, RED
from wearsim.report.text import PER_SI
from wearsim.studies.run.inputs import LOAD, TILT, YAW
from wearsim.types import FloatArray
from wearsim_chevalier2005 import paper
from wearsim_chevalier2005.comparison_inputs import maxent_of

if TYPE_CHECKING:
    from wearsim.studies.dissipation.result import DissipationResult
    from wearsim_chevalier2005.study import Reproduction

MM, W_MM = PER_SI["mm"], PER_SI["W/mm"]
CLASSES = round(paper.CLASSES.value)
MOST_LINES = 1000
_BARS = 20
_FIRST = 10  # realisations below which an estimate does not set the scale
_Y = "y across [mm]"


def draw_inputs(panels: dict[str, Axes], results: Reproduction) -> None:
    """Draw the load, and histograms of lateral creepage and spin."""
    _draw_load_distribution(panels["9a"], results)
    loads = results.all_inputs.values("normal_force")
    axes = panels["9b"]
    axes.plot(np.arange(1, len(loads) + 1), loads, ".", ms=2.5, color=BLUE)
    for away in (-1.0, 0.0, 1.0):
        _mark_level(axes, paper.LOAD_MEAN.value + away * paper.LOAD_STD.value)
    name_axes(axes, "Fig. 9b: realisations of N; mean, mean ± std", "realisation", "N [N]")
    drawn, radius = results.all_inputs.inputs, results.scenario.roller.radius
    _draw_bars(panels["11a"], drawn[YAW], paper.LATERAL_STD.value)
    name_axes(panels["11a"], "Fig. 11a: lateral creepage; ± std", "eta", "realisations")
    panels["11a"].ticklabel_format(axis="x", scilimits=(0, 0))
    _draw_bars(panels["11b"], drawn[TILT] / radius, paper.SPIN_STD.value)
    name_axes(panels["11b"], "Fig. 11b: spin; ± std", "phi [1/m]", "realisations")


def _draw_load_distribution(axes: Axes, results: Reproduction) -> None:
    distribution, printed = maxent_of(results.scenario, LOAD), paper.LOAD_MULTIPLIERS
    low, high = distribution.bulk
    n = np.linspace(max(distribution.support[0], low - 0.2 * (high - low)), high, 401)
    loads = results.all_inputs.values("normal_force")
    axes.hist(loads, CLASSES, density=True, color=BLUE, alpha=0.3, label="realisations")
    axes.plot(n, distribution.density(n), color=BLUE, label="maximum entropy")
    rounded = np.exp(-(printed.l0 + printed.l1 * n + printed.l2 * n * n))
    axes.plot(n, rounded, color=RED, ls="--", label="printed multipliers")
    _name_lines(axes, "upper left")
    axes.set_ylim(top=1.25 * axes.get_ylim()[1])
    name_axes(axes, "Fig. 9a: distribution of the load N", "N [N]", "density [1/N]")


def _draw_bars(axes: Axes, values: FloatArray, std: float) -> None:
    axes.hist(values, _BARS, color=BLUE, alpha=0.6, edgecolor="white", lw=0.5)
    for place in (-std, std):
        _mark_place(axes, place)


def draw_convergence(panels: dict[str, Axes], results: Reproduction) -> None:
    """Draw mean and standard deviation of the power against the number of realisations."""
    estimates = results.all_inputs.convergence()
    curves = {
        "mean": (estimates.mean, estimates.mean_error),
        "std": (estimates.std, estimates.std_error),
    }
    for name, (value, error) in curves.items():
        axes = panels[f"14 {name}"]
        axes.fill_between(
            estimates.count, value - error, value + error, color=BLUE, alpha=0.25, lw=0,
            label="± standard error",
        )  # fmt: skip
        axes.plot(estimates.count, value, color=BLUE)
        late = (estimates.count >= min(_FIRST, estimates.count[-1])) & np.isfinite(error)
        low, high = float((value - error)[late].min()), float((value + error)[late].max())
        if name == "mean":
            _mark_level(axes, paper.MEAN_POWER.value)
            high = max(high, paper.MEAN_POWER.value)
        axes.set_ylim(low - 0.08 * (high - low), high + 0.08 * (high - low))
        axes.set_xlim(0.0, float(estimates.count[-1]))
        if estimates.count[-1] >= paper.CONVERGED_AT.value:
            _mark_place(axes, paper.CONVERGED_AT.value)
        _name_lines(axes, "upper right" if name == "std" else "lower right")
        name_axes(axes, f"Fig. 14: {name} of $P_d$ [W]", "realisations", "")


def draw_powers(panels: dict[str, Axes], results: Reproduction) -> None:
    """Draw the distribution of the power with all inputs, and without misalignment."""
    whole = results.all_inputs
    axes = panels["15a"]
    weights = np.full(whole.count, 1.0 / whole.count)
    axes.hist(whole.power, CLASSES, weights=weights, color=BLUE, alpha=0.6, edgecolor="white")
    name_axes(axes, f"Fig. 15a: $P_d$ in {CLASSES} classes", "$P_d$ [W]", "probability")
    _mark_power(axes, whole, paper.MEAN_POWER.value, paper.POWER_RANGE.value)
    axes = panels["15b"]
    across = _across(whole.power, paper.POWER_RANGE.high)
    axes.plot(across, smoothed(whole.power, across), color=BLUE, label="all inputs")
    axes.plot(across, normal(whole.power, across), color=ORANGE, label="normal, same std")
    limit = smoothed(results.max_power, across)
    axes.plot(across, limit, color=GREEN, lw=1.0, label=r"bound $\mu N V$|creepage|")
    axes.set_ylim(0.0, 1.3 * axes.get_ylim()[1])
    _name_lines(axes, "upper right")
    name_axes(axes, "Fig. 15b: density of $P_d$", "$P_d$ [W]", "density [1/W]")
    _mark_power(axes, whole, paper.MEAN_POWER.value, paper.POWER_RANGE.value)
    axes, aligned = panels["16"], results.aligned
    across = _across(aligned.power, paper.ALIGNED_MEAN_POWER.value)
    axes.hist(aligned.power, CLASSES, density=True, color=BLUE, alpha=0.3, label="realisations")
    axes.plot(across, smoothed(aligned.power, across), color=BLUE, label="density")
    axes.plot(across, normal(aligned.power, across), color=ORANGE, label="normal, same std")
    _name_lines(axes, "upper right")
    name_axes(axes, "Fig. 16: without misalignment", "$P_d$ [W]", "density [1/W]")
    _mark_power(axes, aligned, paper.ALIGNED_MEAN_POWER.value, ())


def _across(power: FloatArray, beyond: float) -> FloatArray:
    """Return the powers at which a density is drawn, up to above the printed range."""
    return np.linspace(0.0, 1.08 * max(float(power.max()), beyond), 400)


def smoothed(values: FloatArray, across: FloatArray) -> FloatArray:
    """Return a Gaussian kernel estimate of the density of realisations.

    Parameters
    ----------
    values : ndarray, shape (realisations,)
        The realisations.
    across : ndarray, shape (points,)
        Points of the density.

    Returns
    -------
    ndarray, shape (points,)

    Notes
    -----
    The kernel width is 1.06 std n^(-1/5): Silverman, Density Estimation (1986), eq. 3.28.
    """
    width = 1.06 * float(values.std(ddof=1)) * len(values) ** -0.2
    density: FloatArray = np.zeros_like(across)
    for block in np.array_split(values, max(len(values) // 1000, 1)):
        density += np.exp(-0.5 * ((across[:, None] - block) / width) ** 2).sum(axis=1)
    density /= len(values) * width * math.sqrt(math.tau)
    return density


def normal(values: FloatArray, across: FloatArray) -> FloatArray:
    """Return the density of the normal distribution with mean and std of the realisations."""
    std = float(values.std(ddof=1))
    score = (across - float(values.mean())) / std
    density: FloatArray = np.exp(-0.5 * score**2) / (std * math.sqrt(math.tau))
    return density


def _mark_power(
    axes: Axes, result: DissipationResult, mean: float, ends: tuple[float, ...]
) -> None:
    axes.axvline(float(result.power.mean()), color="black", lw=1.1)
    for place in (mean, *ends):
        _mark_place(axes, place)
    axes.set_xlim(left=0.0)


def draw_rows(panels: dict[str, Axes], results: Reproduction) -> None:
    """Draw the power per axial length of the realisations, their mean and 95 % band."""
    result = results.all_inputs
    y, rows = result.y * MM, result.dissipation[:MOST_LINES]
    axes = panels["17a"]
    opacity = float(np.clip(15.0 / len(rows), 0.08, 1.0))
    lines = axes.plot(y, rows.T * W_MM, color=BLUE, lw=0.5, alpha=opacity)
    for line in lines:
        line.set_rasterized(True)
    name_axes(axes, f"Fig. 17a: $P_l$(y) of {len(rows)} realisations", _Y, r"$P_l$ [W/mm]")
    low, high, mean = (
        result.values(f"dissipation_{name}") * W_MM for name in ("low", "high", "mean")
    )
    axes = panels["17b"]
    axes.fill_between(y, low, high, color=BLUE, alpha=0.25, lw=0, label="2.5 to 97.5 %")
    axes.plot(y, mean, color="black", label="mean")
    _name_lines(axes, "upper right")
    name_axes(axes, "Fig. 17b: mean and 95 % band", _Y, r"$P_l$ [W/mm]")
    for name in ("17a", "17b"):
        panels[name].set_ylim(0.0, 1.05 * W_MM * float(rows.max()))
        panels[name].margins(x=0.0)


def _mark_place(axes: Axes, place: float) -> None:
    axes.axvline(place, color=RED, ls="--", lw=1.1)


def _mark_level(axes: Axes, level: float) -> None:
    axes.axhline(level, color=RED, ls="--", lw=1.1)


def _name_lines(axes: Axes, where: Literal["upper left", "upper right", "lower right"]) -> None:
    """Write a legend on an opaque background."""
    legend = axes.legend(loc=where, frameon=True, framealpha=1.0, edgecolor="none")
    legend.set_zorder(3.0)
