"""Replacement of random inputs of a scenario by drawn values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from pydantic import BaseModel

from wearsim.scenario.parse.mistakes import Mistakes, replace_numbers
from wearsim.scenario.scenario import Drawn, Scenario
from wearsim.scenario.tables.axial import combine_bodies
from wearsim.scenario.tables.plain import check_angles, check_lists
from wearsim.scenario.tables.plugin import LoadChoice, check_load


def realise(scenario: Scenario, values: Mapping[str, Drawn]) -> Scenario:
    """Return a scenario with values instead of random inputs.

    The values are recorded in `drawn`, and pass the checks that a value in the file would.

    Parameters
    ----------
    scenario : Scenario
        With random inputs.
    values : mapping of str to float or tuple of float
        In SI, by the dotted keys that the inputs set (`RandomInput.keys`); where a scenario may
        hold a list, a tuple is one value per roller.

    Returns
    -------
    Scenario
        Text, files and digest belong to the scenario given.

    Raises
    ------
    ValueError
        If a key is not set by any random input, or a joint input would be set in part.
    ScenarioError
        If a value is out of its bounds.
    """
    owners = {key: item for item in scenario.random for key in item.keys}
    if unknown := [key for key in values if key not in owners]:
        raise ValueError(f"no random input sets {unknown[0]}; known: {', '.join(owners) or 'none'}")
    numbers: dict[str, dict[str, Any]] = {}
    for key, value in values.items():
        if missing := [other for other in owners[key].keys if other not in values]:
            raise ValueError(f"{owners[key].name} sets {missing[0]} too, which is not given")
        *tables, last = key.split(".")
        place: dict[str, Any] = numbers
        for table in tables:
            place = place.setdefault(table, {})
        place[last] = tuple(map(float, value)) if isinstance(value, tuple) else float(value)
    mistakes = Mistakes(scenario.file, scenario.files.__getitem__)
    bodies = _with_forms(mistakes, scenario, numbers)
    scenario = replace(scenario, **bodies) if bodies else scenario
    sections = {
        table: _replaced(mistakes, getattr(scenario, table), keys, table)
        for table, keys in sorted(numbers.items())
    }
    check_lists(mistakes, {**numbers, "operation": {"rollers": scenario.operation.rollers}})
    mistakes.raise_any()
    if "creepage" in sections:
        check_angles(mistakes, sections["creepage"])
    if "load" in sections:
        check_load(mistakes, sections["load"])
    if bodies:
        sections = combine_bodies(mistakes, vars(scenario)) | sections
    mistakes.raise_any()
    return replace(
        scenario,
        **sections,
        random=tuple(item for item in scenario.random if item.keys[0] not in values),
        drawn={**scenario.drawn, **values},
    )


def _with_forms(
    mistakes: Mistakes, scenario: Scenario, numbers: dict[str, dict[str, Any]]
) -> dict[str, Any]:
    """Return the bodies with drawn numbers in their axial profiles, taken out of `numbers`."""
    bodies: dict[str, Any] = {}
    for table in ("roller", "cylinder", "cam"):
        drawn = numbers.get(table, {}).pop("axial_profile", None)
        if drawn is None:
            continue
        if not numbers[table]:
            del numbers[table]
        name = "roller" if table == "roller" else "cylinder"  # the base circle of a cam
        body: Any = getattr(scenario, name)
        choice = body.axial_profile
        options = replace_numbers(mistakes, choice.options, drawn, f"{table}.axial_profile")
        mistakes.raise_any()
        changed = {"axial_profile": replace(choice, options=options)}
        isolated = isinstance(body, BaseModel)
        bodies[name] = body.model_copy(update=changed) if isolated else replace(body, **changed)
    return bodies


def _replaced(mistakes: Mistakes, section: Any, numbers: dict[str, Any], table: str) -> Any:
    """Return a table's model, or the choice of a plugin, with numbers replaced."""
    if isinstance(section, BaseModel):
        return replace_numbers(mistakes, section, numbers, table)
    if isinstance(section, LoadChoice):
        inner = {term.name: numbers.pop(term.name, {}) for term in section.terms}
        terms = [
            _replaced(mistakes, term, inner[term.name], f"{table}.{term.name}")
            for term in section.terms
        ]
        section = replace(section, terms=tuple(terms))
    if not numbers:
        return section
    return replace(section, options=replace_numbers(mistakes, section.options, numbers, table))
