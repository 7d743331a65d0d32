"""Comparison of the series of a case with published values, and the verdicts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from wearsim.plugins import ContactModelSpec, registry
from wearsim.types import BoolArray, FloatArray
from wearsim_validation.case import VERDICTS, Case, Series, Verdict
from wearsim_validation.compute import computed, sampled_depths, scenario_of, wear_rate

OnProgress = Callable[[str], None]
_SIGMA = 1.96
_MOST_TESTS = 20_000  # sets of tests that are drawn


@dataclass
class Comparison:
    """A series with its computed values, in the units of the published ones.

    Parameters
    ----------
    series : Series
    unit, x_unit : str
        Units of the published values and of x.
    x, published : ndarray, shape (rows,)
    columns : dict of str to ndarray
        Computed values by the name of the computation, that of the case first.
    spread : ndarray, shape (2, rows), optional
        Least and greatest values by what is not published.
    fits : dict of str to list
        Fitted value for each row (None where there is none), by key.
    facts : list of str
        Findings in words, below the table.
    verdict : str
        A key of `VERDICTS`.
    """

    series: Series
    unit: str
    x_unit: str
    x: FloatArray
    published: FloatArray
    columns: dict[str, FloatArray] = field(default_factory=dict)
    spread: FloatArray | None = None
    fits: dict[str, list[float | None]] = field(default_factory=dict)
    facts: list[str] = field(default_factory=list)
    verdict: Verdict = "misfit"

    @property
    def counts(self) -> BoolArray:
        """Whether each row counts for the verdict."""
        begins = self.series.begins
        return np.isfinite(self.published) & (self.x >= (-np.inf if begins is None else begins))

    def as_json(self) -> dict[str, Any]:
        """Return the comparison as JSON types."""
        return {
            "series": self.series.name,
            "x": {"name": self.series.x, "unit": self.x_unit, "values": self.x},
            "published": {"unit": self.unit, "values": self.published},
            "reading_error": self.series.reading_error,
            "computed": self.columns,
            "spread": self.spread,
            "fits": self.fits,
            "facts": self.facts,
            "verdict": self.verdict,
        }


@dataclass
class Outcome:
    """The comparisons of a case, and its verdict: the worst of them."""

    case: Case
    comparisons: list[Comparison]
    notes: list[str]

    @property
    def verdict(self) -> Verdict:
        """Worst verdict of the series."""
        order = list(VERDICTS)
        return max((comparison.verdict for comparison in self.comparisons), key=order.index)

    @property
    def expected(self) -> bool:
        """Whether the verdict is the one that the case records."""
        return self.verdict == self.case.file.verdict

    def as_json(self) -> dict[str, Any]:
        """Return the outcome as JSON types."""
        file = self.case.file
        return {
            "title": file.title,
            "source": file.source,
            "read": file.read,
            "reasons": file.reasons,
            "verdict": self.verdict,
            "as_recorded": self.expected,
            "notes": self.notes,
            "series": [comparison.as_json() for comparison in self.comparisons],
        }


def compare(case: Case, on_progress: OnProgress) -> Outcome:
    """Compute a case and compare it with its published values."""
    installed = registry().names(ContactModelSpec)
    notes = [
        f"without '{variant.name}': contact model '{variant.needs}' is not installed"
        for variant in case.file.variant
        if variant.needs and variant.needs not in installed
    ]
    comparisons = []
    for series in case.file.series:
        on_progress(series.name)
        x, published = case.columns[series.x], case.columns[series.published]
        comparison = Comparison(series, published.unit, x.unit, x.values, published.values)
        if case.file.kind == "ensemble":
            depths = sampled_depths(case, series) / published.si
            _judge_depths(comparison, depths)
            _add_wear_factor(comparison, depths, wear_rate(scenario_of(case, series)))
        else:
            values = partial(_values, case, series)
            comparison.columns["computed"] = values(None)
            for variant in case.file.variant:
                if not variant.needs or variant.needs in installed:
                    on_progress(f"{series.name}, {variant.name}")
                    comparison.columns[variant.name] = values(variant)
            if case.file.uncertain:
                on_progress(f"{series.name}, what is not published")
                comparison.spread = _spread(case, comparison, values)
            if case.file.fit:
                on_progress(f"{series.name}, fit")
                _fit(case, comparison, values)
            _judge(comparison)
        comparisons.append(comparison)
    return Outcome(case, comparisons, notes)


def _values(case: Case, series: Series, variant: Any, changes: Any = None) -> FloatArray:
    si = case.columns[series.published].si
    return np.asarray(computed(case, series, variant, changes) / si)


def _spread(case: Case, comparison: Comparison, values: Callable[..., FloatArray]) -> FloatArray:
    """Return the ends of the computed values, the inputs varied one at a time.

    The changes are added as independent ones, by their squares.
    """
    middle, below, above = comparison.columns["computed"], 0.0, 0.0
    for item in case.file.uncertain:
        change = np.array([values(None, item.low), values(None, item.high)]) - middle
        below = below + np.minimum(change.min(axis=0), 0.0) ** 2
        above = above + np.maximum(change.max(axis=0), 0.0) ** 2
    return np.array([middle - np.sqrt(below), middle + np.sqrt(above)])


def _fit(case: Case, comparison: Comparison, values: Callable[..., FloatArray]) -> None:
    """Fit a value of the scenario to each of the first rows, and to all of them together."""
    from scipy.optimize import minimize_scalar  # noqa: PLC0415

    fit = case.file.fit
    assert fit is not None
    rows = np.flatnonzero(comparison.x <= fit.upto)
    grid = np.linspace(fit.low, fit.high, 9)
    table = np.array([np.log(values(None, {fit.key: float(point)})[rows]) for point in grid])
    target = np.log(comparison.published[rows])
    row_fits: list[float | None] = [None] * len(comparison.x)

    def predicted(parameter: float) -> FloatArray:
        return np.array([np.interp(parameter, grid, column) for column in table.T])

    for place, row in enumerate(rows):
        differences = table[:, place] - target[place]
        if differences[0] * differences[-1] < 0.0:
            row_fits[row] = float(np.interp(0.0, *_rising(differences, grid)))
    best = minimize_scalar(
        lambda parameter: float(((predicted(parameter) - target) ** 2).sum()),
        bounds=(fit.low, fit.high),
        method="bounded",
    )
    comparison.fits[fit.key] = row_fits
    comparison.columns[f"{fit.key} {best.x:.2f}"] = values(None, {fit.key: float(best.x)})
    misfits = np.expm1(predicted(best.x) - target)
    comparison.facts.append(
        f"best single {fit.key} for these {len(rows)} rows: {best.x:.2f}, which misses them by "
        + ", ".join(f"{100.0 * part:+.0f} %" for part in misfits)
    )
    fitted = [value for value in row_fits if value is not None]
    if fitted:
        comparison.facts.append(
            f"{fit.key} by which each row agrees: "
            + ", ".join(f"{value:.2f}" for value in fitted)
            + f"; one value for all is {'not ' if np.ptp(fitted) > 0.05 else ''}enough"
        )


def _rising(differences: FloatArray, grid: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return differences in rising order, and the points of the grid that belong to them."""
    order = np.argsort(differences)
    return differences[order], grid[order]


