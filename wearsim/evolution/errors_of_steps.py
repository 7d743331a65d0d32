"""What the error of a step is measured by, for every stepper that takes many passes at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from wearsim.evolution.advance import solve_present
from wearsim.evolution.control import StepControl
from wearsim.evolution.observables import worn_volume
from wearsim.evolution.scene import Scene
from wearsim.evolution.state import WearState, contact_values
from wearsim.evolution.wearing import Wearing
from wearsim.types import FloatArray

DEPTH_EXPONENT, VOLUME_EXPONENT = 0.5, 0.75  # below those of any groove: 2/3 to 1, and about 1
COVER = 1.5  # an estimate of first order is about the error itself; half as much for safety
DEEP = 0.5  # depths are compared where the groove is deeper than this part of its depth
DEPTHS = ("cylinder_depth", "roller_depth")


def deepest(state: WearState) -> FloatArray:
    """Return the greatest worn depth of either body, shape (realisations,) [m]."""
    found: FloatArray = np.maximum(*(getattr(state, name).max(axis=(0, 1, 3)) for name in DEPTHS))
    return found


def whole_volume(scene: Scene, state: WearState) -> FloatArray:
    """Return the volume worn off the cylinder and all its rollers, shape (realisations,) [m^3]."""
    kinematics, spacing = scene.kinematics, scene.grid.spacing
    cylinder = worn_volume(state.cylinder_depth, spacing, kinematics.cylinder_radius)
    rollers = worn_volume(state.roller_depth[0], spacing, kinematics.roller_radius)
    total: FloatArray = cylinder.mean(axis=(0, 1)) + kinematics.multiplicity @ rollers
    return total


def depth_between(
    one: WearState, other: WearState, moved: Sequence[FloatArray] | None = None
) -> FloatArray:
    """Return how far two states lie apart where their grooves are deep, shape (realisations,) [m].

    Parameters
    ----------
    one, other : WearState
    moved : sequence of ndarray, optional
        What to take off the difference of each body first.
    """
    greatest = np.zeros(one.cylinder_depth.shape[2])
    for number, name in enumerate(DEPTHS):
        worn = getattr(one, name)
        apart = worn - getattr(other, name)
        if moved is not None:
            apart = apart - moved[number]
        deep = worn >= DEEP * worn.max(axis=(0, 1, 3), keepdims=True)
        greatest = np.maximum(greatest, np.where(deep, np.abs(apart), 0.0).max(axis=(0, 1, 3)))
    return greatest


def load_spread(scene: Scene, end: WearState, first: float, passes: float) -> FloatArray:
    """Return the error that the load's variation within a step can make.

    The step takes the load's exact mean, but wear is no linear function of the load. Half the
    second difference of the wear at the mean load and a standard deviation to either side, on the
    profile of the step's end, is the bias that the variance makes.

    Parameters
    ----------
    scene : Scene
    end : WearState
        The state at the step's end.
    first, passes : float
        Where the step began, and its length [passes].

    Returns
    -------
    ndarray, shape (2, realisations)
        In depth [m], and in the volume worn off both bodies [m^3].
    """
    spread = np.zeros((2, scene.shape[2]))
    start, stop = scene.time(first), scene.time(first + passes)
    deviation = scene.load.deviation(start, stop)
    loads = contact_values(scene, end.contacts, "line_load").sum(axis=-1) * scene.grid.spacing
    deviation = min(deviation, 0.9 * float(loads.min()))
    if deviation <= 1e-9 * float(loads.max()):
        return spread
    depths = end.cylinder_depth, end.roller_depth
    less, mean, more = (
        Wearing(scene, solve_present(scene, end, loads + shift), passes)
        for shift in (-deviation, 0.0, deviation)
    )
    bias = (
        0.5 * (less.cylinder - 2.0 * mean.cylinder + more.cylinder),
        0.5 * (less.roller - 2.0 * mean.roller + more.roller),
    )
    radii = scene.kinematics.cylinder_radius, scene.kinematics.roller_radius
    weights = np.ones(1), scene.kinematics.multiplicity
    for change, depth, radius, weight in zip(bias, depths, radii, weights, strict=True):
        deep = depth >= DEEP * depth.max(axis=(0, 1, 3), keepdims=True)
        spread[0] = np.maximum(spread[0], np.where(deep, np.abs(change), 0.0).max(axis=(0, 1, 3)))
        volume = worn_volume(change, scene.grid.spacing, radius)
        spread[1] += np.abs((volume * weight[None, :, None]).sum(axis=1).mean(axis=0))
    return COVER * spread


def excess(
    control: StepControl,
    scene: Scene,
    start: WearState,
    end: WearState,
    added: FloatArray,
    stop: float,
) -> float:
    """Return what a step adds to the errors over what it may add.

    Parameters
    ----------
    control : StepControl
    scene : Scene
    start, end : WearState
        The test before and after the step.
    added : ndarray, shape (2, realisations)
        Error of depth [m] and volume [m^3] that the step adds.
    stop : float
        Passes at the end of the test.
    """
    part, worst = end.passes / stop, 0.0
    sizes = deepest(end), whole_volume(scene, end)
    spent = start.depth_error, start.volume_error
    for kind, exponent in enumerate((DEPTH_EXPONENT, VOLUME_EXPONENT)):
        for size, before, error in zip(sizes[kind], spent[kind], added[kind], strict=True):
            if size > 0.0:
                allowed = control.allowance(float(size), exponent, float(before), part)
                worst = max(worst, float(error) / allowed)
    return worst
