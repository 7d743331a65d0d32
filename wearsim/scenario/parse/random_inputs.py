"""Reading of random inputs: a table that may hold them, and the table of one of them."""

from __future__ import annotations

import difflib
import math
from collections.abc import Collection, Mapping
from itertools import count
from typing import Any, TypeAlias

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from wearsim.errors import ScenarioError, described
from wearsim.plugins import Distribution, JointDistribution, RandomInputSpec, Spec
from wearsim.plugins.checked_random import built_random_input
from wearsim.quantities import Quantity
from wearsim.scenario.parse.fields import (
    CONTACT_FIELDS,
    FRICTION,
    MISALIGNMENT,
    OF_A_CONTACT,
    OF_A_ROLLER,
    RANDOM_PLACES,
    WITH_MARGINAL,
    Persistence,
    RandomInput,
    RandomInputTable,
    RandomTarget,
    amount,
    can_be_random,
    form,
    in_words,
    model_at,
    target_of,
)
from wearsim.scenario.parse.mistakes import (
    M,
    Mistakes,
    installed,
    key_of_file,
    split_keys,
    validate_options,
)
from wearsim.units import QuantityError, as_written

Loc: TypeAlias = tuple[str | int, ...]

_ONE_RANDOM = 'one random input for all rollers, with persistence = "per-roller" to differ'
_NOT_RANDOM = f"a value; only {RANDOM_PLACES} can be random"


def validate(
    mistakes: Mistakes,
    model: type[M],
    raw: Mapping[str, object],
    table: str,
    other_keys: type[BaseModel] | None = None,
) -> M | None:
    """Return a table, which may have random inputs, as a model, or None after adding mistakes.

    The random inputs are added to `mistakes.random`, and the model has their means. The parameters
    as of `validate_options`.
    """
    values, refused = _with_means(mistakes, model, raw, table)
    return validate_options(mistakes, model, values, table, other_keys, refused=refused)


def choose(
    mistakes: Mistakes,
    model: type[BaseModel],
    key: str,
    kind: type[Spec],
    raw: Mapping[str, object],
    place: str,
) -> tuple[Any, Any, dict[str, object]]:
    """Return the own keys of a table, the plugin that one of them names, and the other keys.

    Own keys and plugin are None after adding their mistakes; the other keys are not validated.
    """
    keys, rest = split_keys(raw, model)
    name = keys.get(key, model.model_fields[key].default)
    values = validate(mistakes, model, keys, place)
    spec = mistakes.find_plugin(kind, name, place, key) if isinstance(name, str) else None
    return values, spec, rest


def _with_means(
    mistakes: Mistakes, model: type[BaseModel], raw: Mapping[str, object], table: str, loc: Loc = ()
) -> tuple[dict[str, object], list[Loc]]:
    """Return a table with means instead of random inputs, and the locations of mistakes."""
    values, refused = dict(raw), list[Loc]()
    for key, value in raw.items():
        field, inner, here = model.model_fields.get(key), model_at(model, (key,)), (*loc, key)
        if field is None:
            continue  # an unknown key, which the validation reports
        if isinstance(value, dict) and inner and not _is_random(value, inner):
            values[key], within = _with_means(mistakes, inner, value, f"{table}.{key}", here)
            refused += within
        elif isinstance(value, dict) and ("distribution" in value or target_of(field)):
            means = _means(mistakes, field, raw, table, key)
            kept = {name: item for name, item in values.items() if name != key or not means}
            values = {**kept, **means}
            refused += [] if means else [here]
        elif isinstance(value, list):
            for entry, item in enumerate(value):
                if isinstance(item, dict) and _is_random(item, inner):
                    expected = _ONE_RANDOM if f"{table}.{key}" in OF_A_ROLLER else _NOT_RANDOM
                    mistakes.add(
                        table, f"{key} (entry {entry + 1})", "cannot be random", "a table", expected
                    )
                    refused.append((*here, entry))
    return values, refused


def _is_random(table: Mapping[str, object], model: type[BaseModel] | None) -> bool:
    """Return whether a table is a random input, and not a table of its field's model."""
    return "distribution" in table and not (model and "distribution" in model.model_fields)


