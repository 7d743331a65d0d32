"""Takes the random inputs out of a table and leaves their means, which any model can read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from wearsim.scenario.parse.field_wording import field_at, model_at
from wearsim.scenario.random.model import (
    OF_A_ROLLER,
    RANDOM_PLACES,
    RandomInput,
    amount,
    can_be_random,
)
from wearsim.scenario.random.parse import read_random_input
from wearsim.scenario.random.targets import (
    JointTarget,
    RandomTarget,
    joint_target_of,
    random_target_of,
)
from wearsim.units import shown

if TYPE_CHECKING:
    from pydantic import BaseModel

    from wearsim.scenario.parse.mistakes import Mistakes

Loc = tuple[str | int, ...]


def lift(
    mistakes: Mistakes, model: type[BaseModel], raw: Mapping[str, object], table: str
) -> tuple[Mapping[str, object], list[Loc]]:
    """Return a table with means in the place of random inputs, and where these have mistakes.

    Parameters
    ----------
    mistakes : Mistakes
        Collects the random inputs, and their mistakes.
    model : type of BaseModel
        What the table is about to be validated by.
    raw : mapping of str to object
        The table; it is left as it is.
    table : str
        Its name.
    """
    refused: list[Loc] = []
    lifted = raw
    for loc in _places(model, raw):
        inner = [part for part in loc[:-1] if isinstance(part, str)]
        holder: Any = raw
        for part in loc[:-1]:
            holder = holder[part]
        means = _means(mistakes, model, holder, ".".join(filter(None, [table, *inner])), loc)
        if means is None:
            refused.append(loc)
            continue
        for key, value in means.items():
            lifted = put(lifted, [*inner, key], value)
            mistakes.means[".".join([table, *inner, key])] = value
    return lifted, refused


def put(table: Mapping[str, object], path: list[str], value: object) -> dict[str, object]:
    """Return a copy of nested tables with one value replaced, or taken out where it is None."""
    copy, key = dict(table), path[0]
    inner = copy.get(key)
    if len(path) > 1:
        copy[key] = put(inner if isinstance(inner, dict) else {}, path[1:], value)
    elif value is None:
        copy.pop(key, None)
    else:
        copy[key] = value
    return copy


def put_all(tables: Mapping[str, object], values: Mapping[str, object]) -> Mapping[str, object]:
    """Return nested tables with values by dotted key replaced, or taken out where None."""
    for key, value in values.items():
        tables = put(tables, key.split("."), value)
    return tables


def _places(model: type[BaseModel], raw: object, loc: Loc = ()) -> Iterator[Loc]:
    """Find the tables that stand for a value: those with a `distribution` that no model asks for.

    Unknown keys are passed over, since they will be told as such.
    """
    items: Any = ()
    if isinstance(raw, dict):
        items = raw.items()
    elif isinstance(raw, list):
        items = enumerate(raw)
    for key, value in items:
        if not isinstance(value, dict | list):
            continue
        here = (*loc, key)
        if isinstance(value, dict) and "distribution" in value:
            inner = model_at(model, here)
            if inner is None or "distribution" not in inner.model_fields:
                if field_at(model, here):
                    yield here
                continue
        yield from _places(model, value, here)


def _means(
    mistakes: Mistakes, model: type[BaseModel], holder: Any, table: str, loc: Loc
) -> dict[str, object] | None:
    """Note a random input and return what takes its place; None after noting its mistakes."""
    field, key = field_at(model, loc), loc[-1]
    if isinstance(key, int):
        _refuse_entry(mistakes, table, key)
        return None
    name = f"{table}.{key}" if table else key
    mistakes.random_keys.add(name)
    joint, target = (joint_target_of(field), random_target_of(field)) if field else (None, None)
    if not can_be_random(name) or (joint is None and target is None):
        expected = f"a value; only {RANDOM_PLACES} can be random"
        mistakes.add(table, key, "cannot be random", "a table with a distribution", expected)
        return None
    mark = joint or target
    item = read_random_input(holder[key], name, mark.quantity if mark else None, joint, mistakes)
    if joint and not _alone(mistakes, joint, holder, table, key):
        return None
    if item is None or (target and not _fits(mistakes, item, target, table, key)):
        return None
    mistakes.random.append(item)
    written = target.written if target else item.quantity.write if item.quantity else float
    pairs = zip(item.keys, item.mean, strict=True)
    means = {path.rsplit(".", 1)[-1]: written(mean) for path, mean in pairs}
    return means if target else {key: None, **means}


def _refuse_entry(mistakes: Mistakes, place: str, entry: int) -> None:
    table, _, key = place.rpartition(".")
    expected = f"a value; only {RANDOM_PLACES} can be random"
    if place in OF_A_ROLLER:
        expected = 'one random input for all rollers, with persistence = "per-roller" to differ'
    mistakes.add(table, f"{key} (entry {entry + 1})", "cannot be random", "a table", expected)


def _alone(
    mistakes: Mistakes, joint: JointTarget, holder: Mapping[str, object], table: str, key: str
) -> bool:
    """Check that none of the values that a joint input sets is given besides."""
    rivals = [rival for rival in joint.components if rival in holder]
    for rival in rivals:
        what = f"is set by {key} already"
        mistakes.add(table, rival, what, shown(holder[rival]), "one of the two")
    return not rivals


def _fits(
    mistakes: Mistakes, item: RandomInput, target: RandomTarget, table: str, key: str
) -> bool:
    """Check the support and the mean of a random input against what its field allows."""
    (low, high), (least, most) = item.scalar.support, item.extremes
    reach = None
    if low < target.low or (target.above and least <= target.low):
        reach = f"down to {amount(low, target.quantity)}"
    elif high > target.high or (target.below and most >= target.high):
        reach = f"up to {amount(high, target.quantity)}"
    if reach:
        what = f"takes values {reach}, and must be {target.allowed}"
        remedy = f"maxent with support {target.support} or truncated-normal"
        if low == high:
            what, remedy = f"must be {target.allowed}", f"a value {target.allowed}"
        got = amount(low, target.quantity) if low == high else item.describe()
        mistakes.add(table, key, what, got, remedy)
        return False
    if item.mean[0] - item.mean[0] != 0.0:  # infinite or not a number
        mistakes.add(table, key, "has no finite mean", item.describe())
        return False
    return True
