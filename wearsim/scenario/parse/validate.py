"""Validation of one table of a scenario, which may hold random inputs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wearsim.scenario.parse.pydantic_errors import M, validate_options
from wearsim.scenario.random.placeholders import lift

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pydantic import BaseModel

    from wearsim.scenario.parse.mistakes import Report


def validate(
    report: Report,
    model: type[M],
    raw: Mapping[str, object],
    table: str,
    beside: type[BaseModel] | None = None,
) -> M | None:
    """Return `raw` as an instance of `model`, or None after adding its mistakes to the report.

    Random inputs are added to the report and replaced by their means; `beside` is the model of
    keys that stand in the same table and were removed.
    """
    values, refused = lift(report, model, raw, table)
    return validate_options(report, model, values, table, beside, refused=refused)
