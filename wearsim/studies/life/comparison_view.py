"""View of the lives of several designs, each compared with the first."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from wearsim.errors import ResultsFileError
from wearsim.levelling import Measured
from wearsim.report.text import part_with_interval, with_ends
from wearsim.report.view import Row, Rows, Table, View
from wearsim.studies.life.comparison import LifeComparison, swept_variable
from wearsim.studies.life.result import LifeResult
from wearsim.studies.life.stored_settings import DesignVariable
from wearsim.studies.life.view import ERROR, lives_table
from wearsim.uq.estimation.intervals import Interval

if TYPE_CHECKING:
    from wearsim.report.panels import Sheet


class LivesView(View):
    """Lives of several designs, each compared with the first: ratio of B10, and probabilities.

    Parameters
    ----------
    results : sequence of LifeResult
    labels : sequence of str
    observable : str, optional
        Without meaning: there is one, the life.

    Raises
    ------
    ResultsFileError
        If the units of lives differ.
    """

    basis = ERROR

    def __init__(
        self, results: Sequence[LifeResult], labels: Sequence[str], observable: str | None = None
    ) -> None:
        self.results, self.labels = list(results), list(labels)
        self.title = f"{', '.join(labels[:-1])} and {labels[-1]}"
        first, *others = results
        self.question = f"Which design lasts more {first.unit}?"
        try:
            self.compared = [first.compare(other) for other in others]
        except ValueError as error:
            raise ResultsFileError(str(error)) from error

    def rows(self) -> Rows:
        """Return the comparison of each design with the first one."""
        first, rows = self.labels[0], list[Row]()
        for label, comparison in zip(self.labels[1:], self.compared, strict=True):
            of = "" if len(self.compared) == 1 else f", {first} against {label}"
            ratio = f"{first} has {_factor(comparison.b10_ratio)} times the B10 of {label}"
            same = comparison.same_machine
            rows += [
                Row(f"B10 ratio{of}", ratio + _numerical(*comparison.b10_ratio_bounds)),
                Row(
                    f"same machine{of}",
                    "unknown: the studies have no common draws"
                    if same is None
                    else f"{first} outlives {label} on {part_with_interval(same)} of the machines,"
                    " each with the same drawn values for both designs",
                ),
                Row(
                    f"two specimens{of}",
                    f"a specimen of {first} outlives a specimen of {label}, drawn separately, with"
                    f" probability {part_with_interval(comparison.two_specimens)}",
                ),
            ]
        return rows

    def tables(self) -> list[Table]:
        """Return the lives of all designs."""
        return [lives_table(self.labels, self.results)]

    def data(self) -> dict[str, Any]:
        """Return all designs and their comparison with the first."""
        first, *others = self.results
        variable = swept_variable(self.results)
        return {
            "unit": first.unit,
            "designs": [result.view.data() for result in self.results],
            "labels": self.labels,
            **(
                _comparison(self.compared[0])
                if len(others) == 1
                else {"compared_with_first": [_comparison(item.compare(first)) for item in others]}
            ),
            **({"against": _against(variable, self.results)} if variable else {}),
        }

    def panels(self, measured: Sequence[Measured] = ()) -> Sheet:
        """Return the panels of all designs."""
        from wearsim.studies.life.panels import lives_sheet  # noqa: PLC0415  (only of figures)

        return lives_sheet(self.results, self.labels)


def _factor(ratio: Interval) -> str:
    if not math.isfinite(ratio.value):
        return "an unknown number of"
    if not math.isfinite(ratio.half_width):
        return f"{ratio.value:.3f} [unbounded]"
    return with_ends(ratio, "{:.3f}".format)


def _numerical(low: float, high: float) -> str:
    """Return the range of a ratio within numerical errors as a part of a sentence."""
    if not math.isfinite(low + high):
        return ""
    text = f"; {low:.3f} to {high:.3f} within the numerical errors of both lives"
    return text + (", which leave open which is longer" if low < 1.0 < high else "")


def _comparison(comparison: LifeComparison) -> dict[str, Any]:
    return {
        "b10_ratio": asdict(comparison.b10_ratio),
        "same_machine": asdict(comparison.same_machine) if comparison.same_machine else None,
        "two_specimens": asdict(comparison.two_specimens),
        "pairs": comparison.count,
        "b10_ratio_bounds": list(comparison.b10_ratio_bounds),
    }


def _against(variable: DesignVariable, results: Sequence[LifeResult]) -> dict[str, Any]:
    """Return the lives of designs against the design variable, both in the given order."""
    return {
        "key": variable.key,
        "unit": variable.unit,
        "values": [result.variable.value for result in results if result.variable],
        "b": {
            f"{share:g}": [asdict(result.b(share)) for result in results]
            for share in results[0].settings.shares
        },
    }
