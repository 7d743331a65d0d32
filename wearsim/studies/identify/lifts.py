"""Change of a measured lift by wear, as a trace along the angle of the cam, and its likelihood.

change_j = c0 - f(theta_j; ln K) + noise, where f is the fall of the lift. The offset c0, and where
it is asked for the run-out c1 cos(theta) + c2 sin(theta) of a cam that was mounted again, have flat
priors and are integrated in closed form, as in `likelihood`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from wearsim.csv_cells import decode
from wearsim.errors import mistake_in
from wearsim.mechanics.cam import Follower
from wearsim.models.motion import LiftSpline
from wearsim.scenario.tables.cam_lift import one_turn, read_lift_table
from wearsim.studies.cam.observables import CURVE_ANGLES
from wearsim.studies.identify.likelihood import TraceLikelihood
from wearsim.studies.identify.measurements import Measurement
from wearsim.studies.identify.traces import Trace, block_means
from wearsim.types import FloatArray, IntArray
from wearsim.uq.hierarchy.noise import MOST_POINTS


def read_change(item: Measurement, follower: Follower) -> Trace:
    """Return the lift of a worn cam less the lift before wear, as a trace along the angle.

    Parameters
    ----------
    item : Measurement
        With the files of both lifts.
    follower : Follower
        An arm's angles become lengths along the path of its roller.

    Returns
    -------
    Trace
        Its `y` are angles [rad].

    Raises
    ------
    ScenarioError
        If a file cannot be read or the lift rises.
    """
    assert item.lift is not None
    assert item.before is not None
    (angle, worn), (other, unworn) = (
        _lift(path, item, follower) for path in (item.lift, item.before)
    )
    if len(angle) == len(other) and np.allclose(angle, other, rtol=0.0, atol=1e-9):
        change = worn - unworn
    else:
        curve = LiftSpline(other - other[0], np.append(unworn[:-1], unworn[0]), closed=True)
        change = worn - curve(np.mod(angle - other[0], 2.0 * np.pi))[0]
    angle, change = block_means(-(-(len(angle) - 1) // MOST_POINTS), angle[:-1], change[:-1])
    unworn_points = np.zeros(len(angle), dtype=np.bool_)
    return Trace(
        item.name,
        angle,
        change,
        unworn_points,
        "the lift before the test",
        None,
        None,
        None,
        0.0,
        difference=True,
    )


def _lift(path: Path, item: Measurement, follower: Follower) -> tuple[FloatArray, FloatArray]:
    """Return angles [rad] and lifts [m] of a file over a closed turn."""
    try:
        text = decode(path.read_bytes())
    except OSError as error:
        raise mistake_in(str(path), f"the file cannot be read ({error.strerror})") from error
    choice = item.choice
    angle, lift = read_lift_table(text, str(path), choice.columns, choice.units, follower)
    angle, lift = one_turn(str(path), angle, lift, "rad" if follower.swings else "m")
    return angle, lift * follower.lever


@dataclass(frozen=True)
class LiftLikelihood(TraceLikelihood):
    """Likelihood of a change of the lift.

    Parameters
    ----------
    curvature : bool
        Whether the run-out of the cam is unknown.
    """

    @cached_property
    def forms(self) -> FloatArray:
        """Offset and perhaps run-out, shape (points, forms)."""
        ones = np.ones_like(self.y)
        if not self.curvature:
            return ones[:, None]
        return np.stack([ones, np.cos(self.y), np.sin(self.y)], axis=1)

    @cached_property
    def _between(self) -> FloatArray:
        """Interpolation from the angles of the curves, shape (points, curve angles)."""
        place, eye = np.mod(self.y, 2.0 * np.pi), np.eye(len(CURVE_ANGLES))
        return np.stack([np.interp(place, CURVE_ANGLES, row) for row in eye], axis=1)

    def worn(self, draw: IntArray, ln_k: FloatArray, shift: FloatArray) -> FloatArray:
        """Return the fall of the lift, shape (points, columns) [m].

        Between two records each is scaled by K/H to the power 2/3, which is exact for rigid bodies
        in full slip.
        """
        record, part = self.records(draw, ln_k)
        total = np.zeros((len(draw), len(CURVE_ANGLES)))
        last = self.grown.ln_k.shape[1] - 1
        for step, weight in ((0, 1.0 - part), (1, part)):
            place = np.minimum(record + step, last)
            scale = weight * np.exp((ln_k - self.grown.ln_k[draw, place]) / 1.5)
            total += scale[:, None] * self.grown.depth[self.body][draw, place]
        return np.asarray(self._between @ total.T)
