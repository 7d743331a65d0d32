"""Contacts to be solved, and what the exact theory says of each."""

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
from wearsim.plugins import ContactModel
from wearsim.studies.run.grid import profile_grid
from wearsim.types import Creepage, FloatArray, Grid, OperatingPoint, Profile
from wearsim_bench.exact_solutions import CREEPAGES, STEEL, WORN, rows, strips_of, worn_profile

MATERIALS = (STEEL, STEEL)

WORN_WIDTH = 8e-3  # m, of the strips of worn profiles: room for models that see them too wide

_WORN_CURVATURE, _WORN_B = 45.0, 0.5  # 1/m, twice the data's A, and the B of their crown

_WORN_LOAD, _WORN_FRICTION = 300.0, 0.1


@dataclass(frozen=True)
class Exact:
    """What the exact theory says of a contact at V = 1 m/s.

    Parameters
    ----------
    power : float
        Dissipated power [W].
    y, dissipation : ndarray, shape (rows,)
        P_l(y) [W/m].
    width, peak_pressure : float
        Extent of the contact across rolling [m], greatest pressure [Pa].
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
    gap_at : callable
        Gap [m] at y [m].
    gap_curvature, longitudinal_curvature : float
        Relative curvatures across and along rolling, of the unworn bodies [1/m].
    point : OperatingPoint
    exact : Exact
    span : float, optional
        Width of a profile [m], all of it cut into strips; where left out, the model suggests them.
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
        """The patch of the unworn bodies."""
        along, across = 0.5 * self.longitudinal_curvature, 0.5 * self.gap_curvature
        modulus = combine(*MATERIALS).contact_modulus
        return hertz(along, across, self.point.normal_force, modulus)

    def grid(self, model: ContactModel, strips: int | None = None) -> Grid:
        """Return the strips that a single contact gets, or so many of them over the same width."""
        if self.span is not None:
            ends = np.array([-0.5, 0.5]) * self.span
            usual = profile_grid(Profile(ends, np.zeros(2)), self.patch.b, None)
        else:
            problem = self.gap_curvature, self.longitudinal_curvature, self.point.normal_force
            usual = model.suggest_grid(*problem, MATERIALS) or grid_about_hertz(*problem, MATERIALS)
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
        As of `exact.strips_of`: "paper", "partial" or "hard".
    """
    found = rows("hard_cases") if kind == "hard" else rows("rig_random", kind=kind)
    y_over_b, strips = strips_of(kind)
    return tuple(
        _elliptic(f"{row['kind'].replace('_', ' ')} {number}", row, y_over_b, exact)
        for number, (row, exact) in enumerate(zip(found, strips, strict=True))
    )


def _elliptic(
    name: str, row: dict[str, Any], y_over_b: FloatArray, dissipation: FloatArray
) -> Case:
    """Return a contact of a row of the data; width and peak pressure are Hertz's closed forms."""
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
    """Return a worn profile of the data under each of its creepages, by name in `CREEPAGES`."""
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
    """Return every worn profile under every creepage."""
    return tuple(case for name in WORN for case in worn_cases(name).values())


def _worn_gap(name: str, y: FloatArray) -> FloatArray:
    data = worn_profile(name)
    gap = np.interp(y, data["y"], data["w"])
    # beyond the data, where there is no contact, all profiles go on as the crown does
    end = data["y"][-1]
    return np.asarray(gap + _WORN_B * (np.maximum(np.abs(y), end) ** 2 - end**2))


_SHOWN = 4  # strips from an edge inwards that show how the line load falls

_ALIKE = 0.1  # of the second strip's line load: how far the first may be from the parabola's


def contact_width(line_load: FloatArray, spacing: float) -> float:
    """Return the distance between a contact's outermost edges [m].

    A strip at an edge is in contact in part, and models differ in what they give it: the line load
    at its middle, or the mean over it. So the edge is where the parabola through the line loads of
    the next three strips vanishes, which on an ellipse is exact for both. Where the first strip
    carries neither what that parabola has at its middle nor its mean, the line load does not fall
    like a parabola, and the straight line through the first two takes its place.

    Parameters
    ----------
    line_load : ndarray, shape (strips,)
        q [N/m], some of it positive.
    spacing : float
        Width of a strip [m].
    """
    inside = np.flatnonzero(line_load > 0.0)
    across = line_load[inside[0] : inside[-1] + 1]
    return (len(across) - 1 + _edge(across) + _edge(across[::-1])) * spacing


def _edge(line_load: FloatArray) -> float:
    """Return how far, in strips, the edge lies outside the middle of the first strip."""
    shown = line_load[:_SHOWN].tolist()
    parabolic = _edge_of_parabola(shown) if len(shown) == _SHOWN and min(shown) > 0.0 else None
    edge = _edge_of_line(shown) if parabolic is None else parabolic
    return min(max(edge, -0.5), 1.0)


def _edge_of_line(shown: list[float]) -> float:
    """Return the same by a straight line, or the outer side of the strip where there is none."""
    if len(shown) < 2 or shown[1] <= shown[0]:
        return 0.5
    return shown[0] / (shown[1] - shown[0])


def _edge_of_parabola(shown: list[float]) -> float | None:
    """Return the same by a parabola through all but the first, if that one agrees with it."""
    first, second, third, fourth = shown
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
    slack = _ALIKE * second
    agrees = min(at_middle, mean) - slack <= first <= max(at_middle, mean) + slack
    return edge if agrees else None
