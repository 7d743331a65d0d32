"""A contact model with the options that a scenario gives it, in a line."""

from __future__ import annotations

import tomllib

from wearsim.scenario.tables.plugin import ContactTable
from wearsim.units import shown


def described_model(model: str, scenario_text: str) -> str:
    """Return a contact model with its options, ``slender (tangential = "fastsim")``.

    Parameters
    ----------
    model : str
        Its name.
    scenario_text : str
        The scenario's TOML; the model itself need not be installed.

    Returns
    -------
    str
        The name alone where the scenario gives no option.
    """
    table = tomllib.loads(scenario_text).get("contact", {})
    given = [
        f"{key} = {shown(value)}"
        for key, value in table.items()
        if key not in ContactTable.model_fields
    ]
    return f"{model} ({', '.join(given)})" if given else model
