"""Reads the table of one random input: its distribution, persistence, options and marginal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from wearsim.errors import PluginError, ScenarioError
from wearsim.plugins import Distribution, JointDistribution, RandomInputSpec, registry
from wearsim.quantities import Quantity
from wearsim.scenario.parse.pydantic_errors import validate_options
from wearsim.scenario.random.model import (
    CONTACT_FIELDS,
    FRICTION,
    MISALIGNMENT,
    OF_A_CONTACT,
    OF_A_ROLLER,
    RandomInput,
    RandomInputTable,
)
from wearsim.scenario.random.targets import Joint
from wearsim.units import QuantityError, shown

if TYPE_CHECKING:
    from wearsim.scenario.parse.mistakes import Report

_WITH_MARGINAL = {"field", "process"}


def read_random_input(
    raw: Mapping[str, object],
    name: str,
    quantity: Quantity | None,
    joint: Joint | None,
    report: Report,
) -> RandomInput | None:
    """Return the random input that a table holds, or None after noting its mistakes.

    Parameters
    ----------
    raw : mapping of str to object
        The table.
    name : str
        Dotted key of the value that it stands for.
    quantity : Quantity, optional
        What that value measures; nothing for a plain number.
    joint : Joint, optional
        The mark of a key that takes a joint random input.
    report : Report
        Collects mistakes.
    """
    before = len(report.mistakes)
    ours, options = _split(raw)
    table = validate_options(report, RandomInputTable, ours, name)
    spec = _find(raw["distribution"], name, report)
    if spec is None or not _suits(spec, name, joint, report):
        return None
    if table:
        _check_persistence(spec, table, name, report)
    marginal = _read_marginal(spec, ours, name, quantity, report)
    law = _build(spec, options, name, quantity, marginal, report)
    if isinstance(law, JointDistribution) and joint:
        _check_components(spec, law, joint, name, report)
    if len(report.mistakes) > before or law is None or table is None:
        return None
    kind = str(table.marginal["distribution"]) if table.marginal else ""
    return RandomInput(name, spec.name, table.persistence, law, quantity, options, kind)


def _split(raw: Mapping[str, object]) -> tuple[dict[str, object], dict[str, object]]:
    """Split a table into the keys of every random input and the distribution's options."""
    ours = {key: value for key, value in raw.items() if key in RandomInputTable.model_fields}
    return ours, {key: value for key, value in raw.items() if key not in ours}


def _find(kind: object, place: str, report: Report) -> RandomInputSpec | None:
    if not isinstance(kind, str):
        return None
    try:
        return registry().get(RandomInputSpec, kind)
    except PluginError as error:
        report.add(place, "distribution", str(error))
        return None


def _suits(spec: RandomInputSpec, name: str, joint: Joint | None, report: Report) -> bool:
    """Check that what the distribution builds can stand at this place."""
    what = None
    if joint and spec.role != "joint":
        what = f"sets one value, and {name} stands for {' and '.join(joint.components)}"
    elif spec.role == "joint" and not joint:
        what = f"sets several values together, as only {MISALIGNMENT} can"
    elif spec.role == "field" and name != FRICTION:
        what = f"differs within the contact, as only {FRICTION} can"
    elif spec.role == "process" and name not in CONTACT_FIELDS:
        what = f"changes in time, as only {', '.join(CONTACT_FIELDS)} can"
    if what is None:
        return True
    roles = {"joint"} if joint else {"scalar"}
    if name in CONTACT_FIELDS:
        roles.add("process")
    if name == FRICTION:
        roles.add("field")
    report.add(name, "distribution", what, shown(spec.name), _one_of(roles))
    return False


def _one_of(roles: set[str]) -> str:
    """Return the names of the distributions with these roles, for messages."""
    specs = [registry().get(RandomInputSpec, name) for name in registry().names(RandomInputSpec)]
    return f"one of {', '.join(shown(spec.name) for spec in specs if spec.role in roles)}"


def _check_persistence(
    spec: RandomInputSpec, table: RandomInputTable, name: str, report: Report
) -> None:
    persistence = table.persistence
    what = None
    if persistence == "per-pass" and spec.role == "process":
        what = "would break a process, which goes on through the whole test"
    elif persistence == "per-pass" and name not in OF_A_CONTACT:
        what = f"is only for {', '.join(OF_A_CONTACT)}"
    elif persistence == "per-roller" and name not in OF_A_ROLLER:
        what = f"is only for {', '.join(OF_A_ROLLER)}"
    if what:
        allowed = '"per-test" or "per-roller"' if name in OF_A_ROLLER else '"per-test"'
        report.add(name, "persistence", what, shown(persistence), allowed)


def _read_marginal(
    spec: RandomInputSpec,
    ours: Mapping[str, object],
    name: str,
    quantity: Quantity | None,
    report: Report,
) -> Distribution | None:
    """Return the marginal distribution of a field or a process."""
    raw, place = ours.get("marginal"), f"{name}.marginal"
    if spec.role not in _WITH_MARGINAL:
        if raw is not None:
            what = f"goes with a field or a process, and '{spec.name}' is neither"
            report.add(name, "marginal", what)
        return None
    expected = "a table with a distribution and its options"
    if raw is None:
        report.add(name, "marginal", "is missing", None, expected)
    if not isinstance(raw, dict):
        return None
    keys, options = _split(raw)
    if "distribution" not in keys:
        report.add(place, "distribution", "is missing", None, _one_of({"scalar"}))
    elif not isinstance(keys["distribution"], str):
        got = shown(keys["distribution"])
        report.add(place, "distribution", "is not text", got, _one_of({"scalar"}))
    for key in sorted(set(keys) - {"distribution"}):
        report.add(place, key, f"belongs in [{name}], not in its marginal", shown(keys[key]))
    marginal = _find(keys.get("distribution"), place, report)
    if marginal and marginal.role != "scalar":
        what = f"is a {marginal.role}, and a marginal is one number's"
        report.add(place, "distribution", what, shown(marginal.name), _one_of({"scalar"}))
        return None
    return _build(marginal, options, place, quantity, None, report) if marginal else None


def _build(
    spec: RandomInputSpec,
    raw: Mapping[str, object],
    place: str,
    quantity: Quantity | None,
    marginal: Distribution | None,
    report: Report,
) -> Any:
    """Build what the distribution's options ask for, or note what is wrong with them."""
    options = validate_options(report, spec.options, raw, place, RandomInputTable, quantity)
    lacks_marginal = spec.role in _WITH_MARGINAL and marginal is None
    if options is None or lacks_marginal:
        return None
    try:
        return spec.factory(options) if marginal is None else spec.factory(options, marginal)
    except ScenarioError as error:
        key = next((key for key, value in raw.items() if value == error.file), "")
        report.add_file(error, place, key)
    except QuantityError as error:
        report.add(place, "", error.what, error.got, error.expected)
    except ValueError as error:
        report.add(place, "", str(error))
    return None


def _check_components(
    spec: RandomInputSpec, law: JointDistribution, joint: Joint, name: str, report: Report
) -> None:
    if sorted(law.components) != sorted(joint.components):
        what = f"sets {' and '.join(law.components)}"
        expected = f"a distribution of {' and '.join(joint.components)}"
        report.add(name, "distribution", what, shown(spec.name), expected)
