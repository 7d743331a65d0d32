"""Fields of options models: alternatives, form in words, and what a random input may set."""

from __future__ import annotations

import math
import types
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import MultipleOf
from pydantic import BaseModel, PlainValidator
from pydantic.fields import FieldInfo

from wearsim.quantities import HostQuantity, Quantity
from wearsim.units import shown

_LIMITS = {"gt": "above", "ge": "at least", "lt": "below", "le": "at most"}


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
        return "one of " + ", ".join(shown(item) for item in get_args(part))
    if _is_model(part) or get_origin(part) is dict:
        return "a table"
    names = {float: "a number", int: "a whole number", bool: "true or false", str: "text"}
    return names.get(part)


def _limits(marks: Iterable[Any]) -> dict[str, Any]:
    """Return the bounds of a number, by their names in pydantic."""
    found = [(name, getattr(mark, name, None)) for mark in marks for name in _LIMITS]
    return {name: bound for name, bound in found if bound is not None}


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
        return shown(ends)


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
