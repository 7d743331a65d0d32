"""How many realisations suffice to tell what a random input moves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wearsim.report.text.units import count
from wearsim.uq.sensitivity.polynomial_chaos import fewest_realisations
from wearsim.uq.sensitivity.sobol_indices import FEWEST_BASES

if TYPE_CHECKING:
    from wearsim.results import EnsembleResult

TO_TELL = "too few realisations to tell"


def too_few(result: EnsembleResult, names: list[str] | None = None) -> str:
    """Return that there are too few realisations for indices of sensitivity, and how many suffice.

    Parameters
    ----------
    result : EnsembleResult
    names : list of str, optional
        The random inputs; all of them if not given.
    """
    chosen = [item["name"] for item in result.raw.groups] if names is None else names
    return f"{TO_TELL}, {count(max(_enough(result, name) for name in chosen))} suffice"


def _enough(result: EnsembleResult, name: str) -> int:
    """Return how many realisations that end well suffice for one input."""
    if result.plan == "saltelli":
        return FEWEST_BASES * (len(result.raw.groups) + 2)
    inputs = result.inputs
    keys = [item["key"] for item in result.raw.inputs if item["input"] == name]
    columns = np.column_stack([inputs[key].reshape(result.count, -1) for key in keys])
    # of two numbers that are the same, the second says nothing new
    return fewest_realisations(np.unique(columns, axis=1).shape[1])
