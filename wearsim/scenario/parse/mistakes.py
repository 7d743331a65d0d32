"""Validates a scenario table by table, and collects every mistake in wearsim's own words."""

from __future__ import annotations

import difflib
import json
from typing import TYPE_CHECKING, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from wearsim.errors import Problem, ScenarioError
from wearsim.plugins import Options
from wearsim.scenario.parse.field_wording import choices, field_at, form, model_at
from wearsim.scenario.random.model import can_be_random
from wearsim.scenario.random.placeholders import lift
from wearsim.scenario.random.targets import host_of, joint_of
from wearsim.units import QuantityError, shown

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from pydantic.fields import FieldInfo
    from pydantic_core import ErrorDetails

    from wearsim.quantities import Quantity
    from wearsim.scenario.parse.suggestions import Names
    from wearsim.scenario.random.model import RandomInput

M = TypeVar("M", bound=BaseModel)


class Table(Options):
    """Base of the scenario's own tables."""

    model_config = ConfigDict(allow_inf_nan=False)


class Report:
    """Everything that is wrong with one scenario, and the random inputs found on the way.

    Parameters
    ----------
    file : str
        The scenario's file, for messages.
    read : callable
        Returns the content of a file that the scenario names.
    names : Names
        The keys and tables there are, for suggestions.

    Attributes
    ----------
    random : list of RandomInput
        The random inputs.
    tried : set of str
        Dotted keys where a random input stands, be it right or wrong.
    means : dict of str to object
        What took the place of the random inputs, as written, by dotted key; None for nothing.
    """

    def __init__(self, file: str, read: Callable[[str], str], names: Names) -> None:
        self.file = file
        self.names = names
        self.problems: list[Problem] = []
        self.notes: list[str] = []
        self.random: list[RandomInput] = []
        self.tried: set[str] = set()
        self.means: dict[str, object] = {}
        self._read = read

    def add(
        self,
        table: str,
        key: str,
        what: str,
        got: str | None = None,
        expected: str | None = None,
    ) -> None:
        """Note one mistake."""
        self.problems.append(Problem(table, key, what, got, expected))

    def raise_any(self) -> None:
        """Raise a ScenarioError if there is any mistake."""
        if self.problems:
            raise ScenarioError(self.file, self.problems)

    def exactly_one(self, raw: Mapping[str, object], table: str, keys: tuple[str, ...]) -> None:
        """Note a mistake unless exactly one of `keys` is given."""
        given = [key for key in keys if key in raw]
        if len(given) != 1:
            got = " and ".join(given) or "none"
            self.add(table, " or ".join(keys), "exactly one is needed", got)

    def validate(
        self,
        model: type[M],
        raw: Mapping[str, object],
        table: str,
        beside: type[BaseModel] | None = None,
    ) -> M | None:
        """Return `raw` as an instance of `model`, or None after noting its mistakes.

        `beside` is the model of the keys that stand in the same table and were taken out.
        """
        raw, refused = lift(self, model, raw, table)
        return self._validate(model, raw, table, beside, refused=refused)

    def validate_options(
        self,
        model: type[M],
        raw: Mapping[str, object],
        table: str,
        host: Quantity | None = None,
        beside: type[BaseModel] | None = None,
    ) -> M | None:
        """Return a random input's options, as `validate`; `host` is what its values measure."""
        return self._validate(model, raw, table, beside, host)

    def _validate(
        self,
        model: type[M],
        raw: Mapping[str, object],
        table: str,
        beside: type[BaseModel] | None,
        host: Quantity | None = None,
        refused: Sequence[Sequence[str | int]] = (),
    ) -> M | None:
        # as JSON, whose strict mode takes no "3" for 3 and yet a list for a tuple
        text = json.dumps(raw, default=str)
        context = {"read": self._read, "quantity": host}
        try:
            return model.model_validate_json(text, strict=True, context=context)
        except ValidationError as error:
            for details in error.errors(include_url=False):
                if not any(_same_way(details["loc"], place) for place in refused):
                    self._translate(details, model, raw, table, beside, host)
        except ScenarioError as error:
            self.add_file(error, table, key_of_file(raw, error.file))
        return None

    def add_file(self, error: ScenarioError, table: str, key: str) -> None:
        """Note the mistakes of a file that the table's `key` names."""
        for problem in error.problems:
            what = f"{error.file} {problem}" if problem.key else f"{error.file}: {problem}"
            self.add(table, key, what)

    def _translate(
        self,
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
        if kind != "missing" and isinstance(value, dict) and self._meant_random(field, place, key):
            self._add_no_distribution(f"{place}.{key}", value)
        elif kind == "value_error":
            self._add_value_error(place, key, details["ctx"]["error"], value)
        elif kind == "extra_forbidden":
            known = model_at(model, details["loc"][:-1])
            here = list(known.model_fields) if known else []
            if beside and len(details["loc"]) == 1:
                here += beside.model_fields
            self.add(place, key, f"unknown key{self.names.hint(key, here)}")
        elif kind == "missing":
            self.add(place, key, "is missing", None, expected)
        elif kind == "literal_error" and isinstance(value, str):
            hint = self.names.near(value, choices(field))
            self.add(place, key, f"unknown choice{hint}", shown(value), expected)
        else:
            what = _WHAT.get(kind, "is out of range" if kind in _BOUNDS else "cannot be used")
            said = details["msg"].removeprefix("Input should be ")
            self.add(place, key, what, shown(value), expected or said[:1].lower() + said[1:])

    def _meant_random(self, field: FieldInfo | None, place: str, key: str) -> bool:
        """Tell whether a table in a field's place can only have been meant as a random input."""
        if field is None or not can_be_random(f"{place}.{key}"):
            return False
        within = any(f"{place}.".startswith(f"{name}.") for name in self.tried)
        return not within and (host_of(field) or joint_of(field)) is not None

    def _add_no_distribution(self, name: str, value: Mapping[str, object]) -> None:
        """Note a table in the place of a value that does not say which random input it is."""
        near = difflib.get_close_matches("distribution", value, n=1)
        if near:
            self.add(name, near[0], "unknown key (did you mean 'distribution'?)")
        else:
            self.add(name, "distribution", "is missing", None, "the name of a random input")

    def _add_value_error(self, table: str, key: str, error: Exception, value: object) -> None:
        if isinstance(error, QuantityError):
            self.add(table, key, error.what, error.got, error.expected)
        elif isinstance(error.__cause__, ScenarioError):
            self.add_file(error.__cause__, table, key)
        else:
            self.add(table, key, str(error), None if isinstance(value, dict) else shown(value))


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
