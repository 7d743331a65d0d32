"""Rolling-contact fatigue: damage of the bodies by Miner's rule, and what it means together.

A strip with the line load q and the half-length a has the greatest pressure p = 2 q/(pi a), and an
overrolling of its point adds 1/N(p). The lives of places or of bodies with the damage D scatter as
P(survive) = (1 - P_ref)^(D^e), with the Weibull slope e and the probability P_ref at which the laws
give lives. The effective damage D_eff of a test is the damage of one place with the same
probability: D_eff^e is the sum of D^e over the bodies, of their most damaged places or of their
areas over a reference area.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wearsim.contact_batch import ContactBatchSolution
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.quantities import sum_along, sum_in_order
from wearsim.mechanics.fatigue import SHEAR_DEPTH
from wearsim.plugins import BODIES, Body, FatigueLaw
from wearsim.types import FloatArray

_TINY = 1e-300  # half-length of a strip without contact, which has no load
FARTHEST = 1e200  # scale of the passes of a test without wear


@dataclass(frozen=True, eq=False)
class Fatigue:
    """Fatigue of the bodies of wear tests.

    Parameters
    ----------
    laws : mapping of body to FatigueLaw
        Those of the bodies that may pit.
    slope : float
        Weibull slope e.
    probability : float
        Probability of pitting at the lives of the laws.
    reference_area : float, optional
        Area with this probability, where the weakest place decides; else the most damaged one does
        [m^2].
    remove : bool
        Whether worn-off material takes its damage with it.
    """

    laws: Mapping[Body, FatigueLaw]
    slope: float
    probability: float = 0.1
    reference_area: float | None = None
    remove: bool = False

    def pitting(self, effective: FloatArray) -> FloatArray:
        """Return the probability of pitting at effective damages, same shape."""
        return np.asarray(-np.expm1(np.log1p(-self.probability) * effective**self.slope))


def fatigue_of(problem: WearProblem) -> Fatigue:
    """Return the fatigue of a problem that has it."""
    assert problem.fatigue is not None
    return problem.fatigue


def damage_per_pass(problem: WearProblem, contacts: ContactBatchSolution) -> FloatArray:
    """Return the damage of all bodies by a roller pass, shape (stations + rollers, N, strips).

    Parameters
    ----------
    problem : WearProblem
    contacts : ContactBatchSolution
        In the problem's order.
    """
    load, length = (problem.values_of(contacts, name) for name in ("line_load", "half_length"))
    pressure = load / np.maximum(length, _TINY)
    pressure *= 2.0 / math.pi
    laws, shares, stations = fatigue_of(problem).laws, problem.wear_shares, problem.shape[0]
    found = np.zeros((stations + problem.rollers, *load.shape[2:]))
    for body, law in laws.items():
        part = shares[body] * law.damage_per_pass(pressure)
        if body == "cylinder":
            found[:stations] = sum_along(part, axis=1)[:, 0]
        else:
            found[stations:] = problem.sum_of_parts(part, part)[1][0]
    return found


def layer_thickness(problem: WearProblem, contacts: ContactBatchSolution) -> FloatArray:
    """Return the thickness of the damaged layer of all bodies, shape as `damage_per_pass` [m].

    It is the depth of the greatest shear stress, and infinite where a body is without contact.
    """
    length = problem.values_of(contacts, "half_length")
    of_bodies = (
        problem.sum_of_parts(*(problem.wear_shares[body] * values for body in BODIES))
        for values in (length, (length > 0.0).astype(np.float64))
    )
    lengths, passes = (np.concatenate([one[:, 0], other[0]]) for one, other in of_bodies)
    touching = passes > 0.0
    return np.where(touching, SHEAR_DEPTH * lengths / np.where(touching, passes, 1.0), np.inf)


def fresh_damage(
    problem: WearProblem, contacts: ContactBatchSolution
) -> tuple[FloatArray, FloatArray]:
    """Return `damage` and `damage_points` of a `WearState` before the first pass.

    Parameters
    ----------
    problem : WearProblem
        With processes at their values at the start.
    contacts : ContactBatchSolution
        The contacts of the unworn bodies.
    """
    rate = damage_per_pass(problem, contacts)
    damage = np.zeros((4, *rate.shape))
    damage[2] = rate
    cylinder, roller = problem.sum_of_parts(*problem.wear_parts(contacts, 1.0))
    wear = (cylinder + roller).max(axis=(0, 1, 3))
    elastic = problem.values_of(contacts, "approach") - problem.nominal_least_gap
    scale = np.where(wear > 0.0, elastic.min(axis=(0, 1)) / np.where(wear > 0.0, wear, 1.0), np.inf)
    scale = np.where(scale > 0.0, np.minimum(scale, FARTHEST), FARTHEST)
    return damage, np.stack([np.full_like(scale, np.nan), scale])


def greatest_damages(problem: WearProblem, damage: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the greatest damage of the cylinder, shape (N,), and of each roller, (rollers, N).

    On a cam it is that over the angle, interpolated between the stations.

    Parameters
    ----------
    problem : WearProblem
    damage : ndarray, shape (stations + rollers, realisations, strips)
    """
    stations, rows = problem.shape[0], damage.max(axis=-1)
    return problem.kinematics.track.greatest_value(rows[:stations]), rows[stations:]


def effective_damage(problem: WearProblem, damage: FloatArray) -> FloatArray:
    """Return the effective damage D_eff of every realisation, shape (realisations,).

    Parameters
    ----------
    problem : WearProblem
    damage : ndarray, shape (stations + rollers, realisations, strips)
    """
    fatigue = fatigue_of(problem)
    if fatigue.reference_area is not None:
        return effective_of_rows(problem, (damage**fatigue.slope).sum(axis=-1))
    cylinder, rollers = greatest_damages(problem, damage)
    return effective_of_rows(problem, np.concatenate([cylinder[None], rollers]))


def effective_of_rows(problem: WearProblem, rows: FloatArray) -> FloatArray:
    """Return the effective damage from the sums of D^e over strips, or the greatest D, of bodies.

    Parameters
    ----------
    problem : WearProblem
    rows : ndarray, shape (..., stations + rollers, realisations)
        Where the most damaged place decides, the cylinder may have any number of rows.

    Returns
    -------
    ndarray, shape (..., realisations)
    """
    fatigue, rollers = fatigue_of(problem), problem.rollers
    if fatigue.reference_area is not None:
        weighted = problem.volume_weights[1][:, None] * rows / fatigue.reference_area
    else:
        if rows.shape[-2] > 1 + rollers:  # the cylinder has a single damage
            cylinder = rows[..., :-rollers, :].max(axis=-2, keepdims=True)
            rows = np.concatenate([cylinder, rows[..., -rollers:, :]], axis=-2)
        weighted = rows**fatigue.slope
        weighted[..., -rollers:, :] *= problem.kinematics.multiplicity[:, None]
    return np.asarray(sum_in_order(weighted, axis=-2) ** (1.0 / fatigue.slope))
