"""The paper's numbers beside those found here, and why they differ."""

from __future__ import annotations

from wearsim_chevalier2005 import comparison_inputs as before
from wearsim_chevalier2005 import comparison_spread as spread
from wearsim_chevalier2005.comparison_row import Row
from wearsim_chevalier2005.study import Reproduction


def compare(found: Reproduction) -> tuple[Row, ...]:
    """Return the paper's numbers beside those found here.

    Parameters
    ----------
    found : Reproduction

    Returns
    -------
    tuple of Row
    """
    return (
        *before.contact_rows(found),
        *before.input_rows(found),
        *before.mean_problem_rows(found),
        *spread.mean_rows(found),
        *spread.range_rows(found),
        *spread.convergence_rows(found),
        *spread.bound_rows(found),
    )