def _means(
    mistakes: Mistakes, field: FieldInfo, raw: Mapping[str, Any], table: str, key: str
) -> dict[str, object]:
    """Add a random input, and return the means of the keys that it sets; none after mistakes."""
    name, target, value = f"{table}.{key}" if table else key, target_of(field), raw[key]
    if "distribution" not in value:
        _refuse_table(mistakes, field, value, table, key)
        return {}
    mistakes.random[name] = None
    if target is None or not can_be_random(name):
        mistakes.add(table, key, "cannot be random", "a table with a distribution", _NOT_RANDOM)
        return {}
    item = read_random_input(mistakes, value, name, target)
    rivals = [other for other in target.components if other in raw]
    for other in rivals:
        mistakes.add(
            table, other, f"is set by {key} already", as_written(raw[other]), "one of the two"
        )
    if item is None or rivals or not _fits(mistakes, item, target, table, key):
        return {}
    mistakes.random[name] = item
    return {
        part: {"si": float(mean)} if item.quantity else float(mean)
        for part, mean in zip(target.components or (key,), item.mean, strict=True)
    }


def _refuse_table(
    mistakes: Mistakes, field: FieldInfo, raw: Mapping[str, object], table: str, key: str
) -> None:
    """Add the mistake of a table without distribution instead of a number."""
    name, target = f"{table}.{key}", target_of(field)
    near = difflib.get_close_matches("distribution", raw, n=1)
    if not can_be_random(name):
        kind = "quantity" if target and target.quantity else "number"
        mistakes.add(table, key, f"is not a {kind}", "a table", form(field))
    elif near:
        mistakes.add(name, near[0], "unknown key (did you mean 'distribution'?)")
    else:
        mistakes.add(name, "distribution", "is missing", None, "the name of a random input")


def _fits(
    mistakes: Mistakes, item: RandomInput, target: RandomTarget, table: str, key: str
) -> bool:
    """Check the support and the mean of a random input against what its field allows."""
    if target.components:
        return True
    (low, high), (least, most), limits = item.scalar.support, item.extremes, target.limits
    allowed, what = in_words(limits), None
    if low < target.range[0] or least <= limits.get("gt", -math.inf):
        what = f"takes values down to {amount(low, target.quantity)}, and must be {allowed}"
    elif high > target.range[1] or most >= limits.get("lt", math.inf):
        what = f"takes values up to {amount(high, target.quantity)}, and must be {allowed}"
    elif not math.isfinite(item.mean[0]):
        mistakes.add(table, key, "has no finite mean", item.describe())
        return False
    if what and low == high:
        mistakes.add(
            table, key, f"must be {allowed}", amount(low, target.quantity), f"a value {allowed}"
        )
    elif what:
        mistakes.add(
            table,
            key,
            what,
            item.describe(),
            f"maxent with support {target.support} or truncated-normal",
        )
    return what is None


def read_random_input(
    mistakes: Mistakes, raw: Mapping[str, Any], name: str, target: RandomTarget
) -> RandomInput | None:
    """Return the random input that a table holds, or None after adding its mistakes.

    Parameters
    ----------
    mistakes : Mistakes
        Collects the mistakes.
    raw : mapping of str to object
        The table.
    name : str
        Dotted key of the value that it replaces.
    target : RandomTarget
        The number, or the numbers, that it sets.
    """
    before, kind = len(mistakes.entries), raw["distribution"]
    keys, options = split_keys(raw, RandomInputTable)
    table = validate_options(mistakes, RandomInputTable, keys, name)
    named = isinstance(kind, str)
    spec = mistakes.find_plugin(RandomInputSpec, kind, name, "distribution") if named else None
    if spec is None or not _check_role(mistakes, spec, name, target):
        return None
    if table:
        _check_persistence(mistakes, spec, table.persistence, name)
    marginal = None
    if spec.role in WITH_MARGINAL:
        marginal = _read_marginal(mistakes, raw.get("marginal"), name, target.quantity)
    elif "marginal" in raw:
        mistakes.add(
            name, "marginal", f"is only for a field or a process; '{spec.name}' is neither"
        )
    distribution = _build(mistakes, spec, options, name, target.quantity, marginal)
    sets = distribution.components if isinstance(distribution, JointDistribution) else ()
    if sets and sorted(sets) != sorted(target.components):
        mistakes.add(
            name,
            "distribution",
            f"sets {' and '.join(sets)}",
            as_written(kind),
            f"a distribution of {' and '.join(target.components)}",
        )
    if len(mistakes.entries) > before or table is None:
        return None
    return RandomInput(
        name=name,
        kind=kind,
        persistence=table.persistence,
        distribution=distribution,
        quantity=target.quantity,
        options=options,
        marginal=str(table.marginal["distribution"]) if table.marginal else "",
    )


