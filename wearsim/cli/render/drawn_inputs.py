"""What was drawn in the realisations of a study: a row or a JSON object for each value."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from wearsim.types import FloatArray
from wearsim.uq.estimation.moments import is_constant

CONSTANT = "constant"


def drawn_rows(
    items: Sequence[Mapping[str, str]], inputs: Mapping[str, FloatArray]
) -> list[tuple[str, str]]:
    """Return mean and standard deviation of what was drawn, in engineers' units.

    Parameters
    ----------
    items : sequence of mapping
        Key and unit of each drawn value.
    inputs : mapping of str to ndarray, shape (realisations,) or (realisations, rollers)
        What was drawn, by key; there is one realisation or more.
    """
    from wearsim.units import in_engineers_unit

    rows = []
    for item in items:
        values, unit = inputs[item["key"]], item["unit"]
        mean, std = float(values.mean()), _std(values)
        text = f"mean {in_engineers_unit(mean, unit, 4)}"
        if is_constant(mean, std):
            text = f"{CONSTANT} {in_engineers_unit(mean, unit, 4)}"
        elif math.isfinite(std):
            text += f", std {in_engineers_unit(std, unit, 4)}"
        rows.append((f"drawn {item['key']}", text))
    return rows


def drawn_data(
    items: Sequence[Mapping[str, str]], inputs: Mapping[str, FloatArray]
) -> dict[str, Any]:
    """Return mean and standard deviation of what was drawn, in SI; parameters as `drawn_rows`."""
    return {
        item["key"]: {
            "unit": item["unit"],
            "mean": inputs[item["key"]].mean(),
            "std": _std(inputs[item["key"]]),
        }
        for item in items
    }


def _std(values: FloatArray) -> float:
    return float(values.std(ddof=1)) if values.size > 1 else math.nan
