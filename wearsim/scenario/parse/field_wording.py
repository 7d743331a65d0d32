"""How the fields of an options model are written, in words for messages."""

from __future__ import annotations

import types
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MultipleOf
from pydantic import BaseModel, PlainValidator

from wearsim.quantities import HostQuantity, Quantity
from wearsim.units import shown

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pydantic.fields import FieldInfo


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
    """Return the model that stands at a location within `model`."""
    if not loc:
        return model
    field = field_at(model, loc)
    found = [part for part in alternatives(field) if _is_model(part)] if field else []
    return found[0] if found else None


def _is_model(part: Any) -> bool:
    return isinstance(part, type) and issubclass(part, BaseModel)


def field_at(model: type[BaseModel], loc: Sequence[str | int]) -> FieldInfo | None:
    """Return the field that a location within `model` means."""
    names = [part for part in loc if isinstance(part, str)]
    if not names:
        return None
    owner = model_at(model, names[:-1])
    return owner.model_fields.get(names[-1]) if owner else None


def choices(field: FieldInfo | None) -> list[str]:
    """Return the words that a field can be."""
    parts = alternatives(field) if field else []
    return [str(item) for part in parts if get_origin(part) is Literal for item in get_args(part)]


def form(field: FieldInfo, host: Quantity | None = None) -> str | None:
    """Return the form in which a field is written, such as "a whole number of at least 1".

    Parameters
    ----------
    field : FieldInfo
        A field of an options model.
    host : Quantity, optional
        What the random input's values measure, where the field is one of its options.
    """
    for item in field.metadata:
        if isinstance(item, Quantity):
            return item.expected
    forms = [_form(part, host) for part in _marked(field)]
    known = list(dict.fromkeys(text for text in forms if text))
    steps = [item.multiple_of for item in field.metadata if isinstance(item, MultipleOf)]
    known = [f"a multiple of {step}" for step in steps] or known
    return " or ".join(known) + _limits(field.metadata) if known else None


def _marked(field: FieldInfo) -> list[Any]:
    """Return the field's alternatives, one that takes its mark from the field with that mark."""
    marks = [item for item in field.metadata if isinstance(item, HostQuantity)]
    return [Annotated[part, marks[0]] if marks else part for part in alternatives(field)]


def _form(part: Any, host: Quantity | None = None) -> str | None:
    if get_origin(part) is Annotated:
        for item in part.__metadata__:
            if isinstance(item, HostQuantity) and host:
                return host.kind.expected(item.bound)
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


def _limits(metadata: Sequence[Any]) -> str:
    words = []
    for item in metadata:
        if isinstance(item, Gt):
            words.append(f"above {_plain(item.gt)}")
        elif isinstance(item, Ge):
            words.append(f"of at least {_plain(item.ge)}")
        elif isinstance(item, Lt):
            words.append(f"below {_plain(item.lt)}")
        elif isinstance(item, Le):
            words.append(f"at most {_plain(item.le)}")
    return f" {' and '.join(words)}" if words else ""
