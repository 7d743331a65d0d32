"""Control variate of ensembles: the worn depth for full slip of rigid bodies in closed form."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from wearsim.scenario import Scenario
from wearsim.studies.run.draws import Drawer
from wearsim.types import FloatArray

DRAWS = 1_000_000  # draws from which the mean of the control variate is computed
_BLOCK = 65536
_FIRST_DRAW = 2**31  # number of the first of these draws, beyond any realisation
_NEWTON_TOLERANCE = 1e-14


class ControlVariate(NamedTuple):
    """Moments of the control variate.

    Parameters
    ----------
    mean, std : float
        Mean and standard deviation of the closed-form depth [m].
    draws : int
        Number of draws they are computed from.
    """

    mean: float
    std: float
    draws: int


def control_of(drawer: Drawer, draws: int = DRAWS) -> ControlVariate | None:
    """Return the moments of the closed-form depth, or None where it is not defined.

    The draws follow those of all realisations and are independent of them.

    Parameters
    ----------
    drawer : Drawer
    draws : int
    """
    depths = np.concatenate(
        [
            closed_form_depths(drawer.scenario, drawer.columns(_FIRST_DRAW + start, count), count)
            for start in range(0, draws, _BLOCK)
            for count in (min(_BLOCK, draws - start),)
        ]
    )
    if not np.isfinite(depths).all():
        return None
    return ControlVariate(float(depths.mean()), float(depths.std(ddof=1)), draws)


def closed_form_depths(
    scenario: Scenario, columns: Mapping[str, FloatArray], count: int
) -> FloatArray:
    """Return the worn depth of the cylinder in full slip of rigid bodies, shape (count,) [m].

    Roller and cylinder wear to conforming profiles: with the worn area C per load and pass the
    total depth is d = [(3/4) C N n / sqrt(2 R_crown)]^(2/3), divided between the bodies as their
    wear. A mounting spring reduces the load by k_s d:
    artanh x - x = n C k_s^(3/2) / (4 sqrt(2 R_crown N_0)), x^2 = k_s d / N_0.

    Parameters
    ----------
    scenario : Scenario
    columns : mapping of str to ndarray, shape (count,) or (count, rollers)
        Drawn values by the scenario's key; the others are at their mean.
    count : int
        Realisations.

    Returns
    -------
    ndarray
        nan where the wear law is not linear in the dissipation.
    """
    rollers, speed = scenario.operation.rollers, scenario.rolling_speed

    def value(key: str, mean: float | tuple[float, ...]) -> FloatArray:
        found = columns.get(key)
        if found is None:
            found = np.broadcast_to(np.array(scenario.per_roller(mean)), (count, rollers))
        return found[:, None] if found.ndim == 1 else found

    creepage, load = scenario.creepage, scenario.load.build()
    law = None if scenario.wear is None else scenario.wear.build()
    factors = {}
    for body in ("cylinder", "roller"):
        factor = None if law is None else law.depth_per_dissipation(body, speed)
        if factor is None:
            return np.full(count, np.nan)
        factors[body] = factor * speed
    slip = np.hypot(
        value("creepage.longitudinal", creepage.longitudinal or 0.0),
        value("creepage.yaw", creepage.yaw),
    )
    sliding = value("friction.coefficient", scenario.friction.coefficient) * slip
    force = np.maximum(value("load.normal_force", load.mean(0.0, scenario.total_time)), 0.0)
    mean_force = force.mean(axis=1) if force.shape[1] > 1 else force[:, 0]
    cylinder, roller = (
        value(f"wear.{body}.k_over_h", factors[body])[:, 0] for body in ("cylinder", "roller")
    )
    share = scenario.cylinder.radius / scenario.roller.radius / rollers
    opening = cylinder + share * roller
    worn = np.broadcast_to((sliding * force).mean(axis=1) * opening, (count,))
    stiffness = value("load.stiffness", load.stiffness)[:, 0]
    depth = _total_depth(scenario, worn, np.broadcast_to(mean_force, (count,)), stiffness)
    part = np.where(opening > 0.0, cylinder / np.where(opening > 0.0, opening, 1.0), 0.0)
    return np.asarray(depth * part)


def _total_depth(
    scenario: Scenario, worn: FloatArray, force: FloatArray, stiffness: FloatArray
) -> FloatArray:
    """Return the total worn depth of cylinder and roller [m].

    Parameters
    ----------
    scenario : Scenario
    worn, force : ndarray, shape (count,)
        Worn area per pass at the initial load [m^2], and that load [N].
    stiffness : ndarray, shape (count,) or (1,)
        Loss of load per depth [N/m].
    """
    crown, passes = 2.0 * scenario.roller.crown_radius, scenario.total_passes
    free = (0.75 * worn * passes / np.sqrt(crown)) ** (2.0 / 3.0)
    held = np.where((stiffness > 0.0) & (force > 0.0), stiffness, 0.0)
    safe_force = np.where(force > 0.0, force, 1.0)
    # t of artanh x - x = t, which for a soft spring is x^3/3
    t = passes * worn * held**1.5 / (4.0 * np.sqrt(crown) * safe_force**1.5)
    x = _inverse(t)
    reached = safe_force * x**2 / np.where(held > 0.0, held, 1.0)
    # for a soft spring the difference of artanh x and x is dominated by rounding
    return np.asarray(np.where(x > 1e-4, reached, free))


def _inverse(t: FloatArray) -> FloatArray:
    """Return x of artanh x - x = t by Newton's method from below, for t >= 0."""
    x = np.minimum(np.minimum(np.cbrt(3.0 * t), np.tanh(t + 1.0)), 1.0 - 1e-15)
    for _ in range(60):
        slope = np.where(x > 0.0, x**2 / (1.0 - x**2), 1.0)
        new = np.clip(x - (np.arctanh(x) - x - t) / slope, 0.5 * x, 0.5 * (1.0 + x))
        if (np.abs(new - x) <= _NEWTON_TOLERANCE * x).all():
            break
        x = new
    return np.asarray(x)
