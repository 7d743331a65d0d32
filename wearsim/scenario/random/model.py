"""Random input of a scenario: target values, persistence of a draw, and distribution."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np
from pydantic import Field

from wearsim.plugins import Distribution, FrictionField, JointDistribution, Options, Process
from wearsim.quantities import Quantity
from wearsim.types import FloatArray
from wearsim.units import in_engineers_unit
from wearsim.uq.sampling.sampler import BELOW_ONE

Persistence: TypeAlias = Literal["per-test", "per-roller", "per-pass"]
Role: TypeAlias = Literal["scalar", "joint", "field", "process"]

LEAST = 1.0 - BELOW_ONE  # least uniform number of a draw
MISALIGNMENT = "creepage.misalignment"
FRICTION = "friction.coefficient"
#: random values of one contact: field name in the contact solution, by scenario key
CONTACT_FIELDS = {
    "load.normal_force": "normal_force_offset",
    FRICTION: "friction",
    "creepage.longitudinal": "longitudinal",
    "creepage.bearing_torque": "bearing_torque",
    "creepage.yaw": "yaw",
    "creepage.tilt": "tilt",
}
#: keys of the values that may vary from pass to pass
OF_A_CONTACT = (*CONTACT_FIELDS, MISALIGNMENT)
#: keys of the values that may differ from roller to roller
OF_A_ROLLER = (*OF_A_CONTACT, "roller.offset")
#: roles of the distributions that need a marginal distribution
WITH_MARGINAL = ("field", "process")
RANDOM_PLACES = "the values of [load], [friction], [creepage] and [wear], and roller.offset"


class RandomInputTable(Options):
    """Random input given for a value; the other keys are options of the distribution."""

    distribution: str = Field(description="Name of the distribution.")
    persistence: Persistence = Field(
        default="per-test",
        description="Persistence of one draw: for the test, per roller or per pass.",
    )
    marginal: dict[str, object] | None = Field(
        default=None,
        description="Marginal distribution at one point or time, of a field or a process.",
    )


def can_be_random(name: str) -> bool:
    """Return whether the value at a dotted key can be random."""
    tables = {"load", "friction", "creepage", "wear"}
    return name.split(".", maxsplit=1)[0] in tables or name == "roller.offset"


def amount(value: float, quantity: Quantity | None) -> str:
    """Return the text of an SI value in the engineering unit of its quantity."""
    return in_engineers_unit(value, quantity.kind.unit if quantity else "1")


_ROLES: dict[Role, type] = {
    "scalar": Distribution,
    "joint": JointDistribution,
    "field": FrictionField,
    "process": Process,
}


@dataclass(frozen=True, eq=False)
class RandomInput:
    """A random input of a scenario.

    Parameters
    ----------
    name : str
        Dotted key of the value that it replaces, "load.normal_force".
    kind : str
        Name of the distribution, "maxent".
    persistence : {"per-test", "per-roller", "per-pass"}
        Persistence of one draw.
    distribution : Distribution, JointDistribution, FrictionField or Process
        The distribution.
    quantity : Quantity, optional
        Quantity of its values; None for a plain number.
    options : mapping of str to object
        Options of the distribution, as written.
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
        """Role: a scalar, several scalars drawn together, a field or a process."""
        return next(role for role, kind in _ROLES.items() if isinstance(self.distribution, kind))

    @property
    def keys(self) -> tuple[str, ...]:
        """Dotted keys of the values that it sets."""
        if isinstance(self.distribution, JointDistribution):
            table = self.name.rsplit(".", 1)[0]
            return tuple(f"{table}.{key}" for key in self.distribution.components)
        return (self.name,)

    @property
    def dimension(self) -> int:
        """Number of uniform numbers per draw; 0 for a field or process with its own stream."""
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
        """Notes for the user on the validity of the distribution."""
        return (
            () if isinstance(self.distribution, JointDistribution) else self.distribution.warnings
        )

    @property
    def scalar(self) -> Distribution:
        """Distribution of one value; the marginal one for a field or a process."""
        found = getattr(self.distribution, "marginal", self.distribution)
        if not isinstance(found, Distribution):
            raise TypeError(f"{self.name} sets several values")
        return found

    @property
    def extremes(self) -> tuple[float, float]:
        """Least and greatest value of a draw; inside the support of a continuous distribution."""
        least, most = self.scalar.quantile(np.array([LEAST, BELOW_ONE]))
        return float(least), float(most)

    @property
    def greatest(self) -> float:
        """Greatest magnitude of the values that it sets."""
        item = self.distribution
        return max(map(abs, item.reach if isinstance(item, JointDistribution) else self.extremes))

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
            If it is a field or a process, whose values depend on position or time.
        """
        if isinstance(self.distribution, JointDistribution):
            return self.distribution.values(uniform)
        if not isinstance(self.distribution, Distribution):
            raise TypeError(f"{self.name} is a {self.role}, which has no single value per draw")
        return self.distribution.quantile(uniform[:, 0])[:, None]

    def describe(self) -> str:
        """Return a description in one line, in engineering units."""
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
        low, high = self.scalar.support
        left, right = "(" if low == -math.inf else "[", ")" if high == math.inf else "]"
        words += [
            f"mean {amount(self.scalar.mean, self.quantity)}",
            f"std {amount(self.scalar.std, self.quantity)}",
            f"on {left}{amount(low, self.quantity)}, {amount(high, self.quantity)}{right}",
        ]
        return ", ".join([*words, self.persistence])