def _check_role(mistakes: Mistakes, spec: RandomInputSpec, name: str, target: RandomTarget) -> bool:
    """Check that the role of the distribution is possible for this value."""
    roles = [
        "joint" if target.components else "scalar",
        *(["process"] if name in CONTACT_FIELDS else []),
        *(["field"] if name == FRICTION else []),
    ]
    if spec.role in roles:
        return True
    what = {
        "joint": f"sets several values together, which only {MISALIGNMENT} can",
        "field": f"varies within the contact, which only {FRICTION} can",
        "process": f"varies in time, which only {', '.join(CONTACT_FIELDS)} can",
    }.get(spec.role, "")
    if target.components:
        what = f"sets one value, but {name} sets {' and '.join(target.components)}"
    mistakes.add(name, "distribution", what, as_written(spec.name), _one_of(roles))
    return False


def _one_of(roles: Collection[str]) -> str:
    """Return the names of the distributions with these roles, for messages."""
    names = [as_written(spec.name) for spec in installed(RandomInputSpec) if spec.role in roles]
    return f"one of {', '.join(names)}"


def _check_persistence(
    mistakes: Mistakes, spec: RandomInputSpec, persistence: Persistence, name: str
) -> None:
    redrawn = persistence in {"per-pass", "per-turn"}
    places = OF_A_CONTACT if redrawn else OF_A_ROLLER if persistence == "per-roller" else None
    what = f"is only for {', '.join(places)}" if places and name not in places else None
    if redrawn and spec.role == "process":
        what = "is not for a process, which runs through the whole test"
    if what:
        mistakes.add(
            name,
            "persistence",
            what,
            as_written(persistence),
            ('"per-test" or "per-roller"' if name in OF_A_ROLLER else '"per-test"'),
        )


def _read_marginal(
    mistakes: Mistakes, raw: object, name: str, quantity: Quantity | None
) -> Distribution | None:
    """Return the marginal distribution of a field or a process."""
    if raw is None:
        mistakes.add(
            name, "marginal", "is missing", None, "a table with a distribution and its options"
        )
    if not isinstance(raw, dict):
        return None
    return _read_scalar(mistakes, raw, f"{name}.marginal", name, "marginal", quantity)


def _read_scalar(
    mistakes: Mistakes,
    raw: Mapping[str, object],
    place: str,
    name: str,
    what: str,
    quantity: Quantity | None,
) -> Distribution | None:
    """Return the distribution of one number that is part of a random input.

    Parameters
    ----------
    mistakes : Mistakes
        Collects the mistakes.
    raw : mapping of str to object
        Table with a distribution and its options.
    place : str
        Its name in messages.
    name : str
        Dotted key of the random input.
    what : str
        What the distribution is, "marginal".
    quantity : Quantity, optional
        Of the number.
    """
    expected = _one_of({"scalar"})
    keys, options = split_keys(raw, RandomInputTable)
    kind = keys.pop("distribution", None)
    for key in sorted(keys):
        mistakes.add(place, key, f"belongs in [{name}], not in its {what}", as_written(keys[key]))
    spec = None
    if kind is None:
        mistakes.add(place, "distribution", "is missing", None, expected)
    elif not isinstance(kind, str):
        mistakes.add(place, "distribution", "is not text", as_written(kind), expected)
    else:
        spec = mistakes.find_plugin(RandomInputSpec, kind, place, "distribution")
    if spec and spec.role != "scalar":
        mistakes.add(
            place,
            "distribution",
            f"is a {spec.role}, but a {what} is the distribution of one number",
            as_written(kind),
            expected,
        )
        return None
    built: Distribution | None = _build(mistakes, spec, options, place, quantity) if spec else None
    return built


def _build(
    mistakes: Mistakes,
    spec: RandomInputSpec,
    raw: Mapping[str, object],
    place: str,
    quantity: Quantity | None,
    marginal: Distribution | None = None,
) -> Any:
    """Build a distribution, or add the mistakes of its options and return None."""
    before, number = len(mistakes.entries), count(1)

    def component(table: dict[str, object]) -> Any:
        return _read_scalar(
            mistakes, table, f"{place}.of (entry {next(number)})", place, "component", quantity
        )

    options = validate_options(
        mistakes, spec.options, raw, place, RandomInputTable, quantity, component=component
    )
    within = len(mistakes.entries) > before  # mistakes of a component
    if within or options is None or (spec.role in WITH_MARGINAL and marginal is None):
        return None
    try:
        return built_random_input(spec, options, marginal)
    except ScenarioError as error:
        mistakes.add_file(error, place, key_of_file(raw, error.file))
    except QuantityError as error:
        mistakes.add(place, "", error.what, error.got, error.expected)
    except ValueError as error:
        mistakes.add(place, "", described(error))
    return None