def exponent(x: FloatArray, values: FloatArray, error: float = 0.0) -> tuple[float, float]:
    """Return the exponent of a power law through values, and its standard error by reading.

    Parameters
    ----------
    x, values : ndarray, shape (rows,)
    error : float
        Standard deviation of the values.
    """
    place = np.log(x) - np.log(x).mean()
    weight = place / (place @ place)
    return float(weight @ np.log(values)), float(np.sqrt(((weight * error / values) ** 2).sum()))


def _judge(comparison: Comparison) -> None:
    """Set the verdict, and add the facts that it follows from."""
    series, rows = comparison.series, comparison.counts
    values, published = comparison.columns["computed"][rows], comparison.published[rows]
    difference = values - published
    relative = difference / published
    begins = "" if series.begins is None else f"from {series.x} {series.begins:g} on "
    range_ = f"{100.0 * relative.min():+.1f} to {100.0 * relative.max():+.1f} %"
    if len(relative) == 1:
        range_ = f"{100.0 * relative[0]:+.1f} %"
    comparison.facts.insert(0, f"{begins}computed less published: {range_}")
    verdicts = [_judge_values(series, difference, relative)]
    limits = {
        "the reading error": series.reading_error,
        "the stated scatter": series.scatter,
        f"{100.0 * (series.tolerance or 0.0):g} %": series.tolerance,
    }
    asked = [words for words, value in limits.items() if value is not None]
    if verdicts == ["not"]:
        comparison.facts[0] += f": not within {asked[-1]}"
    elif asked:
        comparison.facts[0] += f": {VERDICTS[verdicts[0]]}" + (", " + asked[-1]) * (
            verdicts == ["tolerance"]
        )
    if series.exponent:
        verdicts.append(_judge_exponent(comparison, rows))
    if comparison.spread is not None:
        _add_spread(comparison, rows)
    comparison.verdict = max(verdicts, key=list(VERDICTS).index)


