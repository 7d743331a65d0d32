"""Lives that end by wear or by pitting: courses of the damage, and what they give together."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.evolution.limits import OF_FATIGUE
from wearsim.report.text import NOTHING, count, rounded_lives, shown
from wearsim.report.view import Row, Rows
from wearsim.studies.fatigue.view import source_rows, sources
from wearsim.types import FloatArray
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.survival.competing import Cause, CompetingRisks, course_places

if TYPE_CHECKING:
    from wearsim.scenario import Scenario
    from wearsim.studies.life.values import LifeValues

_LEAST = 1e-9  # passes at the end of a course, at least: a limit may be reached at once


def course_of(
    known: Sequence[tuple[float, float]], end: tuple[float, float], rate: float
) -> FloatArray:
    """Return the damage along a test at `course_places` of its end.

    Parameters
    ----------
    known : sequence of (float, float)
        Passes and damage after each step.
    end : (float, float)
        The same at the end, where a limit is reached within a step.
    rate : float
        Damage per pass before wear.
    """
    from scipy.interpolate import PchipInterpolator  # noqa: PLC0415  (slow to load)

    points = [(n, d) for n, d in known if 0.0 < n < end[0] and d > 0.0]
    points += [end] if end[0] > 0.0 and end[1] > 0.0 else []
    places = max(end[0], _LEAST) * course_places()
    if not points or rate <= 0.0:
        return np.asarray(rate * places)
    first = 1e-3 * min(points[0][0], places[0])
    passes, damage = np.array([(first, rate * first), *points]).T
    return np.asarray(np.exp(PchipInterpolator(np.log(passes), np.log(damage))(np.log(places))))


def other_end(scenario: Scenario) -> str:
    """Return the causes other than pitting that end lives: "wear", "a limit of damage", or both."""
    given = scenario.limit.given
    wear = ["wear"] if given.keys() - set(OF_FATIGUE) else []
    return " or ".join([*wear, *(f"a limit of {name}" for name in OF_FATIGUE if name in given)])


def competing_risks(result: LifeValues) -> CompetingRisks | None:
    """Return wear and pitting of a study of lives; None without fatigue or completed tests."""
    choice = result.scenario.fatigue if result.raw.fatigue and result.count else None
    if choice is None:
        return None
    values = {
        name: result.values(name)
        for name in ("damage_course", "course_end", "damage_per_pass", "life", "score_mean")
    }
    settings = result.settings
    exact: dict[str, Any] = (
        {
            "score": result.score,
            "reference": settings.reference,
            "shift": values["score_mean"],
            "spread": settings.spread,
        }
        if result.is_exact
        else {}
    )
    return CompetingRisks(
        damage=values["damage_course"],
        end=np.maximum(values["course_end"], _LEAST),
        worn=np.isfinite(values["life"]),
        rate=values["damage_per_pass"],
        slope=choice.slope,
        probability=choice.probability,
        **exact,
    )


def lives_of(result: LifeValues, share: float) -> dict[str, Interval]:
    """Return lives of a share with wear and pitting, without wear and without pitting.

    Parameters
    ----------
    result : LifeValues
    share : float
        0.1 for B10.

    Returns
    -------
    dict of str to Interval
        In the unit of lives; infinite if the share is never reached, nan beyond the censoring. With
        a posterior of the wear factor the intervals are unknown. Empty without fatigue.
    """
    risks = competing_risks(result)
    if risks is None:
        return {}
    per_unit, all_worn = result.settings.per_unit, bool(risks.worn.all())

    def of(cause: Cause) -> Interval:
        life = risks.life(share, cause)
        return Interval(life.value / per_unit, life.low / per_unit, life.high / per_unit)

    lives = {
        "both": of("both"),
        "without_wear": of("without_wear"),
        "without_pitting": result.distribution.quantile(share),
        "pitting": of("pitting"),
        "wear": of("wear"),
    }
    for name, life in lives.items():
        known = Interval(life.value, 0.0, math.inf) if result.levels else life
        # the courses of tests that end without wear end there too
        beyond = not all_worn and name != "without_wear"
        lives[name] = known.censored(result.most) if beyond else known
    return lives


def competing_data(result: LifeValues) -> dict[str, Any]:
    """Return wear and pitting of a study of lives for JSON; nothing without fatigue."""
    risks = competing_risks(result)
    if risks is None:
        return {}
    level = risks.at(math.inf)
    lives = {f"b{share:g}": lives_of(result, share / 100.0) for share in result.settings.shares}
    return {
        "wear_or_pitting": {
            "lives": {
                share: {name: life.value for name, life in of_share.items()}
                for share, of_share in lives.items()
            },
            "intervals": {
                share: {name: [life.low, life.high] for name, life in of_share.items()}
                for share, of_share in lives.items()
            },
            "other_end": other_end(result.scenario),
            "first_by_pitting": level.pitting,
            "first_by_wear": level.wear,
            "sources": sources(result.scenario),
        }
    }


def competing_table(
    result: LifeValues, error_of_share: Callable[[float], tuple[float, float]]
) -> tuple[list[str], list[list[str]]] | None:
    """Return heads and cells of the table of wear and pitting; None without fatigue.

    Lives without a sampling interval have the digits that the numerical error of `error_of_share`,
    of a share in percent, leaves.
    """
    risks = competing_risks(result)
    if risks is None:
        return None
    shares = sorted(result.settings.shares, key=lambda share: share != 10.0)
    lives = [lives_of(result, share / 100.0) for share in shares]
    errors = [error_of_share(share) for share in shares]
    level, other = risks.at(math.inf), other_end(result.scenario)
    names = {
        "both": (f"{other} or pitting", 1.0 - level.survival),
        "without_wear": ("pitting, of bodies that do not wear", None),
        "without_pitting": (f"{other}, of bodies that do not pit", None),
        "pitting": ("pitting first", level.pitting),
        "wear": (f"{other} first", level.wear),
    }
    cells = [
        [
            words,
            *(
                _cell(of_share[name], error, result.most)
                for of_share, error in zip(lives, errors, strict=True)
            ),
            NOTHING if last is None else shown(last, "%", 3),
        ]
        for name, (words, last) in names.items()
    ]
    return [f"life [{result.unit}]", *(f"B{share:g}" for share in shares), "at last"], cells


def _cell(life: Interval, error: tuple[float, float], most: float) -> str:
    """Return a life with its interval; `error` is another one at its numerical bounds."""
    low, value, high = rounded_lives(life.low, life.value, life.high)
    if math.isnan(life.value):
        return f"above {count(most)}"
    if math.isinf(life.value):
        return f"infinite [from {low}]" if 0.0 < life.low < math.inf else "infinite"
    if life.low == life.high:
        part = (error[1] - error[0]) / (error[1] + error[0]) if error[0] > 0.0 else 0.0
        return rounded_lives((1.0 - part) * life.value, life.value, (1.0 + part) * life.value)[1]
    if life.low > 0.0 or math.isfinite(life.high):
        return f"{value} [{low}..{high}]" if math.isfinite(life.high) else f"{value} [from {low}]"
    return rounded_lives(0.0, life.value)[1]  # two digits, as the interval is not known


def fatigue_of_lives(result: LifeValues) -> Rows:
    """Return rows on the fatigue of the bodies in a study of lives; none without it."""
    if not result.raw.fatigue:
        return []
    first = competing_risks(result)
    rows = source_rows(result.scenario)
    if first is not None:
        part = first.at(result.most * result.settings.per_unit)
        rows.insert(
            0,
            Row(
                "first end",
                f"{shown(part.pitting, '%', 3)} by pitting and {shown(part.wear, '%', 3)} by"
                f" {other_end(result.scenario)} within {count(result.most)} {result.unit}",
            ),
        )
    return rows
