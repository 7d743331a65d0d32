"""Lives that end by wear or by pitting: courses of the damage, and what they give together."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.evolution.limits import OF_FATIGUE
from wearsim.report.text import NOTHING, count, rounded_lives, shown
from wearsim.report.view import Row, Rows
from wearsim.studies.fatigue.view import source_rows, sources
from wearsim.types import FloatArray
from wearsim.uq.estimation.intervals import Interval
from wearsim.uq.survival.competing import CompetingRisks, course_places

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
    logs = PchipInterpolator(np.log(passes), np.log(damage))(np.log(places))
    return np.asarray(np.exp(logs))


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


def lives_of(result: LifeValues, share: float) -> dict[str, float] | None:
    """Return lives of a share with wear and pitting, without wear and without pitting.

    Parameters
    ----------
    result : LifeValues
    share : float
        0.1 for B10.

    Returns
    -------
    dict of str to float
        In the unit of lives; infinite if the share is never reached. None without fatigue.
    """
    risks = competing_risks(result)
    if risks is None:
        return None
    scale = 1.0 / result.settings.per_unit
    incidences = {
        "both": risks.either,
        "without_wear": risks.without_wear,
        "without_pitting": _without_pitting(risks),
        "pitting": lambda life: risks.at(life).pitting,
        "wear": lambda life: risks.at(life).wear,
    }
    return {name: scale * risks.life(share, incidence) for name, incidence in incidences.items()}


def _without_pitting(risks: CompetingRisks) -> Callable[[float], float]:
    """Return the probability of wear before a life, of bodies that do not pit."""
    never = replace(risks, damage=np.zeros_like(risks.damage))
    return lambda life: never.at(life).wear


def competing_data(result: LifeValues) -> dict[str, Any]:
    """Return wear and pitting of a study of lives for JSON; nothing without fatigue."""
    risks = competing_risks(result)
    if risks is None:
        return {}
    level = risks.at(math.inf)
    shares = result.settings.shares
    return {
        "wear_or_pitting": {
            "lives": {f"b{share:g}": lives_of(result, share / 100.0) for share in shares},
            "other_end": other_end(result.scenario),
            "first_by_pitting": level.pitting,
            "first_by_wear": level.wear,
            "sources": sources(result.scenario),
        }
    }


def competing_table(
    result: LifeValues, life_of_share: Callable[[float], Interval]
) -> tuple[list[str], list[list[str]]] | None:
    """Return heads and cells of the table of wear and pitting; None without fatigue.

    Lives have the digits that the interval of `life_of_share`, of a share in percent, leaves.
    """
    risks = competing_risks(result)
    if risks is None:
        return None
    shares = sorted(result.settings.shares, key=lambda share: share != 10.0)
    lives = [lives_of(result, share / 100.0) for share in shares]
    intervals = [life_of_share(share) for share in shares]
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
                _life(lives_of_share[name], interval)
                for lives_of_share, interval in zip(lives, intervals, strict=True)
                if lives_of_share is not None
            ),
            NOTHING if last is None else shown(last, "%", 3),
        ]
        for name, (words, last) in names.items()
    ]
    return [f"life [{result.unit}]", *(f"B{share:g}" for share in shares), "at last"], cells


def _life(life: float, interval: Interval) -> str:
    """Return a life with the digits of another one, or two where that has no interval."""
    if math.isinf(life):
        return "infinite"
    part = interval.half_width / interval.value if interval.value > 0.0 else math.nan
    part = min(part, 1.0) if math.isfinite(part) else 1.0
    return rounded_lives((1.0 - part) * life, life, (1.0 + part) * life)[1]


def fatigue_of_lives(result: LifeValues) -> Rows:
    """Return rows on the fatigue of the bodies in a study of lives; none without it."""
    if not result.raw.fatigue:
        return []
    first = competing_risks(result)
    rows = source_rows(result.scenario)
    if first is not None:
        part = first.at(result.most * result.settings.per_unit)
        text = (
            f"{shown(part.pitting, '%', 3)} by pitting and {shown(part.wear, '%', 3)} by"
            f" {other_end(result.scenario)} within {count(result.most)} {result.unit}"
        )
        rows.insert(0, Row("first end", text))
    return rows
