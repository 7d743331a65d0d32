"""Parsing of the table of one random input: distribution, persistence, options and marginal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from wearsim.errors import ScenarioError
from wearsim.plugins import Distribution, JointDistribution, RandomInputSpec, registry
from wearsim.quantities import Quantity
from wearsim.scenario.parse.mistakes import Mistakes
from wearsim.scenario.parse.pydantic_errors import key_of_file, split_keys, validate_options
from wearsim.scenario.random.model import (
    CONTACT_FIELDS,
    FRICTION,
    MISALIGNMENT,
    OF_A_CONTACT,
    OF_A_ROLLER,
    RandomInput,
    RandomInputTable,
)
from wearsim.scenario.random.targets import JointTarget
from wearsim.units import QuantityError, shown

_WITH_MARGINAL = {"field", "process"}


def read_random_input(
    raw: Mapping[str, object],
    name: str,
    quantity: Quantity | None,
    joint: JointTarget | None,
    mistakes: Mistakes,
) -> RandomInput | None:
    """Return the random input that a table holds, or None after adding its mistakes.

    Parameters
    ----------
    raw : mapping of str to object
        The table.
    name : str
        Dotted key of the value that it replaces.
    quantity : Quantity, optional
        Quantity of that value; None for a plain number.
    joint : JointTarget, optional
        Annotation of a key that takes a joint random input.
    mistakes : Mistakes
        Collects the mistakes.
    """
    before = len(mistakes.entries)
    own, options = split_keys(raw, RandomInputTable)
    table = validate_options(mistakes, RandomInputTable, own, name)
    kind = raw["distribution"]
    spec = None
    if isinstance(kind, str):
        spec = mistakes.find_plugin(RandomInputSpec, kind, name, "distribution")
    if spec is None or not _check_role(spec, name, joint, mistakes):
        return None
    if table:
        _check_persistence(spec, table, name, mistakes)
    marginal = _read_marginal(spec, own, name, quantity, mistakes)
    distribution = _build(spec, options, name, quantity, marginal, mistakes)
    sets = distribution.components if isinstance(distribution, JointDistribution) else None
    if joint and sets is not None and sorted(sets) != sorted(joint.components):
        expected = f"a distribution of {' and '.join(joint.components)}"
        mistakes.add(name, "distribution", f"sets {' and '.join(sets)}", shown(spec.name), expected)
    if len(mistakes.entries) > before or distribution is None or table is None:
        return None
    kind = str(table.marginal["distribution"]) if table.marginal else ""
    return RandomInput(name, spec.name, table.persistence, distribution, quantity, options, kind)


def _check_role(
    spec: RandomInputSpec, name: str, joint: JointTarget | None, mistakes: Mistakes
) -> bool:
    """Check that the role of the distribution is possible for this value."""
    if joint and spec.role != "joint":
        what = f"sets one value, but {name} sets {' and '.join(joint.components)}"
    elif spec.role == "joint" and not joint:
        what = f"sets several values together, which only {MISALIGNMENT} can"
    elif spec.role == "field" and name != FRICTION:
        what = f"varies within the contact, which only {FRICTION} can"
    elif spec.role == "process" and name not in CONTACT_FIELDS:
        what = f"varies in time, which only {', '.join(CONTACT_FIELDS)} can"
    else:
        return True
    roles = {"joint"} if joint else {"scalar"}
    if name in CONTACT_FIELDS:
        roles.add("process")
    if name == FRICTION:
        roles.add("field")
    mistakes.add(name, "distribution", what, shown(spec.name), _one_of(roles))
    return False


def _one_of(roles: set[str]) -> str:
    """Return the names of the distributions with these roles, for messages."""
    specs = [registry().get(RandomInputSpec, name) for name in registry().names(RandomInputSpec)]
    return f"one of {', '.join(shown(spec.name) for spec in specs if spec.role in roles)}"


def _check_persistence(
    spec: RandomInputSpec, table: RandomInputTable, name: str, mistakes: Mistakes
) -> None:
    if table.persistence == "per-pass" and spec.role == "process":
        what = "is not for a process, which runs through the whole test"
    elif table.persistence == "per-pass" and name not in OF_A_CONTACT:
        what = f"is only for {', '.join(OF_A_CONTACT)}"
    elif table.persistence == "per-roller" and name not in OF_A_ROLLER:
        what = f"is only for {', '.join(OF_A_ROLLER)}"
    else:
        return
    allowed = '"per-test" or "per-roller"' if name in OF_A_ROLLER else '"per-test"'
    mistakes.add(name, "persistence", what, shown(table.persistence), allowed)


def _read_marginal(
    spec: RandomInputSpec,
    own: Mapping[str, object],
    name: str,
    quantity: Quantity | None,
    mistakes: Mistakes,
) -> Distribution | None:
    """Return the marginal distribution of a field or a process."""
    raw, place = own.get("marginal"), f"{name}.marginal"
    if spec.role not in _WITH_MARGINAL:
        if raw is not None:
            what = f"is only for a field or a process; '{spec.name}' is neither"
            mistakes.add(name, "marginal", what)
        return None
    if raw is None:
        expected = "a table with a distribution and its options"
        mistakes.add(name, "marginal", "is missing", None, expected)
    if not isinstance(raw, dict):
        return None
    keys, options = split_keys(raw, RandomInputTable)
    kind = keys.pop("distribution", None)
    if kind is None:
        mistakes.add(place, "distribution", "is missing", None, _one_of({"scalar"}))
    elif not isinstance(kind, str):
        mistakes.add(place, "distribution", "is not text", shown(kind), _one_of({"scalar"}))
    for key in sorted(keys):
        mistakes.add(place, key, f"belongs in [{name}], not in its marginal", shown(keys[key]))
    if not isinstance(kind, str):
        return None
    marginal = mistakes.find_plugin(RandomInputSpec, kind, place, "distribution")
    if marginal and marginal.role != "scalar":
        what = f"is a {marginal.role}, but a marginal is the distribution of one number"
        mistakes.add(place, "distribution", what, shown(marginal.name), _one_of({"scalar"}))
        return None
    return _build(marginal, options, place, quantity, None, mistakes) if marginal else None


def _build(
    spec: RandomInputSpec,
    raw: Mapping[str, object],
    place: str,
    quantity: Quantity | None,
    marginal: Distribution | None,
    mistakes: Mistakes,
) -> Any:
    """Build a distribution, or add the mistakes of its options and return None."""
    options = validate_options(mistakes, spec.options, raw, place, RandomInputTable, quantity)
    if options is None or (spec.role in _WITH_MARGINAL and marginal is None):
        return None
    try:
        return spec.factory(options) if marginal is None else spec.factory(options, marginal)
    except ScenarioError as error:
        mistakes.add_file(error, place, key_of_file(raw, error.file))
    except QuantityError as error:
        mistakes.add(place, "", error.what, error.got, error.expected)
    except ValueError as error:
        mistakes.add(place, "", str(error))
    return None
