"""Comparison of the Monte Carlo study."""

from __future__ import annotations

import math

import numpy as np

from wearsim.studies.dissipation.result import BAND, PAPER_BAND
from wearsim.uq.estimation.moments import Quantile, Summary, converge, summarise
from wearsim_chevalier2005 import paper
from wearsim_chevalier2005.comparison_row import Row, percent, printed_row
from wearsim_chevalier2005.study import VARIANTS, Reproduction, Variant

_NORMAL_95 = 1.959964  # half-width of a 95 % interval in standard errors
_SIGNIFICANT = 4.0  # standard errors of a significant difference

_TITLES = {
    (False, False): "uniform friction",
    (False, True): "uniform friction, element sum",
    (True, False): "white friction",
    (True, True): "white friction, element sum",
}


def mean_rows(results: Reproduction) -> list[Row]:
    """Return the rows of the mean power of all variants."""
    rows = []
    for variant in VARIANTS:
        printed = paper.ALIGNED_MEAN_POWER if variant.aligned else paper.MEAN_POWER
        power = results.spread[variant].summaries["power"]
        inputs = "no lateral creepage and spin" if variant.aligned else "all inputs random"
        title = _TITLES[variant.white, variant.element_sum]
        rows.append(
            printed_row(
                f"mean of P_d, {inputs}",
                title,
                "W",
                printed,
                power.mean,
                _why_mean(results, variant, power),
                power.mean_error,
            )
        )
    return rows


def _why_mean(results: Reproduction, variant: Variant, power: Summary) -> str:
    uniform = Variant(variant.aligned, white=False, element_sum=False)
    less = percent(1.0 - power.mean / results.spread[uniform].summaries["power"].mean)
    if variant.white:
        grid = f"independent friction in every cell, as in the paper: {less} less"
        if variant.element_sum:
            return f"{grid}; both are the choices of the paper, as far as stated"
        return f"{grid}, and even less on a finer grid"
    if variant.element_sum:
        return f"{less} lower"
    if variant.aligned:
        power_at_mean = results.aligned.mean_problem_power
        return f"one coefficient per contact; {power_at_mean:.4f} W with all inputs at their mean"
    return f"bounded by mu N V |creepage|, {float(results.max_power.mean()):.3f} W on average"


def range_rows(results: Reproduction) -> list[Row]:
    """Return the rows of the range of the power."""
    part = "range of P_d, all inputs random"
    uniform = results.all_inputs.summaries["power"]
    white = results.spread[Variant(aligned=False, white=True, element_sum=True)].summaries["power"]
    rows = [
        ("uniform friction", uniform, BAND, "central 95 %; P+ and P- are swapped in print"),
        ("uniform friction", uniform, PAPER_BAND, "eq. 21 removes 5 % at either end: 90 % remain"),
        ("white friction, element sum", white, BAND, "the mean over the cells varies less"),
    ]
    return [
        printed_row(
            part,
            f"{100.0 * low:g} to {100.0 * high:g} %, {title}",
            "W",
            paper.POWER_RANGE,
            (power.quantile(low).value, power.quantile(high).value),
            why,
            (_error(power.quantile(low)), _error(power.quantile(high))),
        )
        for title, power, (low, high), why in rows
    ]


def _error(quantile: Quantile) -> float:
    """Return the standard error of a normal estimate with the 95 % interval of the quantile."""
    return (quantile.high - quantile.low) / (2.0 * _NORMAL_95)


def convergence_rows(results: Reproduction) -> list[Row]:
    """Return the rows of the errors at the number of realisations given in the paper."""
    part, power = "convergence", results.all_inputs.power
    at = min(round(paper.CONVERGED_AT.value), len(power))
    called = ": called converged in print" if at == paper.CONVERGED_AT.value else ""
    estimates, summary = converge(power, np.array([at])), results.all_inputs.summaries["power"]
    mean, std = float(estimates.mean_error[0]), float(estimates.std_error[0])
    place = paper.CONVERGED_AT.place
    return [
        Row(
            part, f"standard error of the mean at {at}", "W", None, place, mean, None,
            f"{percent(mean / summary.mean)} of the mean{called}",
        ),
        Row(
            part, f"standard error of the std at {at}", "W", None, place, std, None,
            f"{percent(std / summary.std)} of the standard deviation",
        ),
        printed_row(
            part, "realisations for the mean to 1 %", "1", paper.CONVERGED_AT,
            (summary.std / (0.01 * summary.mean)) ** 2, "for a standard error of 1 % of the mean",
        ),
    ]  # fmt: skip


def bound_rows(results: Reproduction) -> list[Row]:
    """Return the rows that compare the printed powers with the upper bound."""
    part, limit = "upper bound of the power, mu N V |creepage|", results.max_power
    summary, high = summarise(limit), paper.POWER_RANGE.high
    count, reaching = len(limit), int((limit >= high).sum())
    # one success and one failure added, so that the standard error of zero counts is not zero
    smoothed = (reaching + 1.0) / (count + 2.0)
    error = math.sqrt(smoothed * (1.0 - smoothed) / count)
    beyond = (paper.MEAN_POWER.value - summary.mean) / summary.mean_error
    return [
        printed_row(
            part, "mean", "W", paper.MEAN_POWER, summary.mean,
            f"the printed mean is {beyond:.0f} standard errors above this upper bound"
            if beyond > _SIGNIFICANT
            else "too few realisations to distinguish it from the printed mean",
            summary.mean_error,
        ),
        Row(
            part, "largest", "W", high, paper.POWER_RANGE.place, summary.greatest, None,
            f"of {count} realisations, compared with the upper end of the range in the paper",
        ),
        printed_row(
            part, f"realisations that could reach {high:g} W", "%", paper.ABOVE_RANGE,
            reaching / count, "in eq. 21, 5 % are above the upper end of the range", error,
        ),
    ]  # fmt: skip
