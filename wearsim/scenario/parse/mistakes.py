"""Validation of the tables of a scenario, and collection of all their mistakes."""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from wearsim.errors import Mistake, PluginError, ScenarioError
from wearsim.plugins import Spec, TableSpec, registry
from wearsim.quantities import DECIMAL_COMMA, NUMBER, Quantity
from wearsim.scenario.parse.fields import RandomInput, choices, field_at, form, model_at
from wearsim.units import QuantityError, as_written

M = TypeVar("M", bound=BaseModel)
S = TypeVar("S", bound=Spec)

_NUMBER_IN_TEXT = re.compile(rf"(?:{NUMBER.pattern}) ?%?")
_ALIKE = 0.75  # similarity of a key to those of other tables, from which it is suggested
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


@dataclass
class Mistakes:
    """Collector of the mistakes, notes and random inputs of one scenario.

    Parameters
    ----------
    file : str
        The scenario's file, for messages.
    read : callable
        Returns the content of a file that the scenario names.
    find_keys : callable
        Returns the keys of each table by the table's name in messages, "[load]"; called when the
        first suggestion is needed.

    Attributes
    ----------
    entries : list of Mistake
        The mistakes, in the order in which they were found.
    notes : list of str
        Notes on the choices made for the user.
    random : dict of str to RandomInput or None
        The random inputs by dotted key; None for one with mistakes.
    """

    file: str
    read: Callable[[str], str]
    find_keys: Callable[[], Mapping[str, Collection[str]]] = dict
    entries: list[Mistake] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    random: dict[str, RandomInput | None] = field(default_factory=dict)

    @property
    def random_inputs(self) -> list[RandomInput]:
        """The random inputs without mistakes, in the order of their names."""
        return [item for _, item in sorted(self.random.items()) if item]

    @cached_property
    def _keys(self) -> Mapping[str, Collection[str]]:
        return self.find_keys()

    def add(
        self,
        table: str,
        key: str,
        what: str,
        got: str | None = None,
        expected: str | None = None,
    ) -> None:
        """Add one mistake; the parameters are the fields of `Mistake`."""
        self.entries.append(Mistake(table, key, what, got, expected))

    def add_file(self, error: ScenarioError, table: str, key: str) -> None:
        """Add the mistakes of a file that the table's `key` names."""
        for mistake in error.mistakes:
            self.add(table, key, f"{error.file}{'' if mistake.key else ':'} {mistake}")

    def raise_any(self) -> None:
        """Raise a ScenarioError if there is any mistake."""
        if self.entries:
            raise ScenarioError(self.file, self.entries)

    def find_plugin(self, kind: type[S], name: str, table: str, key: str) -> S | None:
        """Return the plugin that a table's `key` names, or None after adding a mistake."""
        try:
            return registry().get(kind, name)
        except PluginError as error:
            self.add(table, key, str(error))
            return None

    def hint(self, key: str, here: Collection[str]) -> str:
        """Return a hint in parentheses for an unknown key of a table with the keys `here`."""
        if places := self._places(key):
            return f" (it belongs in {places})"
        if near := nearest(key, here):
            return near
        everywhere = {name for keys in self._keys.values() for name in keys}
        for name in difflib.get_close_matches(key, everywhere, n=1, cutoff=_ALIKE):
            return f" (did you mean '{name}' of {self._places(name)}?)"
        return f" (known here: {', '.join(sorted(here))})" if here else ""

    def _places(self, key: str) -> str:
        """Return the tables that have a key, in words."""
        return " or ".join(place for place, keys in self._keys.items() if key in keys)


def installed(kind: type[S]) -> list[S]:
    """Return the plugins of a kind, in the order of their names."""
    return [registry().get(kind, name) for name in registry().names(kind)]


def refuse_tables(mistakes: Mistakes, names: Collection[str]) -> None:
    """Add a mistake for each table that a plugin owns and that has the name of one of wearsim."""
    for name in sorted(names):
        item = registry().registered(TableSpec, name)
        mistakes.add(
            name,
            "",
            f"is a table of wearsim, and one of the plugin {item.distribution} {item.version}",
            None,
            "another name of the plugin's table; until then, uninstall the plugin",
        )


