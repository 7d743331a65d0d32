"""Fitted distributions of lives as tables and as data for JSON."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from wearsim.report.text import NOTHING, cells, rounded_lives, shown
from wearsim.report.view import Table
from wearsim.studies.life.result import LifeResult
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.survival.fits import FittedLives
from wearsim.uq.survival.goodness import AndersonDarling, anderson_darling

_SMALL = 0.01  # probability below which it is not stated
_SIGMAS = 1.96  # of a normal distribution, half-width of an interval of 95 %
_AT_SCALE = -math.expm1(-1.0)  # probability of a life below the scale parameter of Weibull


def fit_tables(result: LifeResult) -> list[Table]:
    """Return the fitted distributions, best first, and how well the drawn lives agree."""
    lives = [f"B{share:g}" for share in result.settings.shares]
    tables, exact = list[Table](), result.integrated_fits
    if exact:
        lines = [[*_cells(result, fit, exact[0]), shown(fit.difference, "%", 2)] for fit in exact]
        head = f"fit to lives with exact K/H [{result.unit}]"
        tables.append(Table("", lines, [head, *lives, "AIC", "parameters", "greatest difference"]))
    if len(result.fits) >= 2:
        lines = [
            [*_cells(result, fit, result.fits[0]), _test_text(anderson_darling(fit))]
            for fit in result.fits
        ]
        head = f"fit{' to drawn lives' if exact else ''} [{result.unit}]"
        tables.append(Table("", lines, [head, *lives, "AIC", "parameters", "Anderson-Darling"]))
    return tables


def _cells(result: LifeResult, fit: FittedLives, best: FittedLives) -> list[str]:
    """Return the cells of a fit: lives with intervals, AIC above the best one, parameters."""
    lives = [_life(fit, share / 100.0) for share in result.settings.shares]
    return [fit.family, *lives, f"{fit.aic - best.aic:+.1f}", _parameters(fit)]


def _life(fit: FittedLives, probability: float) -> str:
    """Return a quantile with its 95 % interval."""
    life = fit.interval(probability)
    low, value, high = rounded_lives(life.low, life.value, life.high)
    return value if life.low == life.high else f"{value} ({low}..{high})"


def _parameters(fit: FittedLives) -> str:
    """Return the parameters of a fit with 95 % intervals."""
    factor = math.exp(_SIGMAS * math.sqrt(max(float(fit.covariance[1, 1]), 0.0)))
    if fit.family == "log-normal":
        location, name, value = f"median {_life(fit, 0.5)}", "sigma", fit.sigma
    else:
        location, name, value = f"scale {_life(fit, _AT_SCALE)}", "shape", 1.0 / fit.sigma
    text, interval = cells(Interval(value, value / factor, value * factor), "1")
    return f"{location}, {name} {text}" + (f" ({interval})" if interval else "")


def _test_text(test: AndersonDarling | None) -> str:
    if test is None:
        return NOTHING
    chance = f"{test.probability:.2f}" if test.probability >= _SMALL else f"below {_SMALL:g}"
    return f"{test.statistic:.2f}, p {'=' if test.probability >= _SMALL else 'is'} {chance}"


def fits_data(result: LifeResult) -> dict[str, Any]:
    """Return the fits to the drawn lives, and with K/H integrated exactly."""

    def numbers(fit: FittedLives) -> dict[str, Any]:
        lives = {
            f"{share:g}": asdict(fit.interval(share / 100.0)) for share in result.settings.shares
        }
        return {
            "family": fit.family, "aic": fit.aic, "mu": fit.mu, "sigma": fit.sigma, "b": lives
        }  # fmt: skip

    tests = [anderson_darling(fit) for fit in result.fits]
    return {
        "fits": [
            {**numbers(fit), "anderson_darling": test._asdict() if test else None}
            for fit, test in zip(result.fits, tests, strict=True)
        ],
        "fits_with_exact_wear_factor": [
            {**numbers(fit), "greatest_difference": fit.difference}
            for fit in result.integrated_fits
        ],
    }
