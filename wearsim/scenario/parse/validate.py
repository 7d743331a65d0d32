"""Validation of one table of a scenario, which may hold random inputs."""

from __future__ import annotations

from collections.abc import Mapping

from pydantic import BaseModel

from wearsim.scenario.parse.mistakes import Mistakes
from wearsim.scenario.parse.pydantic_errors import M, validate_options
from wearsim.scenario.random.placeholders import lift


def validate(
    mistakes: Mistakes,
    model: type[M],
    raw: Mapping[str, object],
    table: str,
    other_keys: type[BaseModel] | None = None,
) -> M | None:
    """Return `raw` as an instance of `model`, or None after adding its mistakes.

    Random inputs are added to `mistakes` and replaced by their means; `other_keys` is the model of
    the other keys of the same table, which `raw` lacks.
    """
    values, refused = lift(mistakes, model, raw, table)
    return validate_options(mistakes, model, values, table, other_keys, refused=refused)
