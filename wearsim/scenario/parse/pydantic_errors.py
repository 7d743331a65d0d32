"""Validation of one table by its pydantic model; pydantic's errors become scenario mistakes."""

from __future__ import annotations

import difflib
import json
from collections.abc import Mapping, Sequence
from typing import TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from wearsim.errors import ScenarioError
from wearsim.quantities import Quantity
from wearsim.scenario.parse.field_wording import choices, field_at, form, model_at
from wearsim.scenario.parse.mistakes import Mistakes, nearest
from wearsim.scenario.random.model import can_be_random
from wearsim.scenario.random.targets import joint_target_of, random_target_of
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
    refused: Sequence[Sequence[str | int]] = (),
) -> M | None:
    """Return `raw` as an instance of `model`, or None after adding its mistakes.

    Parameters
    ----------
    mistakes : Mistakes
        Collects the mistakes.
    model : type of BaseModel
        The model of the table.
    raw : mapping of str to object
        The table, without random inputs.
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
    context = {"read": mistakes.read, "quantity": quantity}
    try:
        return model.model_validate_json(text, strict=True, context=context)
    except ValidationError as error:
        for details in error.errors(include_url=False):
            # a refused random input is still in the table, and fails again at or below its location
            if not details["loc"] or not any(
                all(one == other for one, other in zip(details["loc"], place, strict=False))
                for place in refused
            ):
                _translate(mistakes, details, model, raw, table, other_keys, quantity)
    except ScenarioError as error:
        mistakes.add_file(error, table, key_of_file(raw, error.file))
    return None


def _translate(
    mistakes: Mistakes,
    details: ErrorDetails,
    model: type[BaseModel],
    raw: object,
    table: str,
    other_keys: type[BaseModel] | None,
    quantity: Quantity | None,
) -> None:
    """Add the mistake that an error of pydantic reports."""
    place, key = _where(details["loc"], raw, table)
    field = field_at(model, details["loc"])
    kind, value = details["type"], details["input"]
    expected = form(field, quantity) if field else None
    # a table in place of a value that can be random: a random input without its distribution
    is_random = (
        field is not None
        and can_be_random(f"{place}.{key}")
        and (random_target_of(field) or joint_target_of(field))
        and not any(f"{place}.".startswith(f"{name}.") for name in mistakes.random_keys)
    )
    if kind != "missing" and isinstance(value, dict) and is_random:
        if near := difflib.get_close_matches("distribution", value, n=1):
            what = "unknown key (did you mean 'distribution'?)"
            mistakes.add(f"{place}.{key}", near[0], what)
        else:
            expected = "the name of a random input"
            mistakes.add(f"{place}.{key}", "distribution", "is missing", None, expected)
    elif kind == "value_error":
        _add_value_error(mistakes, place, key, details["ctx"]["error"], value)
    elif kind == "extra_forbidden":
        known = model_at(model, details["loc"][:-1])
        here = list(known.model_fields) if known else []
        if other_keys and len(details["loc"]) == 1:
            here += other_keys.model_fields
        mistakes.add(place, key, f"unknown key{mistakes.hint(key, here)}")
    elif kind == "missing":
        mistakes.add(place, key, "is missing", None, expected)
    elif kind == "literal_error" and isinstance(value, str):
        what = f"unknown choice{nearest(value, choices(field))}"
        mistakes.add(place, key, what, shown(value), expected)
    else:
        what = _WHAT.get(kind, "is out of range" if kind in _BOUNDS else "cannot be used")
        message = details["msg"].removeprefix("Input should be ")
        expected = expected or message[:1].lower() + message[1:]
        mistakes.add(place, key, what, shown(value), expected)


def _add_value_error(
    mistakes: Mistakes, table: str, key: str, error: Exception, value: object
) -> None:
    if isinstance(error, QuantityError):
        mistakes.add(table, key, error.what, error.got, error.expected)
    elif isinstance(error.__cause__, ScenarioError):
        mistakes.add_file(error.__cause__, table, key)
    else:
        mistakes.add(table, key, str(error), None if isinstance(value, dict) else shown(value))


def key_of_file(raw: Mapping[str, object], file: str) -> str:
    """Return the key of a table that names `file`, or nothing."""
    return next((key for key, value in raw.items() if value == file), "")


def split_keys(
    raw: Mapping[str, object], model: type[BaseModel]
) -> tuple[dict[str, object], dict[str, object]]:
    """Split a table into the keys of `model` and all others."""
    own = {key: value for key, value in raw.items() if key in model.model_fields}
    return own, {key: value for key, value in raw.items() if key not in own}


def _where(loc: Sequence[str | int], raw: object, table: str) -> tuple[str, str]:
    """Return the table and the key of a location within a table's model."""
    key = ""
    for part in loc:
        if isinstance(part, int):
            key += f" (entry {part + 1})"
        elif key and isinstance(raw, dict):
            table, key = f"{table}.{key}", part
        else:
            key = part
        raw = raw.get(part) if isinstance(raw, dict) else None
    return table, key
