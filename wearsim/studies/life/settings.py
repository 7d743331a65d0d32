"""Arguments of a study of lives: limits, targets in passes and time, tests for rare events."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from wearsim.arguments import ArgumentError, checking_argument
from wearsim.errors import mistake_in
from wearsim.evolution.limits import OF_LIFE, Limit
from wearsim.quantities import NUMBER, quantity
from wearsim.scenario import Scenario
from wearsim.studies.ensemble.api import checked_request
from wearsim.studies.life.factor import exact_factor
from wearsim.studies.life.rare.draws import LEAST_TESTS, shifted_inputs
from wearsim.studies.life.realisation import with_length
from wearsim.studies.life.stored_settings import DesignVariable, LifeSettings, life_target
from wearsim.units import QuantityError, kind_of
from wearsim.uq.estimation.estimates import Target

SHARES = (1.0, 10.0, 50.0)
_LIMITS = f"{', '.join(name.replace(' ', '_') for name in OF_LIFE)}, as in depth=50um"
RARE_METHODS = ("auto", "importance", "subset")
LONGEST = 10.0  # default censoring over the target or the length of the test


def checked_study(
    scenario: Scenario,
    realisations: int,
    *,
    limits: Sequence[str] = (),
    target: float | str | None = None,
    b: Sequence[float] = SHARES,
    most: float | str | None = None,
    precision: str | None = None,
    rare: int = 0,
    rare_method: str = "auto",
) -> tuple[Scenario, LifeSettings, Target | None]:
    """Return scenario, settings and target of a study; arguments as of `life`.

    Raises
    ------
    ArgumentError
        If an argument is invalid.
    ScenarioError
        If there is no limit, or nothing is random.
    """
    with checking_argument("precision"):
        aim = None if precision is None else life_target(precision)
    with checking_argument("limits"):
        scenario = with_limits(scenario, limits)
    settings = settings_of(scenario, realisations, target, b, most)
    with checking_argument("rare"):
        settings = with_rare_events(scenario, settings, rare, precision, rare_method)
    return scenario, settings, aim


def with_rare_events(
    scenario: Scenario,
    settings: LifeSettings,
    rare: int,
    precision: str | None,
    method: str = "auto",
) -> LifeSettings:
    """Return settings with further tests for rare events.

    Raises
    ------
    ValueError
        If there is no target, or the tests have no meaning.
    """
    if not rare:
        return settings
    drawn = [item for item in scenario.random if not item.is_redrawn and item.role != "process"]
    can_shift = bool(shifted_inputs(scenario, settings.factor))
    obstacles = {
        "rare events need a target, the life of which the probability is small": (
            settings.target is None
        ),
        f"{settings.factor} is integrated exactly, and nothing else is random: any probability is"
        " known without further tests": settings.alone,
        "rare events go with a fixed number of realisations, not a precision": (
            precision is not None
        ),
        f"rare events take {LEAST_TESTS} tests or more, got {rare}": rare < LEAST_TESTS,
        f"'{method}' is not a method, expected one of {', '.join(RARE_METHODS)}": (
            method not in RARE_METHODS
        ),
        "rare events need an input that is drawn once per test or roller": not drawn,
        "no random input of one number per test can be shifted; use subset": (
            method == "importance" and not can_shift
        ),
    }
    if text := next((text for text, holds in obstacles.items() if holds), ""):
        raise ValueError(text)
    return replace(settings, rare=rare, rare_method=method if can_shift else "subset")


def results_file(scenario: Scenario) -> Path:
    """Return the default name of the results file of a study of lives."""
    return Path(f"{scenario.name.removesuffix('-life')}-life.h5")


def with_limits(scenario: Scenario, limits: Sequence[str]) -> Scenario:
    """Return a scenario with limits added to its table [limit].

    Raises
    ------
    ValueError
        If one is not a limit of a life, or given twice.
    ScenarioError
        If there is none, or one is of no meaning for the scenario.
    """
    changes: dict[str, str | float] = {}
    for text in limits:
        name = text.replace("_", " ").split("=")[0].strip().lower().removeprefix("worn ")
        if "=" in text and name not in OF_LIFE:
            raise ValueError(f"'{text}' is not a limit of a life, expected {_LIMITS}")
        limit = Limit.parse(text)
        if limit.quantity not in OF_LIFE:
            raise ValueError(
                f"'{text}' does not end a life, expected a limit of {', '.join(OF_LIFE)}; a time"
                " after which lives are censored is the maximum"
            )
        if f"limit.{limit.key}" in changes:
            raise ValueError(f"'{text}': a limit of {limit.quantity} is given twice")
        written = limit.text.removeprefix(limit.quantity).strip()
        changes[f"limit.{limit.key}"] = limit.value if limit.unit == "1" else written
    changed = scenario.changed(changes) if changes else scenario
    if not changed.limit.given:
        raise mistake_in(
            scenario.file,
            "is needed for a life",
            "none",
            'one limit or more, such as depth = "50 um"',
            table="limit",
        )
    return changed


def settings_of(
    scenario: Scenario,
    realisations: int,
    target: float | str | None,
    shares: Sequence[float],
    most: float | str | None,
) -> LifeSettings:
    """Return the settings of a study, with lives in roller passes; parameters as in `life`.

    Raises
    ------
    ArgumentError
        If a life or a percentage is invalid.
    ScenarioError
        If nothing is random.
    """
    unit, per_unit = scenario.life_unit
    rate = scenario.pass_rate / per_unit
    with checking_argument("target"):
        aim = None if target is None else per_unit * parse_life(target, unit, rate, "target")
    for share in shares:
        if not 0.0 < share < 100.0:
            raise ArgumentError(
                "b", f"B{share:g} is not a life, expected percentages between 0 and 100"
            )
    if most is not None:
        with checking_argument("most"):
            longest = per_unit * parse_life(most, unit, rate, "max")
    else:
        length = float(scenario.total_passes) if scenario.has_length else 0.0
        longest = LONGEST * max(length, aim or 0.0)
        if longest == 0.0:
            raise ArgumentError(
                "most",
                "a maximum is needed at which lives are censored, such as 1e7, since the scenario"
                " has no length",
            )
    span = scenario.load.built.span
    if span is not None:  # the log cannot be extended
        longest = min(longest, span[1] * scenario.pass_rate)
    if aim is not None and aim > longest:
        raise ArgumentError(
            "most",
            f"the target of {aim / per_unit:g} {unit} is beyond the maximum of"
            f" {longest / per_unit:g} {unit}; give a greater maximum",
        )
    if not scenario.has_length:
        scenario = with_length(scenario, longest)
    request = checked_request(scenario, realisations, "monte-carlo", None)
    factor, reason = exact_factor(scenario)
    alone = factor is not None and len(scenario.random) == 1
    return LifeSettings(
        most=longest,
        unit=unit,
        per_unit=per_unit,
        rate=rate,
        target=aim,
        shares=tuple(map(float, shares)),
        factor=factor.item.name if factor else "",
        reason=reason,
        reference=factor.reference if factor else 0.0,
        spread=factor.spread if factor else 1.0,
        alone=alone,
        plain=1 if alone else request.realisations,
    )


def design_variable(scenario: Scenario, key: str) -> DesignVariable | None:
    """Return the value of a key in SI; None if it is not a number or a quantity."""
    value: Any = tomllib.loads(scenario.text)
    for part in key.split("."):
        if not isinstance(value, dict) or part not in value:
            return None
        value = value[part]
    if isinstance(value, int | float) and not isinstance(value, bool):
        return DesignVariable(key, float(value), "1", f"{value:g}")
    number = NUMBER.match(value.strip()) if isinstance(value, str) else None
    if not number:
        return None
    text = value.strip()
    unit = text[number.end() :].strip()
    if not unit:
        return DesignVariable(key, float(text), "1", text)
    try:
        unit = kind_of(unit).unit
        return DesignVariable(key, quantity(text, unit), unit, text)
    except ValueError:  # a number and other text
        return None


def parse_life(value: float | str, unit: str, rate: float, what: str) -> float:
    """Return a life in its unit, from a number, "5e6 turns" or a time such as "200 h".

    Raises
    ------
    ValueError
        If it cannot be read, or is not above zero.
    """
    text = str(value).strip()
    try:
        life = float(text.removesuffix(unit))
    except ValueError:
        try:
            life = rate * quantity(text, "s")
        except QuantityError as error:
            raise ValueError(
                f"{what} '{text}' is not a life, expected a number of {unit} such as 675000, or a"
                " time such as '200 h'"
            ) from error
    if not 0.0 < life < np.inf:
        raise ValueError(f"{what} '{text}' must be above zero")
    return life
