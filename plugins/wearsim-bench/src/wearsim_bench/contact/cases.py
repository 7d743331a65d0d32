"""Benchmark contacts with their exact solutions."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np

from wearsim.mechanics.hertz.elasticity import combine
from wearsim.mechanics.hertz.ellipse import HertzContact, hertz
from wearsim.models.contact.strip_model import grid_about_hertz
from wearsim.scenario.tables.plugin import ContactChoice
from wearsim.studies.run.grid import profile_grid
from wearsim.types import Creepage, FloatArray, Grid, OperatingPoint
from wearsim_bench.exact_solutions import CREEPAGES, STEEL, WORN, rows, strips_of, worn_profile

MATERIALS = (STEEL, STEEL)

WORN_WIDTH = 8e-3  # m, total width of the strips, also for models that overestimate the width

_WORN_CURVATURE, _WORN_B = 45.0, 0.5  # 1/m, 2 A of the data, and B of the crown

_WORN_LOAD, _WORN_FRICTION = 300.0, 0.1


@dataclass(frozen=True)
class Exact:
    """Exact solution of a contact at V = 1 m/s.

    Parameters
    ----------
    power : float
        Dissipated power [W].
    y, dissipation : ndarray, shape (rows,)
        P_l(y) [W/m].
    width, peak_pressure : float
        Width of the contact across rolling [m], peak pressure [Pa].
    """

    power: float
    y: FloatArray
    dissipation: FloatArray
    width: float
    peak_pressure: float


@dataclass(frozen=True)
class Case:
    """A contact at V = 1 m/s.

    Parameters
    ----------
    name : str
        Description of the contact.
    gap_at : callable
        Gap [m] at y [m].
    gap_curvature, longitudinal_curvature : float
        Relative curvatures across and along rolling, of the unworn bodies [1/m].
    point : OperatingPoint
        Load, creepage, friction and speed.
    exact : Exact
        Exact solution.
    span : float, optional
        Width of the strips on a profile [m]; None for strips suggested by the model.
    """

    name: str
    gap_at: Callable[[FloatArray], FloatArray]
    gap_curvature: float
    longitudinal_curvature: float
    point: OperatingPoint
    exact: Exact
    span: float | None = None

    @property
    def patch(self) -> HertzContact:
        """Contact patch of the unworn bodies."""
        along, across = 0.5 * self.longitudinal_curvature, 0.5 * self.gap_curvature
        modulus = combine(*MATERIALS).contact_modulus
        return hertz(along, across, self.point.normal_force, modulus)

    def grid(self, choice: ContactChoice, strips: int | None = None) -> Grid:
        """Return the default strips of a single contact, or another number over the same width."""
        if self.span is not None:
            usual = profile_grid(-0.5 * self.span, 0.5 * self.span, self.patch.b, None)
        else:
            suggest, load = choice.spec.suggest_grid or grid_about_hertz, self.point.normal_force
            problem = self.gap_curvature, self.longitudinal_curvature, load, MATERIALS
            usual = suggest(choice.options, *problem) or grid_about_hertz(None, *problem)
        if strips in (None, usual.strips):
            return usual
        half = 0.5 * usual.strips * usual.spacing
        return Grid.spanning(-half, half, strips)


@cache
def elliptic_cases(kind: str) -> tuple[Case, ...]:
    """Return elliptic contacts with their exact solutions.

    Parameters
    ----------
    kind : str
        "paper", "partial" or "hard", see `exact_solutions.strips_of`.
    """
    data = rows("hard_cases") if kind == "hard" else rows("rig_random", kind=kind)
    y_over_b, strips = strips_of(kind)
    return tuple(
        _elliptic(f"{row['kind'].replace('_', ' ')} {number}", row, y_over_b, exact)
        for number, (row, exact) in enumerate(zip(data, strips, strict=True))
    )


def _elliptic(
    name: str, row: dict[str, Any], y_over_b: FloatArray, dissipation: FloatArray
) -> Case:
    """Return the contact of a row of the data; width and peak pressure are those of Hertz."""
    modulus = combine(*MATERIALS).contact_modulus
    patch = hertz(row["A_per_m"], row["B_per_m"], row["N_N"], modulus)
    creepage = Creepage(row["xi"], row["eta"], row["phi_per_m"])
    return Case(
        f"{name}, b/a {patch.b / patch.a:.2g}",
        partial(_parabola, row["B_per_m"]),
        2.0 * row["B_per_m"],
        2.0 * row["A_per_m"],
        OperatingPoint(row["N_N"], 1.0, creepage, row["mu"]),
        Exact(
            row["P_over_V_N"], y_over_b * patch.b, dissipation, 2.0 * patch.b, patch.peak_pressure
        ),
    )


def _parabola(curvature: float, y: FloatArray) -> FloatArray:
    return np.asarray(curvature * y**2)


@cache
def worn_cases(name: str) -> dict[str, Case]:
    """Return the cases of a worn profile by name of the creepage in `CREEPAGES`."""
    data = worn_profile(name)
    width = contact_width(data["q"], float(data["y"][1] - data["y"][0]))
    return {
        slip: Case(
            f"{name.replace('_', ' ')}, {slip}",
            partial(_worn_gap, name),
            2.0 * _WORN_B,
            _WORN_CURVATURE,
            OperatingPoint(_WORN_LOAD, 1.0, Creepage(*creepage), _WORN_FRICTION),
            Exact(
                data[f"P_over_V_{slip}"],
                data["y"],
                data[f"P_l_over_V_{slip}"],
                width,
                data["peak_pressure"],
            ),
            WORN_WIDTH,
        )
        for slip, creepage in CREEPAGES.items()
    }


def all_worn_cases() -> tuple[Case, ...]:
    """Return the cases of all worn profiles and creepages."""
    return tuple(case for name in WORN for case in worn_cases(name).values())


def _worn_gap(name: str, y: FloatArray) -> FloatArray:
    data = worn_profile(name)
    gap = np.interp(y, data["y"], data["w"])
    # outside the data and the contact, all profiles continue as the crown
    end = data["y"][-1]
    return np.asarray(gap + _WORN_B * (np.maximum(np.abs(y), end) ** 2 - end**2))


_EDGE_STRIPS = 4  # strips at an edge from which its position is extrapolated

_SLACK = 0.1  # deviation from the parabola, relative to the line load of the second strip


def contact_width(line_load: FloatArray, spacing: float) -> float:
    """Return the distance between the outermost edges of a contact [m].

    A strip at an edge is partly in contact, and models give it either the line load at its
    midpoint or the mean over it. The edge is therefore the zero of the parabola through the line
    loads of the next three strips, which is exact for an ellipse in both cases. If the first strip
    carries neither the midpoint value nor the mean of this parabola, the straight line through
    the first two strips is used instead.

    Parameters
    ----------
    line_load : ndarray, shape (strips,)
        q [N/m], with at least one positive value.
    spacing : float
        Width of a strip [m].
    """
    inside = np.flatnonzero(line_load > 0.0)
    across = line_load[inside[0] : inside[-1] + 1]
    return (len(across) - 1 + _edge(across) + _edge(across[::-1])) * spacing


def _edge(line_load: FloatArray) -> float:
    """Return the distance of the edge from the midpoint of the first strip, in strips."""
    first = line_load[:_EDGE_STRIPS].tolist()
    use_parabola = len(first) == _EDGE_STRIPS and min(first) > 0.0
    parabolic = _edge_of_parabola(first) if use_parabola else None
    edge = _edge_of_line(first) if parabolic is None else parabolic
    return min(max(edge, -0.5), 1.0)


def _edge_of_line(line_load: list[float]) -> float:
    """Return this distance by linear extrapolation, or half a strip if that is impossible."""
    if len(line_load) < 2 or line_load[1] <= line_load[0]:
        return 0.5
    return line_load[0] / (line_load[1] - line_load[0])


def _edge_of_parabola(line_load: list[float]) -> float | None:
    """Return this distance by the parabola through strips 2 to 4, if strip 1 agrees with it."""
    first, second, third, fourth = line_load
    bend = fourth - 2.0 * third + second
    slope = third - second - 0.5 * bend  # at the second strip
    discriminant = slope**2 - 2.0 * bend * second
    if slope <= 0.0 or discriminant < 0.0:
        return None
    steepness = math.sqrt(discriminant)  # at the edge
    edge = 2.0 * second / (slope + steepness) - 1.0
    covered = min(max(edge + 0.5, 0.0), 1.0)
    at_middle, mean = (
        second - slope + 0.5 * bend,
        steepness * covered * (edge + 0.5 - 0.5 * covered),
    )
    slack = _SLACK * second
    agrees = min(at_middle, mean) - slack <= first <= max(at_middle, mean) + slack
    return edge if agrees else None
