"""The distribution `posterior`: a log-normal value with an uncertain median and scatter."""

from __future__ import annotations

import re
from copy import copy
from functools import lru_cache
from typing import Self

import numpy as np
from pydantic import Field, PrivateAttr, ValidationInfo, model_validator

from wearsim.csv_tables import read_columns
from wearsim.errors import Mistake, ScenarioError
from wearsim.plugins import Options, RandomInputSpec
from wearsim.quantities import InputFile, PositiveWearFactor, Quantity
from wearsim.uq.distributions.two_levels import TwoLevels

SPECIMENS, CONTAINED = "specimens", "contained in the scatter"
_REMARK = re.compile(r"#\s*(?P<name>[^:]+):\s*(?P<value>.*)")


class PosteriorOptions(Options):
    """Options of the distribution `posterior`."""

    file: InputFile = Field(
        description="CSV with weights of medians and scatters in the columns 'median [1/Pa]',"
        " 'scatter' and 'weight', from `wearsim identify --posterior`"
    )
    over: PositiveWearFactor | None = Field(
        None,
        description="K/H by which the values are divided, for the factor of the wear factors of"
        " both bodies: that of the cylinder or cam",
    )
    _levels: TwoLevels = PrivateAttr()

    @model_validator(mode="after")
    def _read(self, info: ValidationInfo) -> Self:
        replaced: Quantity | None = (info.context or {}).get("quantity")
        unit = "1/Pa" if self.over is not None else replaced.kind.unit if replaced else "1"
        self._levels = read_levels(self.file, unit, self.over or 1.0)
        return self

    @property
    def levels(self) -> TwoLevels:
        """The distribution [SI]."""
        return self._levels


@lru_cache(maxsize=16)  # a study reads its scenario many times; quantiles need a table
def read_levels(file: InputFile, unit: str, over: float) -> TwoLevels:
    """Return the distribution that a file holds; raise a ScenarioError for mistakes."""
    columns = {"median": unit, "scatter": "1", "weight": "1"}
    read = read_columns(file.text, file.path, columns)
    mistakes = [
        Mistake("", "", f"column '{name}' must be above 0", f"{read[name][row]:g} in row {row + 1}")
        for name in columns
        for row in np.flatnonzero(~(read[name] > 0.0))[:1]
    ]
    if mistakes:
        raise ScenarioError(file.path, mistakes)
    matches = (_REMARK.fullmatch(line.strip()) for line in file.text.splitlines())
    remarks = {match["name"].strip(): match["value"].strip() for match in matches if match}
    count = remarks.get(SPECIMENS, "0")
    levels = TwoLevels(
        np.log(read["median"] / over),
        read["scatter"],
        read["weight"],
        int(count) if count.isdecimal() else 0,
        [key.strip() for key in remarks.get(CONTAINED, "").split(",") if key.strip()],
    )
    levels.quantile(np.array([0.5]))  # computes the table that copies share
    return levels


SPECS = (
    RandomInputSpec(
        name="posterior",
        factory=lambda options: copy(options.levels),
        options=PosteriorOptions,
        summary="log-normal with an uncertain median and scatter, from identify --posterior",
        protocol=2,
    ),
)
