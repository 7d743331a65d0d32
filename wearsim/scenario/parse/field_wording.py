"""Descriptions of the expected form of a field of an options model, for messages."""

from __future__ import annotations

import types
from collections.abc import Sequence
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MultipleOf
from pydantic import BaseModel, PlainValidator
from pydantic.fields import FieldInfo

from wearsim.quantities import HostQuantity, Quantity
from wearsim.units import shown

_LIMITS = (
    (Gt, "gt", "above"),
    (Ge, "ge", "of at least"),
    (Lt, "lt", "below"),
    (Le, "le", "at most"),
)


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


def choices(field: FieldInfo | None) -> list[str]:
    """Return the names between which a field chooses."""
    parts = alternatives(field) if field else []
    return [str(item) for part in parts if get_origin(part) is Literal for item in get_args(part)]


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
    limits = " and ".join(
        f"{words} {_plain(getattr(item, name))}"
        for item in field.metadata
        for kind, name, words in _LIMITS
        if isinstance(item, kind)
    )
    return " or ".join(known) + (f" {limits}" if limits else "") if known else None


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


def _plain(limit: Any) -> str:
    return f"{limit:g}" if isinstance(limit, float) else str(limit)