def _judge_values(series: Series, difference: FloatArray, relative: FloatArray) -> Verdict:
    """Return the best verdict that holds for all values."""
    low, high = series.scatter or (0.0, 0.0)
    holds: dict[Verdict, bool] = {
        "reading error": bool((np.abs(difference) <= (series.reading_error or 0.0)).all()),
        "scatter": bool(((relative >= low) & (relative <= high)).all()),
        "tolerance": bool((np.abs(relative) <= (series.tolerance or 0.0)).all()),
    }
    limits = series.reading_error, series.scatter, series.tolerance
    asked = [name for name, value in zip(holds, limits, strict=True) if value is not None]
    best: list[Verdict] = [name for name in asked if holds[name]]
    return best[0] if best else "not" if asked else "misfit"


def _judge_exponent(comparison: Comparison, rows: BoolArray) -> Verdict:
    """Return whether the exponents agree within twice the error of reading, and add them."""
    # the reading error bounds a uniformly distributed error
    error = (comparison.series.reading_error or 0.0) / np.sqrt(3.0)
    x = comparison.x[rows]
    published, sigma = exponent(x, comparison.published[rows], error)
    exponents = {name: exponent(x, column[rows])[0] for name, column in comparison.columns.items()}
    text = ", ".join(f"{value:.3f} {name}" for name, value in exponents.items())
    margin = _SIGMA * sigma
    agrees = abs(exponents["computed"] - published) <= margin
    comparison.facts.append(
        f"exponent: {published:.3f} ± {margin:.3f} published, {text}:"
        f" {'' if agrees else 'not '}within the reading error"
    )
    return "reading error" if agrees else "not"


def _add_spread(comparison: Comparison, rows: BoolArray) -> None:
    assert comparison.spread is not None
    low, high = comparison.spread[:, rows]
    published = comparison.published[rows]
    inside = int(((low <= published) & (published <= high)).sum())
    comparison.facts.append(
        f"{inside} of {len(published)} rows are within the range of what is not published"
    )


def _add_wear_factor(comparison: Comparison, depths: FloatArray, factor: float) -> None:
    """Add the wear factor of the tests, from that of the computed ones.

    Depths grow with its power 2/3, as of rigid bodies in full slip.
    """
    ratio = np.exp(1.5 * (np.log(comparison.published).mean() - np.log(depths).mean()))
    text = f"{1e9 * factor * ratio:.2g} mm^3/J, by the dissipated energy that is computed"
    comparison.facts.append(f"K/H of the tests: about {text}")


def _judge_depths(comparison: Comparison, depths: FloatArray) -> None:
    """Compare measured depths with those of tests with random inputs.

    The wear factor is not known: depths are scaled so that the means of their logarithms agree.
    By tests drawn from the computed ones follow the probability of a depth as far from the median,
    and that of a scatter as great in as many tests.
    """
    logarithms, sample = np.log(comparison.published), np.log(depths)
    sample = sample - sample.mean() + logarithms.mean()
    comparison.columns["median"] = np.full(len(logarithms), np.exp(np.median(sample)))
    below = np.array([(sample <= value).mean() for value in logarithms])
    two_sided = 2.0 * np.minimum(below, 1.0 - below)
    comparison.fits["probability of a depth as far off"] = two_sided.tolist()
    draws = np.random.default_rng(1).choice(sample, (_MOST_TESTS, len(logarithms)))
    p = float((draws.std(axis=1, ddof=1) >= logarithms.std(ddof=1)).mean())
    measured, drawn = logarithms.std(ddof=1), sample.std(ddof=1)
    comparison.facts += [
        f"standard deviation of ln(depth): {measured:.3f} of the tests, {drawn:.3f} by the inputs",
        f"probability of a scatter as great in {len(logarithms)} tests: {p:.2f}",
    ]
    comparison.verdict = "scatter" if p > 0.05 and two_sided.min() > 0.05 else "not"
