"""An ensemble as tables: its realisations, the courses of its tests, and the mean profile."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from wearsim.results import csv_text
from wearsim.results.csv_text import Column
from wearsim.results.ensemble_data import EnsembleData
from wearsim.results.ensemble_layout import FAILED, OBSERVABLES, PENDING
from wearsim.results.ensemble_result import EnsembleResult
from wearsim.types import FloatArray

_BLOCK = 16384  # realisations in memory at a time
_OF_EACH = ("steps", "solves", "depth_error", "volume_error", "control")


def ensemble_tables(result: EnsembleResult) -> Mapping[str, Iterator[str]]:
    """Return the tables of an ensemble in pieces, by the name of the file each goes into.

    Parameters
    ----------
    result : EnsembleResult

    Returns
    -------
    mapping of str to iterator of str
    """
    tables = {"realisations.csv": _realisations(result.raw)}
    if result.count:
        tables["courses.csv"] = iter([csv_text.table(_courses(result))])
        tables["profile.csv"] = iter([csv_text.table(_profile(result))])
    if result.failed:
        cells = [(str(number), text) for number, text in result.errors.items()]
        tables["failures.csv"] = iter([csv_text.text_table(("realisation", "error"), cells)])
    return tables


def _realisations(raw: EnsembleData) -> Iterator[str]:
    """Yield what was drawn for each realisation and what came of it, those that failed with nan."""
    for start in range(0, raw.asked, _BLOCK):
        stop = min(start + _BLOCK, raw.asked)
        titles, values = zip(*_block(raw, start, stop), strict=True)
        if start == 0:
            yield csv_text.head(titles)
        yield csv_text.rows(np.column_stack(values)[raw.status[start:stop] != PENDING])


def _block(raw: EnsembleData, start: int, stop: int) -> Iterator[Column]:
    failed = raw.status[start:stop] == FAILED
    yield "realisation", np.arange(start, stop, dtype=np.float64)
    yield "failed", failed.astype(np.float64)
    for item in raw.inputs:
        values = raw.rows(item["key"], start, stop)
        unit, size = csv_text.unit_of_drawn(item["unit"])
        for name, column in _per_roller(item["key"], values):
            yield csv_text.title(name, unit), column / size
    for name, variable in OBSERVABLES.items():
        unit, size = csv_text.unit_of(name, variable.unit)
        yield (
            csv_text.title(name, unit),
            _of_good(raw.rows(name, start, stop)[:, -1] / size, failed),
        )
    for name in _OF_EACH:
        if name in raw.layout.variables:
            unit, size = csv_text.unit_of(name, raw.layout.variables[name].unit)
            yield csv_text.title(name, unit), _of_good(raw.rows(name, start, stop) / size, failed)


def _of_good(values: FloatArray, failed: FloatArray) -> FloatArray:
    return np.where(failed, np.nan, values)


def _per_roller(name: str, values: FloatArray) -> Iterator[Column]:
    if values.ndim == 1:
        yield name, values
        return
    for roller in range(values.shape[1]):
        yield f"{name} roller {roller + 1}", values[:, roller]


def _courses(result: EnsembleResult) -> Iterator[Column]:
    """Yield what the realisations tell of each observable at every record."""
    yield "passes", result.record_passes
    yield "time [min]", result.record_time / 60.0
    for name, variable in OBSERVABLES.items():
        unit, size = csv_text.unit_of(name, variable.unit)
        course = result.course(name)
        columns = {
            "mean": course.mean,
            "mean low": course.mean_low,
            "mean high": course.mean_high,
            "std": course.std,
            **{f"{100.0 * p:g} %": values for p, values in course.quantiles.items()},
        }
        for ending, values in columns.items():
            yield csv_text.title(f"{name} {ending}", unit), values / size


def _profile(result: EnsembleResult) -> Iterator[Column]:
    """Yield mean and band of the worn depth at the end over the strips."""
    band = result.band()
    yield "y [mm]", band.y / 1e-3
    for name in ("mean", "std", "low", "high"):
        yield f"depth {name} [um]", getattr(band, name) / 1e-6
