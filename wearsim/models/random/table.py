"""The distribution `table`: measured samples, or quantiles, from a CSV file."""

from __future__ import annotations

import re
from functools import cached_property
from typing import Self

import numpy as np
from pydantic import Field, PrivateAttr, ValidationInfo, model_validator

from wearsim.csv_tables import read_columns
from wearsim.errors import Mistake, ScenarioError
from wearsim.plugins import Distribution, Options
from wearsim.quantities import InputFile, Quantity
from wearsim.types import FloatArray


class TableOptions(Options):
    """Options of the distribution `table`."""

    file: InputFile = Field(
        description="CSV with a column such as 'value [N]' of samples, or that and 'probability'"
    )
    _probability: FloatArray = PrivateAttr()
    _value: FloatArray = PrivateAttr()

    @model_validator(mode="after")
    def _read(self, info: ValidationInfo) -> Self:
        # the unit of the host is known here alone
        host: Quantity | None = (info.context or {}).get("quantity")
        unit = "1" if host is None else host.kind.unit
        self._probability, self._value = _quantiles(self.file, unit)
        return self

    @property
    def quantiles(self) -> tuple[FloatArray, FloatArray]:
        """Probabilities from 0 to 1, and the values that belong to them [SI]."""
        return self._probability, self._value


def _quantiles(file: InputFile, unit: str) -> tuple[FloatArray, FloatArray]:
    """Return the probabilities and values in a file; raises ScenarioError."""
    if not _has_probabilities(file.text):
        samples = np.sort(read_columns(file.text, file.path, {"value": unit})["value"])
        return _plotted(samples)
    columns = {"probability": "1", "value": unit}
    read = read_columns(file.text, file.path, columns, rising="probability")
    probability, value = read["probability"], read["value"]
    problems = []
    if probability[0] != 0.0 or probability[-1] != 1.0:
        got = f"{probability[0]:g} to {probability[-1]:g}"
        problems.append(Mistake("", "", "column 'probability' must go from 0 to 1", got))
    if np.any(np.diff(value) < 0.0):
        first = int(np.argmax(np.diff(value) < 0.0))
        got = f"{value[first + 1]:g} after {value[first]:g}"
        problems.append(Mistake("", "", "column 'value' must not fall", got))
    if problems:
        raise ScenarioError(file.path, problems)
    return probability, value


def _plotted(samples: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return probabilities and values of rising samples, whose mean is then that of the law.

    Sample i of n stands at (i - 1/2)/n, with level ends beyond the first and the last. From 0 to 1
    in equal steps the two extremes would have half the weight of the others.
    """
    places = (np.arange(len(samples)) + 0.5) / len(samples)
    ends = samples[:1], samples[-1:]
    return np.concatenate([[0.0], places, [1.0]]), np.concatenate([ends[0], samples, ends[1]])


def _has_probabilities(text: str) -> bool:
    """Return whether the header names a column of probabilities."""
    lines = (line.strip() for line in text.lstrip("\ufeff").splitlines())
    header = next((line for line in lines if line and not line.startswith("#")), "")
    names = (cell.split("[")[0].strip(' "') for cell in re.split("[,;\t]", header))
    return "probability" in names


class TableDistribution(Distribution):
    """Quantiles that are linear between those of a table."""

    def __init__(self, options: TableOptions) -> None:
        self._probability, self._value = options.quantiles

    def quantile(self, probability: FloatArray) -> FloatArray:
        """Return the values below which a draw falls with these probabilities, same shape."""
        return np.interp(probability, self._probability, self._value)

    @cached_property
    def support(self) -> tuple[float, float]:
        """Least and greatest value of the table."""
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
