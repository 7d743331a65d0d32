"""A scenario with values in the place of its random inputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, cast

from wearsim.scenario.parse.key_index import keys_by_place
from wearsim.scenario.parse.mistakes import Mistakes
from wearsim.scenario.parse.toml import READERS, check_lists
from wearsim.scenario.random.placeholders import put_all
from wearsim.scenario.scenario import Drawn, Scenario


def realise(scenario: Scenario, values: Mapping[str, Drawn]) -> Scenario:
    """Return a scenario with values in the place of random inputs.

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
        Text, files and digest are those of the scenario given.

    Raises
    ------
    ValueError
        If a key is not set by any random input, or a joint input would be set in part.
    ScenarioError
        If a value is out of its bounds.
    """
    owners = {key: item for item in scenario.random for key in item.keys}
    unknown = [key for key in values if key not in owners]
    if unknown:
        raise ValueError(f"no random input sets {unknown[0]}; known: {', '.join(owners) or 'none'}")
    written: dict[str, object] = {}
    for key, value in values.items():
        missing = [other for other in owners[key].keys if other not in values]
        if missing:
            raise ValueError(f"{owners[key].name} sets {missing[0]} too, which is not given")
        quantity = owners[key].quantity
        numbers = [float(number) for number in (value if isinstance(value, tuple) else (value,))]
        texts = [quantity.write(number) if quantity else number for number in numbers]
        written[key] = texts if isinstance(value, tuple) else texts[0]
    tables = put_all(scenario._tables, written)
    mistakes = Mistakes(scenario.file, scenario.files.__getitem__, keys_by_place)
    changed = [table for table in READERS if any(key.startswith(f"{table}.") for key in written)]
    sections: dict[str, Any] = {
        table: READERS[table](cast("Mapping[str, object]", tables[table]), mistakes)
        for table in changed
    }
    check_lists(tables, mistakes)
    mistakes.raise_any()
    return replace(
        scenario,
        **sections,
        random=tuple(item for item in scenario.random if item.keys[0] not in values),
        drawn={**scenario.drawn, **values},
        _tables=tables,
    )
