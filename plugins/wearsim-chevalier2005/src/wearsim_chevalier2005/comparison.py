"""All rows of the comparison with the paper."""

from __future__ import annotations

from wearsim_chevalier2005 import comparison_inputs as inputs, comparison_spread as spread
from wearsim_chevalier2005.comparison_row import Row
from wearsim_chevalier2005.study import Reproduction


def compare(results: Reproduction) -> tuple[Row, ...]:
    """Return the printed and computed numbers with the reasons of their differences."""
    return (
        *inputs.contact_rows(results),
        *inputs.input_rows(results),
        *inputs.mean_problem_rows(results),
        *spread.mean_rows(results),
        *spread.range_rows(results),
        *spread.convergence_rows(results),
        *spread.bound_rows(results),
    )
