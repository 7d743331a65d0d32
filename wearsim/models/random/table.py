"""The distribution `table`: measured samples or quantiles from a CSV file."""

from __future__ import annotations

from functools import cached_property
from typing import Self

import numpy as np
from pydantic import Field, PrivateAttr, ValidationInfo, model_validator

from wearsim.csv_tables import column_names, read_columns
from wearsim.errors import Mistake, ScenarioError
from wearsim.plugins import Distribution, Options
from wearsim.quantities import InputFile, Quantity
from wearsim.types import FloatArray


class TableOptions(Options):
    """Options of the distribution `table`."""

    file: InputFile = Field(
        description="CSV with the samples in a column 'value [N]', or quantiles with 'probability'"
    )
    _quantiles: tuple[FloatArray, FloatArray] = PrivateAttr()

    @model_validator(mode="after")
    def _read(self, info: ValidationInfo) -> Self:
        # the unit is that of the value that the distribution replaces
        replaced: Quantity | None = (info.context or {}).get("quantity")
        self._quantiles = _read_quantiles(self.file, replaced.kind.unit if replaced else "1")
        return self

    @property
    def quantiles(self) -> tuple[FloatArray, FloatArray]:
        """Probabilities from 0 to 1, and the quantiles [SI]."""
        return self._quantiles


def _read_quantiles(file: InputFile, unit: str) -> tuple[FloatArray, FloatArray]:
    """Return the probabilities and quantiles of a file; raise a ScenarioError for mistakes."""
    if "probability" not in column_names(file.text):
        samples = np.sort(read_columns(file.text, file.path, {"value": unit})["value"])
        # Sample i of n has the probability (i - 1/2)/n, with constant ends beyond the first and
        # the last, so that the mean is that of the samples. With equal steps from 0 to 1 the two
        # extremes would have half the weight of the others.
        places = (np.arange(len(samples)) + 0.5) / len(samples)
        ends = samples[:1], samples[-1:]
        return np.concatenate([[0.0], places, [1.0]]), np.concatenate([ends[0], samples, ends[1]])
    columns = {"probability": "1", "value": unit}
    read = read_columns(file.text, file.path, columns, rising="probability")
    probability, value = read["probability"], read["value"]
    mistakes = []
    if probability[0] != 0.0 or probability[-1] != 1.0:
        got = f"{probability[0]:g} to {probability[-1]:g}"
        mistakes.append(Mistake("", "", "column 'probability' must go from 0 to 1", got))
    if np.any(np.diff(value) < 0.0):
        first = int(np.argmax(np.diff(value) < 0.0))
        got = f"{value[first + 1]:g} after {value[first]:g}"
        mistakes.append(Mistake("", "", "column 'value' must not decrease", got))
    if mistakes:
        raise ScenarioError(file.path, mistakes)
    return probability, value


class TableDistribution(Distribution):
    """Quantile function that interpolates linearly in a table."""

    def __init__(self, options: TableOptions) -> None:
        self._probability, self._value = options.quantiles

    def quantile(self, probability: FloatArray) -> FloatArray:
        """Return the quantiles, shape as `probability`."""
        return np.interp(probability, self._probability, self._value)

    @cached_property
    def support(self) -> tuple[float, float]:
        """Minimum and maximum of the table."""
        return float(self._value[0]), float(self._value[-1])

    @cached_property
    def mean(self) -> float:
        """Exact mean."""
        middle = 0.5 * (self._value[1:] + self._value[:-1])
        return float(np.dot(np.diff(self._probability), middle))

    @cached_property
    def std(self) -> float:
        """Exact standard deviation."""
        low, high = self._value[:-1] - self.mean, self._value[1:] - self.mean
        squares = (low * low + low * high + high * high) / 3.0
        return float(np.sqrt(np.dot(np.diff(self._probability), squares)))
