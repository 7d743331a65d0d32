"""The paper's Monte Carlo beside what is found here."""

from __future__ import annotations

import math

import numpy as np

from wearsim.results.dissipation.result import BAND, PAPER_BAND
from wearsim.uq.estimation.moments import Quantile, Summary, converge, summarise
from wearsim_chevalier2005 import paper
from wearsim_chevalier2005.comparison_row import Row, beside, percent
from wearsim_chevalier2005.study import VARIANTS, Reproduction, Variant

_NORMAL_95 = 1.959964  # standard errors to either end of a 95 % interval
_SURE = 4.0  # standard errors that no chance makes up

_TITLES = {
    (False, False): "uniform friction",
    (False, True): "uniform friction, element sum",
    (True, False): "white friction",
    (True, True): "white friction, element sum",
}


def mean_rows(found: Reproduction) -> list[Row]:
    """Return the mean power of every variant."""
    rows = []
    for variant in VARIANTS:
        printed = paper.ALIGNED_MEAN_POWER if variant.aligned else paper.MEAN_POWER
        power = found.spread[variant].summaries["power"]
        which = "no lateral creepage and spin" if variant.aligned else "all inputs random"
        title = _TITLES[variant.white, variant.element_sum]
        rows.append(
            beside(
                f"mean of P_d, {which}",
                title,
                "W",
                printed,
                power.mean,
                _why_mean(found, variant, power),
                power.mean_error,
            )
        )
    return rows


def _why_mean(found: Reproduction, variant: Variant, power: Summary) -> str:
    uniform = Variant(variant.aligned, white=False, element_sum=False)
    less = percent(1.0 - power.mean / found.spread[uniform].summaries["power"].mean)
    if variant.white:
        grid = f"every cell has its own friction, as in the paper: {less} less"
        if variant.element_sum:
            return f"{grid}; both are the paper's choices, as far as it tells them"
        return f"{grid}, and less still on a finer grid"
    if variant.element_sum:
        return f"reads {less} lower"
    if variant.aligned:
        alone = found.aligned.mean_problem_power
        return f"one coefficient per contact; all inputs at their mean give {alone:.4f} W"
    return (
        f"cannot be more than mu N V |creepage|, {float(found.most_power.mean()):.3f} W on average"
    )


def range_rows(found: Reproduction) -> list[Row]:
    """Return between which powers most realisations lie."""
    part = "range of P_d, all inputs random"
    uniform = found.all_inputs.summaries["power"]
    white = found.spread[Variant(aligned=False, white=True, element_sum=True)].summaries["power"]
    rows = [
        ("uniform friction", uniform, BAND, "the middle 95 %; P+ and P- are swapped in print"),
        ("uniform friction", uniform, PAPER_BAND, "eq. 21 cuts 5 % off either end: 90 % are left"),
        ("white friction, element sum", white, BAND, "the mean over the cells varies less"),
    ]
    return [
        beside(
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
    """Return a standard error that would give the quantile's 95 % interval, were it normal."""
    return (quantile.high - quantile.low) / (2.0 * _NORMAL_95)


def convergence_rows(found: Reproduction) -> list[Row]:
    """Return how sure mean and standard deviation are where the paper calls them converged."""
    part, power = "convergence", found.all_inputs.power
    at = min(round(paper.CONVERGED_AT.value), len(power))
    called = ": called converged in print" if at == paper.CONVERGED_AT.value else ""
    settled, whole = converge(power, np.array([at])), found.all_inputs.summaries["power"]
    mean, std = float(settled.mean_error[0]), float(settled.std_error[0])
    place = paper.CONVERGED_AT.place
    return [
        Row(
            part, f"standard error of the mean at {at}", "W", None, place, mean, None,
            f"{percent(mean / whole.mean)} of the mean{called}",
        ),
        Row(
            part, f"standard error of the std at {at}", "W", None, place, std, None,
            f"{percent(std / whole.std)} of the standard deviation",
        ),
        beside(
            part, "realisations for the mean to 1 %", "1", paper.CONVERGED_AT,
            (whole.std / (0.01 * whole.mean)) ** 2, "until its standard error is 1 % of it",
        ),
    ]  # fmt: skip


def bound_rows(found: Reproduction) -> list[Row]:
    """Return how the printed powers stand to the most that the printed inputs can give."""
    part, limit = "most power there can be, mu N V |creepage|", found.most_power
    summary, high = summarise(limit), paper.POWER_RANGE.high
    count, reaching = len(limit), int((limit >= high).sum())
    # as if one more had reached and one more had not, so that none at all is not without error
    smoothed = (reaching + 1.0) / (count + 2.0)
    error = math.sqrt(smoothed * (1.0 - smoothed) / count)
    beyond = (paper.MEAN_POWER.value - summary.mean) / summary.mean_error
    return [
        beside(
            part, "its mean", "W", paper.MEAN_POWER, summary.mean,
            f"the printed mean is {beyond:.0f} standard errors above what its inputs can give"
            if beyond > _SURE else "too few realisations to tell it from the printed mean",
            summary.mean_error,
        ),
        Row(
            part, "its greatest", "W", high, paper.POWER_RANGE.place, summary.greatest, None,
            f"of {count} realisations, against the upper end of the paper's range",
        ),
        beside(
            part, f"realisations that could reach {high:g} W", "%", paper.ABOVE_RANGE,
            reaching / count, "eq. 21 has 5 % of them beyond the upper end of the range", error,
        ),
    ]  # fmt: skip
