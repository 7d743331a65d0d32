"""Weights of the Runge-Kutta-Legendre scheme of second order."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

FEWEST = 3  # two are of little accuracy for what decays within a step


class Stage(NamedTuple):
    """Weights of one stage; the step's start has 1 - last - before_last.

    Parameters
    ----------
    last, before_last : float
        Weights of the two stages before.
    rate, start_rate : float
        Parts of the step taken at the rate of the last stage, and at that of the start.
    """

    last: float
    before_last: float
    rate: float
    start_rate: float


def reach(count: int) -> float:
    """Return the longest stable step of `count` stages, times the greatest rate of decay.

    It grows with the square of the stages, where as many steps of Euler's method reach 2 each.
    """
    return 0.5 * (count * count + count - 2)


def stages_for(decay: float) -> int:
    """Return the least number of stages whose `reach` is `decay`, `FEWEST` at least."""
    return max(FEWEST, math.ceil(0.5 * (math.sqrt(9.0 + 8.0 * decay) - 1.0)))


@lru_cache(maxsize=256)
def legendre_stages(count: int) -> tuple[Stage, ...]:
    """Return the weights of `count` stages, two at least; the last stage is the step's end.

    The scheme's stability polynomial is a shifted Legendre polynomial: what decays fast falls by
    about half in a step, without change of sign. Chebyshev's reaches 1.3 times as far, but lets
    much more of it stand, and the kink that a contact's edge makes then sends ripples over the
    profile.

    References
    ----------
    .. [1] C.D. Meyer, D.S. Balsara, T.D. Aslam, A stabilized Runge-Kutta-Legendre method for
       explicit super-time-stepping of parabolic and mixed equations, J. Comput. Phys. 257 (2014)
       594-626, DOI 10.1016/j.jcp.2013.08.021.
    """
    b = [1.0 / 3.0] * 2 + [(j * j + j - 2) / (2.0 * j * (j + 1)) for j in range(2, count + 1)]
    scale = 2.0 / reach(count)
    stages = [Stage(0.0, 0.0, 0.0, b[1] * scale)]
    for j in range(2, count + 1):
        last = (2 * j - 1) / j * b[j] / b[j - 1]
        before_last = -(j - 1) / j * b[j] / b[j - 2]
        stages.append(Stage(last, before_last, scale * last, (b[j - 1] - 1.0) * scale * last))
    return tuple(stages)
