"""A random input as a scenario holds it: which values it sets, how long one draw lasts, its law."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np
from pydantic import Field

from wearsim.plugins import Distribution, FrictionField, JointDistribution, Options, Process
from wearsim.quantities import Quantity
from wearsim.types import FloatArray
from wearsim.units import in_engineers_unit
from wearsim.uq.sampling.plans import BELOW_ONE

Persistence: TypeAlias = Literal["per-test", "per-roller", "per-pass"]
Role: TypeAlias = Literal["scalar", "joint", "field", "process"]

LEAST = 1.0 - BELOW_ONE  # the least uniform number that a draw takes
MISALIGNMENT = "creepage.misalignment"
FRICTION = "friction.coefficient"
CONTACT_FIELDS = {
    "load.normal_force": "normal_force_offset",
    FRICTION: "friction",
    "creepage.longitudinal": "longitudinal",
    "creepage.bearing_torque": "bearing_torque",
    "creepage.yaw": "yaw",
    "creepage.tilt": "tilt",
}
"""What one contact sees: its name where contacts are solved, by the scenario's key."""
OF_A_CONTACT = (*CONTACT_FIELDS, MISALIGNMENT)
"""What may change from pass to pass."""
OF_A_ROLLER = (*OF_A_CONTACT, "roller.offset")
"""What may differ from roller to roller."""
RANDOM_PLACES = "the values of [load], [friction], [creepage] and [wear], and roller.offset"


class RandomInputTable(Options):
    """A random input in the place of a value; its own options stand beside these keys."""

    distribution: str = Field(description="Name of the random input.")
    persistence: Persistence = Field(
        default="per-test", description="How long one draw lasts: the test, a roller or a pass."
    )
    marginal: dict[str, object] | None = Field(
        default=None,
        description="Distribution at any one point or time; for a field and a process.",
    )


def can_be_random(name: str) -> bool:
    """Tell whether a random input may stand at a dotted key."""
    return (
        name.split(".", maxsplit=1)[0] in {"load", "friction", "creepage", "wear"}
        or name == "roller.offset"
    )


def amount(value: float, quantity: Quantity | None) -> str:
    """Return an SI value in the engineers' unit of its quantity."""
    return in_engineers_unit(value, quantity.kind.unit if quantity else "1")


@dataclass(frozen=True, eq=False)
class RandomInput:
    """A random input of a scenario.

    Parameters
    ----------
    name : str
        Dotted key that it stands for, "load.normal_force".
    kind : str
        Name of the distribution, "maxent".
    persistence : {"per-test", "per-roller", "per-pass"}
        How long one draw lasts.
    distribution : Distribution, JointDistribution, FrictionField or Process
        The law.
    quantity : Quantity, optional
        What its values measure; nothing for a plain number.
    options : mapping of str to object
        Its options as written.
    marginal : str
        Name of the marginal distribution of a field or a process.
    """

    name: str
    kind: str
    persistence: Persistence
    distribution: Distribution | JointDistribution | FrictionField | Process
    quantity: Quantity | None
    options: Mapping[str, object] = field(default_factory=dict)
    marginal: str = ""

    @property
    def role(self) -> Role:
        """What it is: a scalar, several scalars drawn together, a field or a process."""
        if isinstance(self.distribution, Distribution):
            return "scalar"
        if isinstance(self.distribution, JointDistribution):
            return "joint"
        return "field" if isinstance(self.distribution, FrictionField) else "process"

    @property
    def keys(self) -> tuple[str, ...]:
        """Dotted keys of the values that it sets."""
        if isinstance(self.distribution, JointDistribution):
            table = self.name.rsplit(".", 1)[0]
            return tuple(f"{table}.{key}" for key in self.distribution.components)
        return (self.name,)

    @property
    def dimension(self) -> int:
        """Uniform numbers that one draw takes; none where a field or process has its own stream."""
        if isinstance(self.distribution, JointDistribution):
            return self.distribution.dimension
        return 1 if isinstance(self.distribution, Distribution) else 0

    @property
    def mean(self) -> tuple[float, ...]:
        """Mean of each value that it sets [SI]."""
        if isinstance(self.distribution, JointDistribution):
            return self.distribution.mean
        return (self.scalar.mean,)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user should know before trusting it."""
        if isinstance(self.distribution, JointDistribution):
            return ()
        return self.distribution.warnings

    @property
    def scalar(self) -> Distribution:
        """Distribution of one value: its own, or the marginal of a field or a process."""
        if isinstance(self.distribution, FrictionField | Process):
            return self.distribution.marginal
        if isinstance(self.distribution, Distribution):
            return self.distribution
        raise TypeError(f"{self.name} sets several values")

    @property
    def extremes(self) -> tuple[float, float]:
        """Least and greatest value that a draw can have; a continuous law keeps off its ends."""
        least, most = self.scalar.quantile(np.array([LEAST, BELOW_ONE]))
        return float(least), float(most)

    @property
    def greatest(self) -> float:
        """Greatest size that any of the values it sets can have."""
        if isinstance(self.distribution, JointDistribution):
            return max(self.distribution.reach)
        return max(abs(end) for end in self.extremes)

    def values(self, uniform: FloatArray) -> FloatArray:
        """Return draws of the values that a scalar or joint input sets.

        Parameters
        ----------
        uniform : ndarray, shape (draws, dimension)
            Uniform numbers between 0 and 1.

        Returns
        -------
        ndarray, shape (draws, keys)
            In SI.

        Raises
        ------
        TypeError
            If it is a field or a process, whose values depend on place or time.
        """
        if isinstance(self.distribution, JointDistribution):
            return self.distribution.values(uniform)
        if not isinstance(self.distribution, Distribution):
            raise TypeError(f"{self.name} is a {self.role}: it has no one value per draw")
        return self.distribution.quantile(uniform[:, 0])[:, None]

    def describe(self) -> str:
        """Return what it is in one line, in engineers' units."""
        words = [self.kind]
        if isinstance(self.distribution, JointDistribution):
            pairs = zip(self.distribution.components, self.distribution.reach, strict=True)
            words += [f"{key} up to {amount(most, self.quantity)}" for key, most in pairs]
            return ", ".join([*words, self.persistence])
        if self.marginal:
            words += [f"{key.replace('_', ' ')} {text}" for key, text in self.options.items()]
            if isinstance(self.distribution, FrictionField) and "frame" not in self.options:
                words.append(f"frame {self.distribution.frame}")
            words.append(f"of {self.marginal}")
        law = self.scalar
        words += [
            f"mean {amount(law.mean, self.quantity)}",
            f"std {amount(law.std, self.quantity)}",
        ]
        return ", ".join([*words, f"on {self._support()}", self.persistence])

    def _support(self) -> str:
        low, high = self.scalar.support
        left = "(" if low == -float("inf") else "["
        right = ")" if high == float("inf") else "]"
        return f"{left}{amount(low, self.quantity)}, {amount(high, self.quantity)}{right}"
