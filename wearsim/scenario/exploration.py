"""The page on which a scenario is explored, which the plugin wearsim-explore serves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from wearsim.errors import PluginError
from wearsim.scenario.scenario import Scenario

GROUP, NAME = "wearsim.functions", "explore"


def explore(scenario: Scenario | str | Path) -> Any:
    """Serve a page on which the values of a scenario are changed and its results follow.

    A notebook shows the page below the cell. It is served to this machine only, until it is closed
    or Python ends.

    Parameters
    ----------
    scenario : Scenario or path
        The scenario, or its file. Files that it names must lie in its folder, into which changed
        scenarios are saved.

    Returns
    -------
    Exploration
        With ``address``, the address of the page, ``open()``, which opens it in a browser, and
        ``close()``.

    Raises
    ------
    PluginError
        If wearsim-explore is not installed, which is the extra ``wearsim[explore]``.
    ScenarioError
        If the scenario cannot be read.

    Examples
    --------
    >>> page = wearsim.explore("rig.toml")
    >>> page.address.partition("?")[0].rstrip("0123456789/")
    'http://127.0.0.1:'
    >>> page.close()
    """
    from importlib.metadata import entry_points  # noqa: PLC0415  (slow to import)

    points = list(entry_points(group=GROUP, name=NAME))
    if not points:
        raise PluginError(
            "the page is served by wearsim-explore, which is not installed; install it with:"
            " pip install 'wearsim[explore]'"
        )
    return points[0].load()(scenario)
