"""View of a reproduction: printed and computed numbers, and the powers of all realisations."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from wearsim.levelling import Measured
from wearsim.report.panels import Sheet
from wearsim.report.text import PER_SI, in_unit
from wearsim.report.view import Frame, Row, Rows, Table, View
from wearsim_chevalier2005 import comparison_row, paper
from wearsim_chevalier2005.comparison import compare
from wearsim_chevalier2005.comparison_row import Number
from wearsim_chevalier2005.study import Reproduction

_SI = {"mm": "m", "%": "1"}
_MAIN = ("mean problem", "mean of P_d, all inputs random")  # parts that answer the question


class ReproductionView(View):
    """Powers of the mean problem and of all realisations, printed and computed.

    Panels: those of the Monte Carlo study with one friction coefficient per contact. The table of
    pandas has all compared numbers.
    """

    title = paper.REFERENCE
    question = "Which numbers of the paper are computed again?"

    def __init__(self, result: Reproduction) -> None:
        self.result, self.compared = result, compare(result)

    def rows(self) -> Rows:
        """Return the numbers of the mean problem and the means over the realisations."""
        return _rows(row for row in self.compared if row.part in _MAIN)

    def tables(self) -> list[Table]:
        """Return all numbers, a table for each part of the paper."""
        parts = groupby(self.compared, lambda row: row.part)
        return [Table(part, _rows(rows)) for part, rows in parts if part not in _MAIN]

    def data(self) -> dict[str, Any]:
        """Return the numbers in SI units."""
        return {
            "reference": paper.REFERENCE,
            "realisations": self.result.all_inputs.count,
            "seed": self.result.scenario.seed,
            "rows": [
                {
                    "name": f"{row.part}: {row.name}",
                    "paper": row.paper,
                    "printed_in": row.place,
                    "here": row.here,
                    "standard_error": row.standard_error,
                    "unit": _SI.get(row.unit, row.unit),
                    "why": row.why,
                }
                for row in self.compared
            ],
        }

    def panels(self, measured: Sequence[Measured] = ()) -> Sheet:
        """Return the panels of the Monte Carlo study."""
        sheet: Sheet = self.result.all_inputs.view.panels(measured)
        return sheet

    def frame(self) -> Frame:
        """Return the computed and the printed numbers in SI, one row each; ranges by their ends."""
        numbers = [
            [_ends(value) for value in (row.here, np.nan if row.paper is None else row.paper)]
            for row in self.compared
        ]
        ends = [
            (computed[0], computed[-1], printed[0], printed[-1]) for computed, printed in numbers
        ]
        names = ("here_low", "here_high", "printed_low", "printed_high")
        columns = [
            (name, "SI", values) for name, values in zip(names, np.array(ends).T, strict=True)
        ]
        labels = np.array([f"{row.part}: {row.name}" for row in self.compared])
        return Frame([("name", "", labels), *columns], "number", range(1, len(labels) + 1))


def _rows(compared: Iterable[comparison_row.Row]) -> Rows:
    """Return compared numbers as rows."""
    return [
        Row(
            f"{row.part}: {row.name}",
            computed(row).replace("\n", " ")
            + ("" if row.paper is None else f", printed {as_printed(row)}"),
        )
        for row in compared
    ]


def _ends(value: Number) -> tuple[float, ...]:
    return value if isinstance(value, tuple) else (value,)


def _with_unit(numbers: str, unit: str) -> str:
    return numbers if unit == "1" else f"{numbers} {unit}"


def as_printed(row: comparison_row.Row) -> str:
    """Return the printed value with the printed digits."""
    factor = PER_SI.get(row.unit, 1.0)
    numbers = (f"{value * factor:.10g}" for value in _ends(row.paper if row.paper else 0.0))
    return _with_unit(" to ".join(numbers), row.unit)


def computed(row: comparison_row.Row) -> str:
    """Return the computed value with its standard error."""
    digits = 5 if row.part == "inputs" and row.standard_error is None else 4
    text = " to ".join(_shown(value, row.unit, digits) for value in _ends(row.here))
    if row.standard_error is not None:
        errors = " and ".join(_shown(value, row.unit, 2) for value in _ends(row.standard_error))
        text += f" ± {errors}" if isinstance(row.here, float) else f"\n± {errors}"
    return _with_unit(text, row.unit)


def _shown(value: float, unit: str, digits: int) -> str:
    """Return a number converted to a unit, without the unit."""
    return in_unit(value, unit if unit in PER_SI else "1", digits)
