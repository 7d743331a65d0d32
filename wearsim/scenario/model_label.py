"""One-line label of a contact model with its options."""

from __future__ import annotations

import tomllib

from wearsim.scenario.tables.plugin import ContactTable
from wearsim.units import shown


def described_model(model: str, scenario_text: str) -> str:
    """Return the label of a contact model, ``slender (tangential = "fastsim")``.

    Parameters
    ----------
    model : str
        Name of the model.
    scenario_text : str
        TOML of the scenario; the model's plugin need not be installed.

    Returns
    -------
    str
        Only the name if the scenario gives no option.
    """
    given = [
        f"{key} = {shown(value)}"
        for key, value in tomllib.loads(scenario_text).get("contact", {}).items()
        if key not in ContactTable.model_fields
    ]
    return f"{model} ({', '.join(given)})" if given else model
