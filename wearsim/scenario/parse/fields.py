"""Fields of tables: alternatives, form in words, and the random inputs that may set them."""

from __future__ import annotations

import math
import types
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, TypeAlias, Union, get_args, get_origin

import numpy as np
from annotated_types import MultipleOf
from pydantic import BaseModel, Field, PlainValidator
from pydantic.fields import FieldInfo

from wearsim.plugins import Distribution, FrictionField, JointDistribution, Options, Process
from wearsim.quantities import HostQuantity, Quantity
from wearsim.types import FloatArray
from wearsim.units import as_written, in_engineers_unit
from wearsim.uq.distributions.mixture import Mixture
from wearsim.uq.sampling.sampler import BELOW_ONE

_LIMITS = {"gt": "above", "ge": "at least", "lt": "below", "le": "at most"}
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
#: last parts of keys in these tables whose values cannot be random
_FIXED = ("creep_factor", "specific_wear_rate", "measured_friction", "length")
#: tables of the forms along the axis
AXIAL_TABLES = tuple(f"{body}.axial_profile" for body in ("roller", "cylinder", "cam"))
RANDOM_PLACES = (
    "the values of [load], [friction], [creepage] and [wear], roller.offset, and those of"
    " axial_profile except its length"
)
_ROLES: dict[Role, type] = {
    "scalar": Distribution,
    "joint": JointDistribution,
    "field": FrictionField,
    "process": Process,
}
Persistence: TypeAlias = Literal["per-test", "per-roller", "per-pass", "per-turn"]
Role: TypeAlias = Literal["scalar", "joint", "field", "process"]


def _parts(annotation: Any) -> list[Any]:
    """Return the alternatives that an annotation allows, without None."""
    if get_origin(annotation) in {Union, types.UnionType}:
        return [part for item in get_args(annotation) for part in _parts(item)]
    return [] if annotation is type(None) else [annotation]


def alternatives(field: FieldInfo) -> list[Any]:
    """Return the types that a field's value may have, without None."""
    inputs = [item for item in field.metadata if isinstance(item, PlainValidator)]
    return _parts(inputs[0].json_schema_input_type if inputs else field.annotation)


def model_at(model: type[BaseModel], loc: Sequence[str | int]) -> type[BaseModel] | None:
    """Return the model of the table at a location within `model`, or None."""
    if not loc:
        return model
    field = field_at(model, loc)
    return next((part for part in alternatives(field) if _is_model(part)), None) if field else None


def _is_model(part: Any) -> bool:
    return isinstance(part, type) and issubclass(part, BaseModel)


def field_at(model: type[BaseModel], loc: Sequence[str | int]) -> FieldInfo | None:
    """Return the field at a location within `model`, or None."""
    names = [part for part in loc if isinstance(part, str)]
    owner = model_at(model, names[:-1]) if names else None
    return owner.model_fields.get(names[-1]) if owner else None


def choices(field: FieldInfo) -> list[str]:
    """Return the names between which a field chooses."""
    literals = [part for part in alternatives(field) if get_origin(part) is Literal]
    return [str(item) for part in literals for item in get_args(part)]


def form(field: FieldInfo, quantity: Quantity | None = None) -> str | None:
    """Return the form in which a field is written, such as "a whole number of at least 1".

    Parameters
    ----------
    field : FieldInfo
        A field of an options model.
    quantity : Quantity, optional
        Quantity of the random input's values, where the field is one of its options.
    """
    for item in field.metadata:
        if isinstance(item, Quantity):
            return item.expected
    marks = [item for item in field.metadata if isinstance(item, HostQuantity)]
    parts = [Annotated[part, marks[0]] if marks else part for part in alternatives(field)]
    steps = [item.multiple_of for item in field.metadata if isinstance(item, MultipleOf)]
    known = [f"a multiple of {step}" for step in steps] or list(
        dict.fromkeys(text for part in parts if (text := _form(part, quantity)))
    )
    limits = in_words(_limits(field.metadata))
    of = " of " if limits.startswith("at least") else " "
    return f"{' or '.join(known)}{of}{limits}".rstrip() if known else None


def _form(part: Any, quantity: Quantity | None = None) -> str | None:
    if get_origin(part) is Annotated:
        for item in part.__metadata__:
            if isinstance(item, HostQuantity) and quantity:
                return quantity.kind.expected(item.bound)
            if isinstance(item, Quantity):
                return item.expected
        return _form(get_args(part)[0])
    if get_origin(part) is Literal:
        return "one of " + ", ".join(as_written(item) for item in get_args(part))
    if _is_model(part) or get_origin(part) is dict:
        return "a table"
    return {float: "a number", int: "a whole number", bool: "true or false", str: "text"}.get(part)


def _limits(marks: Iterable[Any]) -> dict[str, Any]:
    """Return the bounds of a number, by their names in pydantic."""
    limits = [(name, getattr(mark, name, None)) for mark in marks for name in _LIMITS]
    return {name: bound for name, bound in limits if bound is not None}


