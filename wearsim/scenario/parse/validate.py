"""Validation of one table by its pydantic model; pydantic's errors become scenario mistakes."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from wearsim.errors import ScenarioError
from wearsim.quantities import Quantity
from wearsim.scenario.parse.fields import choices, field_at, form, model_at
from wearsim.scenario.parse.mistakes import Mistakes, nearest
from wearsim.units import QuantityError, shown

M = TypeVar("M", bound=BaseModel)

_BOUNDS = {"greater_than", "greater_than_equal", "less_than", "less_than_equal"}
_WHAT = {
    "finite_number": "must be finite",
    "bool_type": "is not true or false",
    "model_type": "is not a table",
    "dict_type": "is not a table",
    "list_type": "is not a list",
    "tuple_type": "is not a list",
    "literal_error": "unknown choice",
    **dict.fromkeys(("float_type", "float_parsing"), "is not a number"),
    **dict.fromkeys(("int_type", "int_parsing", "int_from_float"), "is not a whole number"),
    **dict.fromkeys(("string_type", "string_sub_type"), "is not text"),
}


def validate_options(
    mistakes: Mistakes,
    model: type[M],
    raw: Mapping[str, object],
    table: str,
    other_keys: type[BaseModel] | None = None,
    quantity: Quantity | None = None,
    refused: Sequence[tuple[str | int, ...]] = (),
) -> M | None:
    """Return `raw` as an instance of `model`, or None after adding its mistakes.

    Parameters
    ----------
    mistakes : Mistakes
        Collects the mistakes.
    model : type of BaseModel
        The model of the table.
    raw : mapping of str to object
        The table, without random inputs: a quantity in SI is ``{"si": 3.0}``.
    table : str
        Its name.
    other_keys : type of BaseModel, optional
        Model of the other keys of the same table, which `raw` lacks; for suggestions.
    quantity : Quantity, optional
        Quantity of the values, for the options of a random input.
    refused : sequence of locations
        Locations whose mistakes have been added already.
    """
    # as JSON: its strict mode rejects "3" for 3 but accepts a list for a tuple
    text = json.dumps(raw, default=str)
    context = {"read": mistakes.read, "quantity": quantity, "numbers": dict}
    try:
        return model.model_validate_json(text, strict=True, context=context)
    except ValidationError as error:
        for details in error.errors(include_url=False):
            # a refused random input is still in the table, and fails again at or below its location
            if not any(details["loc"][: len(place)] == place for place in refused):
                _translate(mistakes, details, model, table, other_keys, quantity)
    except ScenarioError as error:
        mistakes.add_file(error, table, key_of_file(raw, error.file))
    return None


def replace_numbers(
    mistakes: Mistakes, model: M, values: Mapping[str, object], table: str
) -> M | None:
    """Return a model with numbers replaced, or None after adding the mistakes.

    The model and its validators see the new numbers as if the table had them.

    Parameters
    ----------
    mistakes : Mistakes
        Collects the mistakes.
    model : BaseModel
        A model of a table.
    values : mapping of str to object
        Numbers in SI by key; a mapping has those of a model within it.
    table : str
        The table's name.
    """
    try:
        return type(model).model_validate(_with_numbers(model, values), context={"numbers": float})
    except ValidationError as error:
        for details in error.errors(include_url=False):
            _translate(mistakes, details, type(model), table)
    return None


def _with_numbers(model: BaseModel, values: Mapping[str, object]) -> dict[str, object]:
    inner = {key: value for key, value in values.items() if isinstance(value, dict)}
    return {
        **{key: getattr(model, key) for key in model.model_fields_set},
        **values,
        **{key: _with_numbers(getattr(model, key), value) for key, value in inner.items()},
    }


def _translate(
    mistakes: Mistakes,
    details: ErrorDetails,
    model: type[BaseModel],
    table: str,
    other_keys: type[BaseModel] | None = None,
    quantity: Quantity | None = None,
) -> None:
    """Add the mistake that an error of pydantic reports."""
    kind, value, loc = details["type"], details["input"], details["loc"]
    *inner, key = [part for part in loc if isinstance(part, str)] or [""]
    place = ".".join([table, *inner])
    key += "".join(f" (entry {part + 1})" for part in loc if isinstance(part, int))
    field = field_at(model, loc)
    expected = form(field, quantity) if field else None
    error = details.get("ctx", {}).get("error")
    if isinstance(error, QuantityError):
        mistakes.add(place, key, error.what, error.got, error.expected)
    elif error and isinstance(error.__cause__, ScenarioError):
        mistakes.add_file(error.__cause__, place, key)
    elif error:
        mistakes.add(place, key, str(error), None if isinstance(value, dict) else shown(value))
    elif kind == "extra_forbidden":
        known = model_at(model, loc[:-1])
        here = [*(known.model_fields if known else ())]
        here += other_keys.model_fields if other_keys and len(loc) == 1 else []
        mistakes.add(place, key, f"unknown key{mistakes.hint(key, here)}")
    elif kind == "missing":
        mistakes.add(place, key, "is missing", None, expected)
    else:
        what = _WHAT.get(kind, "is out of range" if kind in _BOUNDS else "cannot be used")
        if kind == "literal_error" and isinstance(value, str):
            what += nearest(value, choices(field))
        message = details["msg"].removeprefix("Input should be ")
        expected = expected or message[:1].lower() + message[1:]
        mistakes.add(place, key, what, shown(value), expected)


def key_of_file(raw: Mapping[str, object], file: str) -> str:
    """Return the key of a table that names `file`, or nothing."""
    return next((key for key, value in raw.items() if value == file), "")


def split_keys(
    raw: Mapping[str, object], model: type[BaseModel]
) -> tuple[dict[str, object], dict[str, object]]:
    """Split a table into the keys of `model` and all others."""
    own = {key: value for key, value in raw.items() if key in model.model_fields}
    return own, {key: value for key, value in raw.items() if key not in own}
