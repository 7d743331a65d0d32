"""The joint random input `disc`: a roller's yaw and tilt, uniform within the slack of its mount."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from wearsim.plugins import JointDistribution, Options
from wearsim.quantities import PositiveValue
from wearsim.types import FloatArray

_FARTHEST = 40.0  # no uniform number has a normal score beyond it


class DiscOptions(Options):
    """Options of the joint distribution `disc`."""

    radius: PositiveValue = Field(description="greatest size of both together, e.g. '2 mrad'")


class Disc(JointDistribution):
    """Yaw and tilt, uniform on a disc about zero.

    Two normal scores have a direction that is uniform, and a length r that falls below R with
    probability 1 - exp(-R^2/2), which is the part of the disc's area that it is sent to. Turned
    uniforms 1 - u give the negative of both.
    """

    components = ("yaw", "tilt")
    dimension = 2

    def __init__(self, options: DiscOptions) -> None:
        self._radius = options.radius

    def values(self, uniform: FloatArray) -> FloatArray:
        """Return yaw and tilt, shape (draws, 2), from uniforms (draws, 2)."""
        from scipy.special import ndtri  # noqa: PLC0415  (slow to import, and rarely needed)

        scores = np.clip(ndtri(uniform), -_FARTHEST, _FARTHEST)
        # the least number above zero stands for the centre, where the ratio's limit is right
        square = np.maximum((scores**2).sum(axis=-1, keepdims=True), 1e-300)
        values: FloatArray = self._radius * np.sqrt(-np.expm1(-0.5 * square) / square) * scores
        return values

    @property
    def mean(self) -> tuple[float, float]:
        """Mean of both."""
        return 0.0, 0.0

    @property
    def reach(self) -> tuple[float, float]:
        """Greatest size of each."""
        return self._radius, self._radius
