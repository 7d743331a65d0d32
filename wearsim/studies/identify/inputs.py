"""Inputs of each test: fixed, known, measured with an error, or drawn from the scenario."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from operator import attrgetter
from typing import Any

import numpy as np

from wearsim.errors import Mistake, ScenarioError, mistake_in
from wearsim.models.random.distributions import TableDistribution
from wearsim.quantities import NUMBER, quantity
from wearsim.scenario import RandomInput, Scenario
from wearsim.scenario.parse.fields import amount, can_be_random
from wearsim.scenario.parse.overrides import flat
from wearsim.studies.identify.measurements import Measurement, key_of
from wearsim.units import QuantityError, as_written

_SPAN = 6.0  # standard deviations of a measured value that are considered
_POINTS = 801
_EITHER_SIGN = {"creepage.yaw", "creepage.tilt", "roller.offset"}
_ALWAYS = {"creepage.yaw", "creepage.tilt"}  # inputs of any rig, zero by default
_LEAST = 1e-9  # probability of the values within that span by the scenario


def contained_inputs(
    scenario: Scenario, tests: Sequence[Measurement], fixed: Sequence[str]
) -> list[str]:
    """Return the inputs that are neither drawn nor known in all tests, by dotted key.

    Where they differ between the tests, the difference is taken for one of K/H.

    Parameters
    ----------
    scenario : Scenario
    tests : sequence of Measurement
    fixed : sequence of str
        Keys that the user has fixed as known and equal in all tests.
    """
    drawn = {key for item in scenario.random for key in item.keys}
    known = {*fixed, *set.intersection(*(set(test.values) for test in tests))}
    given = {
        key
        for key, value in flat(tomllib.loads(scenario.text))
        if can_be_random(key) and NUMBER.match(str(value)) and not key.startswith("wear.")
    }
    options = {key for key in given for item in scenario.random if key.startswith(f"{item.name}.")}
    return sorted((given | _ALWAYS) - options - drawn - known)


def with_known(scenario: Scenario, test: Measurement) -> Scenario:
    """Return the scenario of one test, with its known and measured inputs.

    The distribution of the scenario and a measurement are combined by Bayes' theorem.

    Raises
    ------
    ScenarioError
        If a key or value is wrong, or a measured value is out of the distribution.
    """
    if not test.values:
        return scenario
    before = {key: item for item in scenario.random for key in item.keys}
    known = _changed(scenario, test.values, test, "set")
    random = list(known.random)
    for key, error in test.errors.items():
        item = before.get(key)
        if not can_be_random(key) or (item is not None and item.role == "joint"):
            by = "" if item is None else f" alone, since {item.name} sets it with others"
            raise test.refused(
                Mistake(
                    "",
                    f"std.{key}",
                    f"cannot be random{by}",
                    as_written(error),
                    "only a known value in set",
                )
            )
        if item is None:
            changed = _changed(known, {key: _normal(key, test.values[key], error)}, test, "std")
            random += [random_input for random_input in changed.random if random_input.name == key]
        else:
            random.append(_measured(item, _number(known, key), _std(item, error, key, test), test))
    return replace(known, random=tuple(sorted(random, key=lambda random_input: random_input.name)))


def _changed(
    scenario: Scenario, values: Mapping[str, object], test: Measurement, table: str
) -> Scenario:
    """Return a scenario with other values, whose mistakes are reported of a table of the test."""
    try:
        return scenario.changed(values)
    except ScenarioError as error:
        mistakes = []
        for mistake in error.mistakes:
            place = ".".join(filter(None, (mistake.table, mistake.key)))
            key = next((key for key in values if f"{place}.".startswith(f"{key}.")), None)
            mistakes.append(
                replace(mistake, key=f"{table}.{key}") if key else Mistake("", table, str(mistake))
            )
        raise test.refused(*mistakes) from error


def _normal(key: str, value: object, error: object) -> dict[str, object]:
    """Return the normal distribution of a measured value, above 0 unless it may be negative."""
    if key in _EITHER_SIGN:
        return {"distribution": "normal", "mean": value, "std": error}
    unit = str(value).strip().partition(" ")[2]
    support = [f"0 {unit}" if unit else 0, "inf"]
    parent = {"parent_mean": value, "parent_std": error}
    return {"distribution": "truncated-normal", **parent, "support": support}


def _number(scenario: Scenario, key: str) -> float:
    """Return the number at a dotted key of a scenario [SI]."""
    table, inner = key.split(".", 1)
    section: Any = getattr(scenario, table)
    return float(attrgetter(inner)(getattr(section, "options", section)))


def _std(item: RandomInput, error: object, key: str, test: Measurement) -> float:
    """Return a standard deviation in SI."""
    kind = item.quantity.kind if item.quantity else None
    std, what = 0.0, "must be above 0"
    try:
        std = quantity(str(error), kind.unit) if kind else float(str(error))
    except ValueError as failure:
        what = failure.what if isinstance(failure, QuantityError) else "is not a number"
    if 0.0 < std < math.inf:
        return std
    expected = kind.expected("positive") if kind else "a number above 0"
    raise test.refused(Mistake("", f"std.{key}", what, as_written(error), expected))


def _measured(item: RandomInput, value: float, std: float, test: Measurement) -> RandomInput:
    """Return an input whose distribution is combined with a measurement."""
    uniform = 0.5 * (1.0 + np.tanh(np.linspace(-11.0, 11.0, 20001)))
    quantiles = item.scalar.quantile(uniform)
    grid = value + std * np.linspace(-_SPAN, _SPAN, _POINTS)
    below = np.interp(grid, quantiles, uniform, left=0.0, right=1.0)
    middle = 0.5 * (grid[1:] + grid[:-1])
    weight = np.diff(below) * np.exp(-0.5 * ((middle - value) / std) ** 2)
    if below[-1] - below[0] < _LEAST:
        raise test.refused(
            Mistake(
                "",
                f"set.{item.name}",
                f"the measured value is out of the scenario's distribution: {item.describe()}",
                f"{amount(value, item.quantity)} with std {amount(std, item.quantity)}",
                "a value within it, or a wider distribution in the scenario",
            )
        )
    probability = np.concatenate([[0.0], np.cumsum(weight)])
    inside = np.concatenate([[True], weight > 0.0])
    table = TableDistribution(probability[inside] / probability[-1], grid[inside])
    return replace(item, kind="measured", persistence="per-test", distribution=table, marginal="")


def fixed(text: str) -> dict[str, object]:
    """Return the overrides of ``--fix friction=0.1,load=310 N``.

    Raises
    ------
    ValueError
        If a part is no key with a value.
    """
    values: dict[str, object] = {}
    for part in text.split(","):
        name, equals, value = part.partition("=")
        if not equals or not name.strip() or not value.strip():
            raise ValueError(f"'{part}' is not an input with a value, such as friction=0.1")
        try:
            values[key_of(name.strip())] = float(value)
        except ValueError:
            values[key_of(name.strip())] = value.strip()
    return values


def with_measured(scenario: Scenario, stds: Mapping[str, float]) -> Scenario:
    """Return a scenario whose inputs scatter as if they had been measured.

    Parameters
    ----------
    scenario : Scenario
    stds : mapping of str to float
        Standard deviation of the logarithm by the scenario's key, 0.1.

    Raises
    ------
    ScenarioError
        If an input is not random in the scenario, or sets several values.
    """
    random = list(scenario.random)
    names = [item.name for item in random]
    for key, std in stds.items():
        if key not in names or random[names.index(key)].role == "joint":
            single = [item.name for item in random if item.role != "joint"]
            raise mistake_in(
                scenario.file,
                "is not a random number of the scenario, so measuring it changes nothing",
                None,
                ", ".join(single) or "a random input",
                key=key,
            )
        place = names.index(key)
        item = random[place]
        uniform = (np.arange(2001) + 0.5) / 2001
        from scipy.special import ndtri  # noqa: PLC0415  (slow to import)

        median = float(item.scalar.quantile(np.array([0.5]))[0])
        values = median * np.exp(std * ndtri(uniform))
        low, high = item.scalar.support
        values = np.clip(values, low if math.isfinite(low) else None, high)
        ends = np.concatenate([[0.0], uniform, [1.0]])
        table = TableDistribution(ends, np.concatenate([values[:1], values, values[-1:]]))
        random[place] = replace(
            item, kind="measured", persistence="per-test", distribution=table, marginal=""
        )
    return replace(scenario, random=tuple(random))
