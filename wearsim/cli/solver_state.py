"""State of a solver at a failure, in engineering units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from wearsim.report.text import PER_SI, with_unit

# name and unit of the quantities in the state of a solver
_STATE = {
    "gap": ("gap", "um"),
    "line_load": ("line load", "N/mm"),
    "half_length": ("half-length", "mm"),
    "half_width": ("half-width", "mm"),
    "approach": ("approach", "um"),
    "normal_force": ("normal force", "N"),
    "cylinder_depth": ("cylinder depth", "um"),
    "roller_depth": ("roller depth", "um"),
    "depth_error": ("error of depth", "um"),
    "volume_error": ("error of volume", "mm^3"),
    "profile_error": ("error of profiles", "1"),
    "energy": ("dissipated energy", "J"),
    "step": ("step in passes", "1"),
}
_INTERNAL = (
    *("contact_", "coarse_step_", "half_quadrature_", "loop_", "quadrature", "scatter"),
    *("approach_factor", "decay", "past_", "order", "wear_exponents"),
)


def solver_state(state: Mapping[str, Any]) -> str:
    """Return the numbers of a solver's state on one line, an array as its range.

    Quantities that only a plugin knows are in SI units, without a unit.
    """
    parts = []
    for name, value in state.items():
        numeric = isinstance(value, int | float) or (hasattr(value, "min") and value.size)
        if not numeric or name.startswith(_INTERNAL):
            continue
        words, unit = _STATE.get(name, (name.replace("_", " "), "1"))
        ends = [f"{float(end) * PER_SI[unit]:.6g}" for end in (np.min(value), np.max(value))]
        size = " to ".join(dict.fromkeys(ends))
        parts.append(with_unit(f"{words} {size}", unit))
    return ", ".join(parts)