def in_words(limits: Mapping[str, Any]) -> str:
    """Return the range of a number, such as "above 0 and at most 1"."""
    words = {name: f"{end:g}" if isinstance(end, float) else end for name, end in limits.items()}
    return " and ".join(f"{_LIMITS[name]} {end}" for name, end in words.items())


@dataclass(frozen=True)
class RandomTarget:
    """The number, or the numbers, that a random input sets.

    A key that takes a joint random input has it in its annotation.

    Parameters
    ----------
    quantity : Quantity, optional
        Its quantity; None for a plain number.
    limits : mapping of str to float
        Bounds of a number in SI: ``gt``, ``ge``, ``lt``, ``le``.
    components : tuple of str
        Keys of the same table that the input sets together; none for the number of the key itself.
    """

    quantity: Quantity | None
    limits: Mapping[str, float] = field(default_factory=dict)
    components: tuple[str, ...] = ()

    @property
    def range(self) -> tuple[float, float]:
        """Least and greatest value."""
        low = max(self.limits.get(name, -math.inf) for name in ("gt", "ge"))
        return low, min(self.limits.get(name, math.inf) for name in ("lt", "le"))

    @property
    def support(self) -> str:
        """Widest allowed support of a random input, as a scenario holds it."""
        ends: list[object] = [end or 0 for end in self.range]
        for k, end in enumerate(self.range):
            if math.isinf(end):
                ends[k] = str(end)
            elif self.quantity:
                ends[k] = self.quantity.write(end)
        return as_written(ends)


def target_of(field: FieldInfo) -> RandomTarget | None:
    """Return what a random input in a field sets, or None for a field without numbers."""
    for mark in field.metadata:
        if isinstance(mark, RandomTarget):
            return mark
    for part in alternatives(field):
        kind, *marks = get_args(part) if get_origin(part) is Annotated else (part,)
        if kind is float:
            marks += field.metadata
            quantity = next((mark for mark in marks if isinstance(mark, Quantity)), None)
            limits = _limits(marks)
            if quantity and quantity.bound != "any":
                limits["gt" if quantity.bound == "positive" else "ge"] = 0.0
            return RandomTarget(quantity, limits)
    return None


class RandomInputTable(Options):
    """Random input given for a value; the other keys are options of the distribution."""

    distribution: str = Field(description="Name of the distribution.")
    persistence: Persistence = Field(
        default="per-test",
        description="Persistence of one draw: for the test, per roller, per pass, or per turn and"
        " shared by all rollers.",
    )
    marginal: dict[str, object] | None = Field(
        default=None,
        description="Marginal distribution at one point or time, of a field or a process.",
    )


def can_be_random(name: str) -> bool:
    """Return whether the value at a dotted key can be random."""
    tables = {"load", "friction", "creepage", "wear"}
    inner, _, last = name.rpartition(".")
    of_table = inner in AXIAL_TABLES or name.split(".", maxsplit=1)[0] in tables
    return (of_table and last not in _FIXED) or name == "roller.offset"


def is_axial(name: str) -> bool:
    """Return whether a dotted key is one of a form along the axis."""
    return name.rpartition(".")[0] in AXIAL_TABLES


def amount(value: float, quantity: Quantity | None) -> str:
    """Return the text of an SI value in the engineering unit of its quantity."""
    return in_engineers_unit(value, quantity.kind.unit if quantity else "1")


@dataclass(frozen=True, eq=False)
class RandomInput:
    """A random input of a scenario.

    Parameters
    ----------
    name : str
        Dotted key of the value that it replaces, "load.normal_force".
    kind : str
        Name of the distribution, "maxent".
    persistence : {"per-test", "per-roller", "per-pass", "per-turn"}
        Persistence of one draw; that of a turn is shared by all rollers.
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
    def is_redrawn(self) -> bool:
        """Whether it is drawn many times in a test."""
        return self.persistence in {"per-pass", "per-turn"}

    @property
    def dimension(self) -> int:
        """Number of uniform numbers per draw; 0 for a field or process with its own stream."""
        if isinstance(self.distribution, JointDistribution):
            return self.distribution.dimension
        return 1 if isinstance(self.distribution, Distribution) else 0

    @property
    def mean(self) -> tuple[float, ...]:
        """Mean of each value that it sets [SI]."""
        item = self.distribution
        return item.mean if isinstance(item, JointDistribution) else (self.scalar.mean,)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Notes for the user on the validity of the distribution."""
        return (
            () if isinstance(self.distribution, JointDistribution) else self.distribution.warnings
        )

    @property
    def scalar(self) -> Distribution:
        """Distribution of one value; the marginal one for a field or a process."""
        distribution = getattr(self.distribution, "marginal", self.distribution)
        if not isinstance(distribution, Distribution):
            raise TypeError(f"{self.name} sets several values")
        return distribution

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
        if isinstance(self.distribution, Mixture):
            words[0] += f" of {len(self.distribution.components)}"
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
