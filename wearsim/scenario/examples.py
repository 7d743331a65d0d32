"""The scenarios that come with wearsim."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from wearsim.scenario.parse.toml import load_scenario
from wearsim.scenario.scenario import Scenario

_PACKAGE = Path(__file__).parents[1]

# an installed package holds them; in the source tree they stand beside it
_FOLDERS = (_PACKAGE / "scenarios", _PACKAGE.parent / "scenarios")


def shipped_scenario(name: str, overrides: Mapping[str, object] | None = None) -> Scenario:
    """Read a scenario that comes with wearsim, installed or not.

    Parameters
    ----------
    name : str
        Its file's name without the suffix, "mean-contact".
    overrides : mapping of str to object, optional
        Values by dotted key, as of `load_scenario`.

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


_STARTER = Path(__file__).with_name("starter.toml")


def starter_scenario() -> str:
    """Return a scenario that runs as it stands, with its alternatives in comments."""
    return _STARTER.read_text(encoding="utf-8")
