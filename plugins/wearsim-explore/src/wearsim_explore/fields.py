"""Fields of a page: the keys of a scenario with their values, units and ranges, by its schema."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

Path: TypeAlias = tuple[str | int, ...]
Kind: TypeAlias = Literal["number", "integer", "quantity", "choice", "flag", "file", "text"]

_NUMBER = re.compile(r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)\s*(.*?)\s*$")
_UNIT = re.compile(r"(?:[A-Za-zµμ°]|1 ?/)[\w^*/().°µμ -]{0,30}")
_SPAN = 4.0  # the slider of a value reaches from a quarter of it to four times
_STEPS = 200  # steps of a slider
_OF_CAMS = ("cam", "follower", "lubricant")
_FILE = "load.csv"  # the example that the schema gives for a file


@dataclass(frozen=True)
class Slider:
    """Range of a slider, in the unit of its field.

    Parameters
    ----------
    low, high : float
    log : bool
        Whether equal distances are equal ratios.
    step : float
        Distance of whole numbers; 0 for numbers.
    """

    low: float
    high: float
    log: bool = False
    step: float = 0.0


@dataclass(frozen=True)
class Field:
    """A key of a scenario.

    Parameters
    ----------
    key : str
        Dotted key; a number leads into a list, "cam.motion.1.rise".
    kind : {"number", "integer", "quantity", "choice", "flag", "file", "text"}
    description : str
    value : str or None
        As written, without the unit of a quantity; None for a key that the scenario lacks.
    unit : str
        Unit of a quantity.
    default : str
        Value that is used where the key is missing.
    choices : tuple of str
    slider : Slider, optional
    """

    key: str
    kind: Kind
    description: str
    value: str | None
    unit: str = ""
    default: str = ""
    choices: tuple[str, ...] = ()
    slider: Slider | None = None

    @property
    def table(self) -> str:
        """The table of the scenario, empty for a key above all tables."""
        return self.key.partition(".")[0] if "." in self.key else ""

    @property
    def label(self) -> str:
        """The key within its table, in words; parts of a list are counted from 1."""
        parts = self.key.split(".")[1:] or [self.key]
        words = [str(int(part) + 1) if part.isdigit() else part for part in parts]
        return " ".join(words).replace("_", " ")

    def written(self, text: str) -> object:
        """Return a value as it is written in a scenario.

        Parameters
        ----------
        text : str
            What was typed; a quantity without a unit has that of the field.
        """
        text = text.strip()
        number = _NUMBER.match(text)
        if self.kind == "flag":
            return text == "true"
        if self.kind == "quantity":
            bare = number is not None and not number[2]
            return f"{text} {self.unit}" if bare and self.unit else text
        if self.kind in {"number", "integer"} and number is not None and not number[2]:
            return float(text) if re.search("[.eE]", text) else int(text)
        return text


def fields_of(schema: Mapping[str, Any], tables: Mapping[str, Any]) -> list[Field]:
    """Return the fields of a scenario, in the order of its schema.

    Parameters
    ----------
    schema : mapping
        JSON Schema of scenarios.
    tables : mapping of str to object
        The scenario, as TOML holds it.
    """
    absent = {"cylinder"} if "cam" in tables else {*_OF_CAMS} - {*tables}
    definitions = schema["$defs"]
    return [
        field
        for name, part in schema["properties"].items()
        if name in tables or name not in absent
        for field in _walk(definitions, (name,), part, tables.get(name))
    ]


def _walk(
    definitions: Mapping[str, Any], path: Path, part: Mapping[str, Any], value: Any
) -> Iterator[Field]:
    part = _resolved(definitions, part)
    if "anyOf" in part:
        chosen, discriminator, names = _alternative(definitions, part["anyOf"], value)
        if discriminator:
            choice = value.get(discriminator) if isinstance(value, dict) else None
            default = str(chosen["properties"][discriminator].get("default", ""))
            description = chosen["properties"][discriminator].get("description", "")
            key = _dotted((*path, discriminator))
            yield Field(key, "choice", description, choice, default=default, choices=tuple(names))
        part = {**{k: v for k, v in part.items() if k != "anyOf"}, **chosen}
        if "description" in chosen and "properties" not in chosen:
            part["description"] = chosen["description"]
        elif chosen_description := part.get("description"):
            part["description"] = chosen_description
    if "properties" in part:
        if value is None and len(path) > 1:
            return  # a table within a table that the scenario lacks
        inner = value if isinstance(value, dict) else {}
        for name, item in part["properties"].items():
            if "const" not in item:
                yield from _walk(definitions, (*path, name), item, inner.get(name))
    elif part.get("type") == "array":
        if isinstance(value, list) and "items" in part:
            for place, item in enumerate(value):
                yield from _walk(definitions, (*path, place), part["items"], item)
    elif not isinstance(value, dict | list):
        yield _leaf(path, part, value)


def _resolved(definitions: Mapping[str, Any], part: Mapping[str, Any]) -> dict[str, Any]:
    """Return a part of the schema with its reference resolved; its own keys take precedence."""
    if "$ref" not in part:
        return dict(part)
    named = definitions[part["$ref"].rpartition("/")[2]]
    return {**_resolved(definitions, named), **{k: v for k, v in part.items() if k != "$ref"}}


def _alternative(
    definitions: Mapping[str, Any], parts: Sequence[Mapping[str, Any]], value: Any
) -> tuple[dict[str, Any], str, list[str]]:
    """Return the alternative that a value has, the key that chooses it, and all choices."""
    options = [option for part in parts for option in _options(definitions, part)]
    tables = [option for option in options if "properties" in option]
    pairs = ((_name(option), option) for option in tables)
    named = {name: option for name, option in pairs if name is not None}
    if isinstance(value, dict) or len(tables) == len(options):
        keys = {key for key, _ in named}
        discriminator = next(iter(keys)) if keys else ""
        choice = value.get(discriminator) if isinstance(value, dict) else None
        chosen = named.get((discriminator, str(choice))) or next(
            (table for table in tables if _is_default(table, discriminator)), tables[0]
        )
        return chosen, discriminator, [name for _, name in named]
    if isinstance(value, list):
        arrays = (option for option in options if option.get("type") == "array")
        return next(arrays, options[0]), "", []
    return next(option for option in options if "properties" not in option), "", []


def _options(definitions: Mapping[str, Any], part: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return an alternative, or all alternatives within it."""
    resolved = _resolved(definitions, part)
    nested = resolved.get("anyOf", ())
    return [option for inner in nested for option in _options(definitions, inner)] or [resolved]


