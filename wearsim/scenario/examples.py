"""The scenarios shipped with wearsim."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from wearsim.scenario.parse.toml import load_scenario
from wearsim.scenario.scenario import Scenario

_PACKAGE = Path(__file__).parents[1]

# inside an installed package; next to the package in the source tree
_FOLDERS = (_PACKAGE / "scenarios", _PACKAGE.parent / "scenarios")


def shipped_scenario(name: str, overrides: Mapping[str, object] | None = None) -> Scenario:
    """Read a scenario shipped with wearsim.

    Parameters
    ----------
    name : str
        File name without the suffix, "mean-contact".
    overrides : mapping of str to object, optional
        Values by dotted key, as for `load_scenario`.

    Returns
    -------
    Scenario

    Raises
    ------
    ScenarioError
        As `load_scenario`.
    """
    folder = next((folder for folder in _FOLDERS if folder.is_dir()), _FOLDERS[0])
    return load_scenario(folder / f"{name}.toml", overrides)


def starter_scenario() -> str:
    """Return the TOML of a complete scenario, with alternatives as comments."""
    return Path(__file__).with_name("starter.toml").read_text(encoding="utf-8")