def nearest(name: str, known: Collection[str]) -> str:
    """Return the most similar of the `known` names as a hint in parentheses, or nothing."""
    longer = [other for other in known if name in other.split("_")]  # "force" of "normal_force"
    similar = difflib.get_close_matches(name, known, n=1) or (longer if len(longer) == 1 else [])
    return f" (did you mean '{similar[0]}'?)" if similar else ""


def validate_options(
    mistakes: Mistakes,
    model: type[M],
    raw: Mapping[str, object],
    table: str,
    other_keys: type[BaseModel] | None = None,
    quantity: Quantity | None = None,
    refused: Sequence[tuple[str | int, ...]] | None = None,
    component: Callable[[dict[str, object]], object] | None = None,
) -> M | None:
    """Return `raw` as an instance of `model`, or None after adding its mistakes.

    Parameters
    ----------
    mistakes : Mistakes
        Collects the mistakes.
    model : type of BaseModel
        The model of the table.
    raw : mapping of str to object
        The table.
    table : str
        Its name.
    other_keys : type of BaseModel, optional
        Model of the other keys of the same table, which `raw` lacks; for suggestions.
    quantity : Quantity, optional
        Quantity of the values, for the options of a random input.
    refused : sequence of locations, optional
        Locations whose mistakes have been added already; for a table that had random inputs, whose
        means are there as ``{"si": 3.0}`` or as plain numbers.
    component : callable, optional
        Returns the distribution of a table within the options of another distribution, in their
        order, or None after adding its mistakes.
    """
    shared = set(model.model_fields).intersection(other_keys.model_fields if other_keys else ())
    for key in sorted(shared):
        mistakes.add(
            table,
            key,
            "is a key of wearsim and an option of the plugin, which never gets a value",
            None,
            "another name of the option, in the plugin",
        )
    if shared:
        return None
    # as JSON: its strict mode rejects "3" for 3 but accepts a list for a tuple
    context = {
        "read": mistakes.read,
        "quantity": quantity,
        "numbers": None if refused is None else dict,
        "component": component,
    }
    try:
        return model.model_validate_json(json.dumps(raw, default=str), strict=True, context=context)
    except ValidationError as error:
        for details in error.errors(include_url=False):
            # a refused random input is still in the table, and fails again at or below its location
            if not any(details["loc"][: len(place)] == place for place in refused or ()):
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
        Numbers in SI by key; a mapping has the numbers of a model within it.
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
    return {
        **{key: getattr(model, key) for key in model.model_fields_set},
        **{
            key: _with_numbers(getattr(model, key), value) if isinstance(value, dict) else value
            for key, value in values.items()
        },
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
        mistakes.add(place, key, str(error), None if isinstance(value, dict) else as_written(value))
    elif kind == "extra_forbidden":
        known = model_at(model, loc[:-1])
        here = [
            *(known.model_fields if known else ()),
            *(other_keys.model_fields if other_keys and len(loc) == 1 else ()),
        ]
        mistakes.add(place, key, f"unknown key{mistakes.hint(key, here)}")
    elif kind == "missing":
        if field and field.description and expected == "a table":
            expected += f": {field.description}"
        mistakes.add(place, key, "is missing", None, expected)
    else:
        what = _WHAT.get(kind, "is out of range" if kind in _BOUNDS else "cannot be used")
        if kind == "literal_error" and isinstance(value, str) and field:
            what += nearest(value, choices(field))
        if isinstance(value, str) and DECIMAL_COMMA.fullmatch(value):
            what = "needs a decimal point"
        elif isinstance(value, str) and _NUMBER_IN_TEXT.fullmatch(value) and "number" in what:
            what = "needs a number without quotes" + (" and %" if value.endswith("%") else "")
        message = details["msg"].removeprefix("Input should be ")
        expected = expected or message[:1].lower() + message[1:]
        mistakes.add(place, key, what, as_written(value), expected)


def key_of_file(raw: Mapping[str, object], file: str) -> str:
    """Return the key of a table or of its options that names `file` or has read it, or nothing."""
    return next((key for key, value in raw.items() if getattr(value, "path", value) == file), "")


def split_keys(
    raw: Mapping[str, object], model: type[BaseModel]
) -> tuple[dict[str, object], dict[str, object]]:
    """Split a table into the keys of `model` and all others."""
    known = {key: value for key, value in raw.items() if key in model.model_fields}
    return known, {key: value for key, value in raw.items() if key not in known}