def _name(option: Mapping[str, Any]) -> tuple[str, str] | None:
    """Return the key with a constant value, which names an alternative, and that value."""
    constants = (
        (key, item["const"]) for key, item in option["properties"].items() if "const" in item
    )
    return next(constants, None)


def _is_default(option: Mapping[str, Any], discriminator: str) -> bool:
    return bool(option["properties"].get(discriminator, {}).get("default"))


def _dotted(path: Path) -> str:
    return ".".join(map(str, path))


def _leaf(path: Path, part: Mapping[str, Any], value: Any) -> Field:
    """Return the field of a value that is no table and no list."""
    kinds = part.get("type", ())
    types = {kinds} if isinstance(kinds, str) else {*kinds}
    description, default = part.get("description", ""), part.get("default")
    key, written = _dotted(path), None if value is None else _plain(value)
    shown = "" if default is None else _plain(default)
    if "enum" in part:
        choices = tuple(map(str, part["enum"]))
        return Field(key, "choice", description, written, default=shown, choices=choices)
    if "boolean" in types:
        return Field(key, "flag", description, written, default=shown, choices=("true", "false"))
    examples = [str(example) for example in part.get("examples", ())]
    number, example = _NUMBER.match(written or ""), _NUMBER.match(examples[0] if examples else "")
    of_table = len(path) > 1 and _FILE not in examples
    has_unit = isinstance(value, str) and number is not None and bool(_UNIT.fullmatch(number[2]))
    if "pattern" in part or (has_unit and of_table):
        unit = number[2] if number else (example[2] if example else "")
        present = float(number[1]) if number else None
        # a pattern that negative numbers do not match excludes them
        signed = re.match(part.get("pattern", ""), f"-1 {unit}") is not None
        slider = slider_of(part, present, float(example[1]) if example else 1.0, signed=signed)
        text = number[1] if number else written
        return Field(key, "quantity", description, text, unit, shown, slider=slider)
    if types & {"number", "integer"} or (isinstance(value, int | float) and "const" in part):
        whole = types == {"integer"}
        known = value if isinstance(value, int | float) else default
        present = float(known) if isinstance(known, int | float) else None
        slider = slider_of(part, present, 1.0, whole=whole)
        kind: Kind = "integer" if whole else "number"
        return Field(key, kind, description, written, default=shown, slider=slider)
    kind = "file" if _FILE in examples else "text"
    return Field(key, kind, description, written, default=shown)


def _plain(value: Any) -> str:
    """Return a value as text; a number with the fewest digits that give it."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.15g}" if isinstance(value, float) else str(value)


def slider_of(
    part: Mapping[str, Any],
    value: float | None,
    typical: float,
    *,
    signed: bool = True,
    whole: bool = False,
) -> Slider:
    """Return the slider of a number: logarithmic where all of its values are above zero.

    Parameters
    ----------
    part : mapping
        Schema of the number, with its bounds.
    value : float, optional
        The value in the scenario, around which the slider lies.
    typical : float
        A usual value.
    signed : bool
        Whether it may be negative.
    whole : bool
        Whether only whole numbers are allowed.
    """
    centre = typical if value is None else value
    size = abs(centre) or abs(typical)
    if centre > 0.0:
        low, high = size / _SPAN, size * _SPAN
    else:
        low, high = (-_SPAN * size if signed else 0.0), (_SPAN * size if centre == 0.0 else 0.0)
    least, above = part.get("minimum"), part.get("exclusiveMinimum", part.get("gt"))
    if least is not None:
        low = max(low, float(least))
    if above is not None and low <= above:
        low = above + (centre - above) / _SPAN if centre > above else float(above)
    most, below = part.get("maximum"), part.get("exclusiveMaximum", part.get("lt"))
    for end in (most, below):
        high = high if end is None else min(high, float(end))
    step = float(part.get("multipleOf", 1)) if whole else 0.0
    if whole:
        low, high = (
            (max(1.0, low // step) if low > 0.0 else low // step) * step,
            -(-high // step) * step,
        )
    return Slider(low, high, log=low > 0.0 and high > 3.0 * low, step=step)
