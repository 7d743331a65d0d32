"""Additional strips of a run that is extended."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from wearsim.evolution.state import WearState, widened, widened_state
from wearsim.results import RunData
from wearsim.results.run_schema import VARIABLES
from wearsim.studies.run.draws import Draws
from wearsim.studies.run.grid import strips_of_run


def widened_run(draws: Draws, data: RunData, state: WearState) -> tuple[RunData, WearState]:
    """Return data and state with additional strips if an extended test needs them.

    The present strips are unchanged, so that nothing is interpolated.
    """
    y, spacing = data.static["y"], float(data.checkpoint["spacing"])
    needed = strips_of_run(draws)
    lacking = 0.5 * (needed.spacing * needed.strips - spacing * len(y))
    # a surplus strip costs less than a contact that reaches the edge
    strips = int(np.ceil(lacking / spacing)) if lacking > 1e-6 * spacing else 0
    if strips == 0 or draws.scenario.total_passes == data.total_passes:
        return data, state
    margin = spacing * np.arange(1, strips + 1)
    wider = np.concatenate([y[0] - margin[::-1], y, y[-1] + margin])
    records = {
        name: widened(array, strips) if VARIABLES[name].dims[-1] == "y" else array
        for name, array in data.records.items()
    }
    data = replace(data, static={**data.static, "y": wider}, records=records)
    return data, widened_state(state, wider, strips)
