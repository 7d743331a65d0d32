"""Validation of one table by its pydantic model; pydantic's errors become scenario mistakes."""

from __future__ import annotations

import difflib
import json
from typing import TYPE_CHECKING, TypeVar

from pydantic import BaseModel, ValidationError

from wearsim.errors import ScenarioError
from wearsim.scenario.parse.field_wording import choices, field_at, form, model_at
from wearsim.scenario.random.model import can_be_random
from wearsim.scenario.random.targets import host_of, joint_of
from wearsim.units import QuantityError, shown

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pydantic.fields import FieldInfo
    from pydantic_core import ErrorDetails

    from wearsim.quantities import Quantity
    from wearsim.scenario.parse.mistakes import Report

M = TypeVar("M", bound=BaseModel)


def validate_options(
    report: Report,
    model: type[M],
    raw: Mapping[str, object],
    table: str,
    beside: type[BaseModel] | None = None,
    host: Quantity | None = None,
    refused: Sequence[Sequence[str | int]] = (),
) -> M | None:
    """Return `raw` as an instance of `model`, or None after adding its mistakes to the report.

    Parameters
    ----------
    report : Report
        Collects the mistakes.
    model : type of BaseModel
        The model of the table.
    raw : mapping of str to object
        The table, without random inputs.
    table : str
        Its name.
    beside : type of BaseModel, optional
        Model of keys that stand in the same table and were removed, for suggestions.
    host : Quantity, optional
        Quantity that the values of a random input measure.
    refused : sequence of locations
        Locations whose mistakes have been reported already.
    """
    # as JSON, whose strict mode takes no "3" for 3 and yet a list for a tuple
    text = json.dumps(raw, default=str)
    context = {"read": report.read, "quantity": host}
    try:
        return model.model_validate_json(text, strict=True, context=context)
    except ValidationError as error:
        for details in error.errors(include_url=False):
            if not any(_same_way(details["loc"], place) for place in refused):
                _translate(report, details, model, raw, table, beside, host)
    except ScenarioError as error:
        report.add_file(error, table, key_of_file(raw, error.file))
    return None


def _translate(
    report: Report,
    details: ErrorDetails,
    model: type[BaseModel],
    raw: object,
    table: str,
    beside: type[BaseModel] | None,
    host: Quantity | None,
) -> None:
    place, key = _where(details["loc"], raw, table)
    field = field_at(model, details["loc"])
    kind, value = details["type"], details["input"]
    expected = form(field, host) if field else None
    if kind != "missing" and isinstance(value, dict) and _meant_random(report, field, place, key):
        _add_no_distribution(report, f"{place}.{key}", value)
    elif kind == "value_error":
        _add_value_error(report, place, key, details["ctx"]["error"], value)
    elif kind == "extra_forbidden":
        known = model_at(model, details["loc"][:-1])
        here = list(known.model_fields) if known else []
        if beside and len(details["loc"]) == 1:
            here += beside.model_fields
        report.add(place, key, f"unknown key{report.names.hint(key, here)}")
    elif kind == "missing":
        report.add(place, key, "is missing", None, expected)
    elif kind == "literal_error" and isinstance(value, str):
        hint = report.names.near(value, choices(field))
        report.add(place, key, f"unknown choice{hint}", shown(value), expected)
    else:
        what = _WHAT.get(kind, "is out of range" if kind in _BOUNDS else "cannot be used")
        said = details["msg"].removeprefix("Input should be ")
        report.add(place, key, what, shown(value), expected or said[:1].lower() + said[1:])


def _meant_random(report: Report, field: FieldInfo | None, place: str, key: str) -> bool:
    """Tell whether a table in a field's place can only have been meant as a random input."""
    if field is None or not can_be_random(f"{place}.{key}"):
        return False
    within = any(f"{place}.".startswith(f"{name}.") for name in report.tried)
    return not within and (host_of(field) or joint_of(field)) is not None


def _add_no_distribution(report: Report, name: str, value: Mapping[str, object]) -> None:
    """Note a table in the place of a value that does not say which random input it is."""
    near = difflib.get_close_matches("distribution", value, n=1)
    if near:
        report.add(name, near[0], "unknown key (did you mean 'distribution'?)")
    else:
        report.add(name, "distribution", "is missing", None, "the name of a random input")


def _add_value_error(report: Report, table: str, key: str, error: Exception, value: object) -> None:
    if isinstance(error, QuantityError):
        report.add(table, key, error.what, error.got, error.expected)
    elif isinstance(error.__cause__, ScenarioError):
        report.add_file(error.__cause__, table, key)
    else:
        report.add(table, key, str(error), None if isinstance(value, dict) else shown(value))


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


def key_of_file(raw: Mapping[str, object], file: str) -> str:
    """Return the key of a table that names `file`, or nothing."""
    return next((key for key, value in raw.items() if value == file), "")


def _same_way(loc: Sequence[str | int], refused: Sequence[str | int]) -> bool:
    """Tell whether a mistake comes of a refused random input, which still stands in its place."""
    return bool(loc) and all(one == other for one, other in zip(loc, refused, strict=False))


def _where(loc: Sequence[str | int], raw: object, table: str) -> tuple[str, str]:
    """Return the table and the key that a location within a table's model means."""
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
