"""The strips that all members of an ensemble share."""

from __future__ import annotations

import numpy as np

from wearsim.errors import WearsimError
from wearsim.scenario import Scenario
from wearsim.studies.run.assemble import strips_of_run
from wearsim.studies.run.draws import Drawer
from wearsim.types import Grid

PROBES = 64  # realisations that the strips are laid out for, whatever the ensemble's size
ROOM = 1.05  # over the widest of them


def shared_grid(scenario: Scenario) -> Grid:
    """Return strips for the members of an ensemble, the same whatever their number.

    They reach as far as those of the first realisations do, and are as fine as theirs on average.
    A member that needs more takes strips of its own.

    Parameters
    ----------
    scenario : Scenario
        With random inputs.

    Raises
    ------
    WearsimError
        If none of the realisations looked at has strips; the reason is the first one's.
    """
    drawer, grids, refused = Drawer(scenario, "monte-carlo"), [], None
    for number in range(PROBES):
        try:
            grids.append(strips_of_run(drawer.draw(number)))
        except WearsimError as error:
            refused = refused or error
    if not grids:
        raise refused or AssertionError
    spacing = float(np.median([grid.spacing for grid in grids]))
    low = min(float(grid.y[0]) - 0.5 * grid.spacing for grid in grids)
    high = max(float(grid.y[-1]) + 0.5 * grid.spacing for grid in grids)
    strips = int(np.ceil(ROOM * (high - low) / spacing))
    strips += (strips + 1) % 2
    middle, half = 0.5 * (low + high), 0.5 * strips * spacing
    return Grid.spanning(middle - half, middle + half, strips)
