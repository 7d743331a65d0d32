"""Figures of one contact, of a dissipation study and of a maximum-entropy distribution."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from wearsim.report.maxent import multipliers, parent, without_rounding
from wearsim.report.parts import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PRESSURE,
    draw_convergence,
    name_axes,
    patch_edges,
    patches,
    titled_figure,
    write_message,
)
from wearsim.report.text import PER_SI, in_unit, number_of_realisations, shown
from wearsim.results import DissipationResult
from wearsim.studies.contact.comparison import ContactErrors, ContactReference
from wearsim.studies.contact.single import ContactStudy
from wearsim.types import ContactFields, ContactSolution, FloatArray, IntArray
from wearsim.uq.distributions.base import MaxentDistribution

MM, MPA, W_MM2 = PER_SI["mm"], PER_SI["MPa"], PER_SI["W/mm^2"]
N_MM, W_MM = PER_SI["N/mm"], PER_SI["W/mm"]
MAPS: list[Any] = [["pressure", "traction"], ["areas", "power"]]
STRIPS: list[Any] = ["line load", "dissipation"]
STICK, SLIDE = "#7fb2d9", "#f2c9a1"
Y_LABEL, X_LABEL = "y [mm]", "x (rolling direction) [mm]"


def contact_figure(study: ContactStudy, title: str) -> Figure:
    """Return the figure of a contact.

    It shows pressure, traction, adhesion, slip and power density over the patch if the study has
    fields, and always line load and dissipated power per length.

    Parameters
    ----------
    study : ContactStudy
    title : str
        Title of the figure.

    Returns
    -------
    Figure
    """
    caption = (
        f"{title}\n{study.described_model}\nnormal force {shown(study.point.normal_force, 'N')},"
        f" peak pressure {shown(study.solution.peak_pressure, 'MPa')},"
        f" dissipated power {shown(study.solution.power, 'W')}"
    )
    maps = [] if study.fields is None else MAPS
    with titled_figure(10.0, 8.2 if maps else 3.4, caption) as figure:
        panels = figure.subplot_mosaic([*maps, STRIPS], sharex=bool(maps))
        if study.fields is not None:
            _draw_fields(panels, study.fields, study.solution)
        _draw_strips(panels, study.solution)
        if study.reference is not None and study.errors is not None:
            _draw_reference(panels, study.reference, study.errors)
    return figure


def _draw_fields(panels: dict[str, Axes], fields: ContactFields, solution: ContactSolution) -> None:
    touching = np.flatnonzero(solution.half_length > 0.0)
    inside = slice(int(touching[0]), int(touching[-1]) + 1)
    y = np.broadcast_to(fields.y[inside], fields.x[:, inside].shape) * MM
    x = fields.x[:, inside] * MM
    for name, value, title in (
        ("pressure", _pressure(fields, solution) * MPA, "Pressure [MPa]"),
        (
            "traction",
            np.hypot(fields.traction_x, fields.traction_y) * MPA,
            "Traction on the cylinder [MPa]",
        ),
        ("power", fields.power_density * W_MM2, r"Dissipated power density [W/mm$^2$]"),
    ):
        axes = panels[name]
        mesh = axes.pcolormesh(
            y, x, value[:, inside], shading="gouraud", cmap=PRESSURE, vmin=0.0, rasterized=True
        )
        axes.figure.colorbar(mesh, ax=axes, pad=0.02, aspect=16)
        name_axes(axes, title, "", X_LABEL)
    _draw_arrows(
        panels["traction"], y, x, fields.traction_y[:, inside], fields.traction_x[:, inside]
    )
    _draw_areas(panels["areas"], y, x, fields.adhesion[:, inside].astype(float), solution)
    for name in [name for row in MAPS for name in row]:
        _draw_outlines(panels[name], solution, SLIDE if name == "areas" else "black")


def _pressure(fields: ContactFields, solution: ContactSolution) -> FloatArray:
    """Return the pressure field; replace FASTSIM's parabolic traction bound by Hertz's ellipse.

    The parabola has the same line load and 4/3 of the peak pressure.
    """
    if fields.pressure.max() < 1.05 * solution.peak_pressure:
        return fields.pressure
    a = np.where(solution.half_length > 0.0, solution.half_length, 1.0)
    peak = 2.0 * solution.line_load / (np.pi * a)
    return np.asarray(peak * np.sqrt(np.maximum(0.0, 1.0 - (fields.x / a) ** 2)))


def _draw_arrows(
    axes: Axes, y: FloatArray, x: FloatArray, across: FloatArray, along: FloatArray
) -> None:
    """Draw the traction vectors on a coarse grid, in the scales of both axes."""
    pick = np.ix_(_spread_out(y.shape[0], 8), _spread_out(y.shape[1], 12))
    longest = float(np.hypot(across[pick], along[pick]).max(initial=0.0))
    if longest > 0.0:
        axes.quiver(
            y[pick], x[pick], across[pick], along[pick],
            color="white", scale=17.0 * longest, width=0.004, pivot="middle",
        )  # fmt: skip


def _draw_areas(
    axes: Axes, y: FloatArray, x: FloatArray, adhesion: FloatArray, solution: ContactSolution
) -> None:
    if min(y.shape) > 1:
        axes.contourf(y, x, adhesion, levels=[-0.5, 0.5, 1.5], colors=[SLIDE, STICK])
    percent = 100.0 * solution.adhesion_fraction
    handles = [
        Patch(color=STICK, label=f"adhesion, {percent:.1f} % of the area"),
        Patch(color=SLIDE, label=f"slip, {100.0 - percent:.1f} %"),
    ]
    axes.legend(handles=handles, loc="lower center", ncols=2)
    name_axes(axes, "Adhesion and slip", "", X_LABEL)


def _spread_out(length: int, wanted: int) -> IntArray:
    """Return evenly spaced indices, about as many as wanted, that keep away from both ends."""
    step = max(length // wanted, 1)
    return np.arange((length - 1) % step // 2 + step // 2, length, step)


def _draw_outlines(axes: Axes, solution: ContactSolution, background: str) -> None:
    """Draw the outline of each patch and fill it, up to the edges beyond the centres of strips."""
    for strips in patches(solution.half_length):
        y, a = solution.y[strips], solution.half_length[strips]
        patch = np.zeros_like(solution.half_length)
        patch[strips] = a
        edges = patch_edges(solution.y, patch)
        assert edges is not None
        part = np.linspace(0.0, 1.0, 12)
        left, right = edges[0] + (y[0] - edges[0]) * part, y[-1] + (edges[1] - y[-1]) * part
        across = np.concatenate([left, y, right]) * MM
        ends = np.sqrt(part)  # the square of the half-length is linear there
        height = np.concatenate([a[0] * ends, a, a[-1] * ends[::-1]]) * MM
        outline = np.concatenate([across, across[::-1]]), np.concatenate([height, -height[::-1]])
        axes.fill(*outline, color=background, lw=0, zorder=0)
        axes.plot(*outline, "k", lw=0.8)
    greatest = float(solution.half_length.max()) * MM
    axes.set_ylim(-1.35 * greatest, 1.2 * greatest)
    axes.grid(visible=False)


def _draw_strips(panels: dict[str, Axes], solution: ContactSolution) -> None:
    """Draw line load and dissipated power per length."""
    touching = np.flatnonzero(solution.half_length > 0.0)
    inside = slice(max(int(touching[0]) - 1, 0), int(touching[-1]) + 2)
    y = solution.y[inside] * MM
    for name, value, colour, title, label in (
        ("line load", solution.line_load * N_MM, BLUE, "Line load [N/mm]", "q(y)"),
        (
            "dissipation", solution.dissipation * W_MM, ORANGE,
            "Dissipated power per length [W/mm]", r"$P_l$(y)",
        ),
    ):  # fmt: skip
        panels[name].plot(y, value[inside], color=colour)
        name_axes(panels[name], title, Y_LABEL, label)
        panels[name].set_ylim(bottom=0.0)


def _draw_reference(
    panels: dict[str, Axes], reference: ContactReference, errors: ContactErrors
) -> None:
    """Draw line load and dissipated power per length of a reference."""
    first, last = np.flatnonzero(reference.line_load > 0.0)[[0, -1]].tolist()
    inside = slice(max(first - 1, 0), last + 2)
    y = reference.y[inside] * MM
    error = f"{reference.model}; difference {shown(errors.dissipation, '%', 2)} (L2)"
    for name, value, label in (
        ("line load", reference.line_load * N_MM, reference.model),
        ("dissipation", reference.dissipation * W_MM, error),
    ):
        panels[name].plot(y, value[inside], "k--", lw=1.0, label=label)
        panels[name].set_ylim(0.0, 1.25 * max(panels[name].get_ylim()[1], float(value.max())))
        panels[name].legend(loc="upper center")


MOST_LINES = 200
CLASSES = 30
_HEADROOM = 1.28  # height of the density's panel relative to its highest class, for the legend
_EQUAL = 1e-9  # relative difference of curves that are drawn as one
PANELS: list[Any] = [["mean", "density", "realisations"], ["std", "density", "band"]]


def dissipation_figure(result: DissipationResult) -> Figure:
    """Return the figure of a dissipation study.

    Parameters
    ----------
    result : DissipationResult

    Returns
    -------
    Figure
        Five panels: mean and standard deviation against the number of realisations, density of the
        dissipated power, and dissipated power per length: realisations, and mean with 95 % range.
    """
    with titled_figure(13.0, 6.8, f"{result.title}\n{_caption(result)}") as figure:
        panels = figure.subplot_mosaic(PANELS, width_ratios=[1.0, 1.15, 1.1])
        found, constant = result.convergence(), result.summaries["power"].is_constant
        # a constant power has rounding errors only
        spreads = found.mean_error, found.std, found.std_error
        mean_error, std, std_error = (np.zeros_like(e) if constant else e for e in spreads)
        for name, value, error in (("mean", found.mean, mean_error), ("std", std, std_error)):
            draw_convergence(panels[name], found.count, value, value - error, value + error)
        name_axes(
            panels["mean"], "Mean dissipated power, with standard error", "", "mean of $P_d$ [W]"
        )
        name_axes(
            panels["std"],
            "Standard deviation, with standard error",
            "realisations",
            "std of $P_d$ [W]",
        )
        draw_density(panels["density"], result)
        _draw_realisations(panels["realisations"], result)
        _draw_band(panels["band"], result)
    return figure


def _caption(result: DissipationResult) -> str:
    power, raw = result.summaries["power"], result.raw
    text = (
        f"{number_of_realisations(result.count)} ({raw.plan}, {result.described_model}"
        f"{'' if result.finished else ', unfinished'})\n"
        f"mean dissipated power {shown(power.mean, 'W')}"
    )
    if result.count == 1:
        return text
    if power.is_constant:
        return f"{text}, equal in all realisations"
    band = " to ".join(in_unit(power.quantile(p).value, "W", 3) for p in (0.025, 0.975))
    return f"{text}, std {shown(power.std, 'W')}, 95 % range {band} W"


def draw_density(axes: Axes, result: DissipationResult) -> None:
    """Draw the density of the dissipated power."""
    power, summary, title = result.power, result.summaries["power"], "Density of dissipated power"
    at_means = f"inputs at their means: {shown(result.mean_problem_power, 'W')}"
    if result.count == 1 or summary.is_constant:
        value, number = shown(summary.mean, "W"), number_of_realisations(result.count)
        write_message(axes, title, [f"{value} in {number}: no density to draw", at_means])
        return
    axes.hist(power, CLASSES, density=True, color=BLUE, alpha=0.45, label="realisations")
    low, high = axes.get_xlim()
    across = np.linspace(max(low, 0.0), high, 400)  # the power is not negative
    score = (across - summary.mean) / summary.std
    normal = np.exp(-0.5 * score**2) / (summary.std * math.sqrt(math.tau))
    axes.plot(across, normal, color=ORANGE, label="normal distribution, same mean and std")
    axes.set_xlim(max(low, 0.0), high)
    for place, colour, style, label in (
        (summary.mean, "black", "-", f"mean: {shown(summary.mean, 'W')}"),
        (result.mean_problem_power, GREEN, "--", at_means),
        (summary.quantile(0.025).value, GREY, ":", "2.5 % and 97.5 % quantile"),
        (summary.quantile(0.975).value, GREY, ":", None),
    ):
        axes.axvline(place, 0.0, 1.0 / _HEADROOM, color=colour, ls=style, lw=1.0, label=label)
    name_axes(axes, title, "$P_d$ [W]", "probability density [1/W]")
    axes.set_ylim(top=_HEADROOM * axes.get_ylim()[1])
    axes.legend(loc="upper right")


def _draw_realisations(axes: Axes, result: DissipationResult) -> None:
    kept, y = result.dissipation, result.y * MM
    rows = kept[:MOST_LINES]
    title = number_of_realisations(len(rows))
    if len(kept) > 1 and float(np.ptp(kept, axis=0).max()) <= _EQUAL * float(kept.max()):
        rows, title = rows[:1], "equal in all"
    opacity = float(np.clip(15.0 / len(rows), 0.12, 1.0))
    axes.plot(y, rows.T * W_MM, color=BLUE, lw=0.6, alpha=opacity)
    name_axes(axes, f"Dissipated power per length, {title}", "", r"$P_l$ [W/mm]")
    axes.set_ylim(bottom=0.0)
    axes.margins(x=0.0)


def _draw_band(axes: Axes, result: DissipationResult) -> None:
    y = result.y * MM
    names = ("dissipation_low", "dissipation_high", "dissipation_mean", "mean_problem_dissipation")
    low, high, mean, at_means = (result.values(name) * W_MM for name in names)
    axes.fill_between(y, low, high, color=BLUE, alpha=0.25, lw=0, label="2.5 to 97.5 %")
    axes.plot(y, mean, color="black", label="mean")
    axes.plot(y, at_means, color=GREEN, ls="--", label="inputs at their means")
    name_axes(axes, "Mean and 95 % range", "y [mm]", r"$P_l$ [W/mm]")
    axes.set_ylim(0.0, 1.3 * axes.get_ylim()[1])
    axes.margins(x=0.0)
    axes.legend(loc="upper center", ncols=3, columnspacing=1.0)


_POINTS = 1001


def maxent_figure(distribution: MaxentDistribution) -> Figure:
    """Return the figure of a maximum-entropy distribution.

    Parameters
    ----------
    distribution : MaxentDistribution

    Returns
    -------
    Figure
        Density with its central 95 %, mean, and the parent normal distribution if it differs.
    """
    with titled_figure(6.4, 3.6) as figure:
        axes = figure.subplots()
        low, high = distribution.bulk
        # the ends are left out, where a density may be infinite
        x = low + (high - low) * (np.arange(_POINTS) + 0.5) / _POINTS
        density = distribution.density(x)
        first, last = distribution.quantile(np.array([0.025, 0.975]))
        inside = ((x >= first) & (x <= last)).tolist()
        axes.fill_between(
            x, density, where=inside, color=BLUE, alpha=0.15, lw=0,
            label=f"95 %: {first:.4g} to {last:.4g}",
        )  # fmt: skip
        axes.plot(x, density, color=BLUE, label=distribution.family)
        found = parent(distribution)
        if found is not None:
            mean, std = found
            normal = np.exp(-0.5 * ((x - mean) / std) ** 2) / (std * np.sqrt(2.0 * np.pi))
            if np.abs(normal - density).max() > 1e-3 * density.max():
                axes.plot(
                    x, normal, "--", color=GREY, lw=1.0,
                    label=f"parent: mean {mean:.4g}, std {std:.4g}",
                )  # fmt: skip
        axes.axvline(
            distribution.mean,
            color=ORANGE,
            lw=1.0,
            label=f"mean {without_rounding(distribution, distribution.mean):.4g}",
        )
        axes.set(xlim=(low, high), ylim=(0.0, 1.08 * float(density.max())))
        axes.legend(loc="best")
        numbers = enumerate(multipliers(distribution))
        terms = ", ".join(f"$\\lambda_{number}$ = {item:.5g}" for number, item in numbers)
        name_axes(
            axes, f"Maximum entropy: {distribution.family}\n{terms}", "value", "probability density"
        )
    return figure
