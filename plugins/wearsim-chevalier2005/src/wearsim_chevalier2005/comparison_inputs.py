"""Comparison of contact, random inputs and mean problem."""

from __future__ import annotations

import math

import numpy as np

from wearsim.scenario import Scenario
from wearsim.studies.run.inputs import LOAD, LONGITUDINAL, TILT, YAW
from wearsim.studies.run.setup import Setup
from wearsim.uq.distributions.base import MaxentDistribution
from wearsim.uq.estimation.moments import summarise
from wearsim_chevalier2005 import paper
from wearsim_chevalier2005.comparison_row import Row, percent, printed_row
from wearsim_chevalier2005.study import Reproduction

EXACT_POWER = 0.0771  # W, the mean problem by CONTACT (Vollebregt and Kalker), a half-space code


def contact_rows(results: Reproduction) -> list[Row]:
    """Return the rows of size and speed of the contact, and of its traction bound."""
    part, load = "contact", results.mean.point.normal_force
    problems = {"": results.mean_scenario, ", printed radii": results.printed_scenario}
    patches = {name: Setup(problem).fresh_patch(load) for name, problem in problems.items()}
    halved, literal = patches[""], patches[", printed radii"]
    diameters = f"with {_radii(results.mean_scenario)}: the radii of the paper are diameters"
    bound = 2.0 * load / (math.pi * halved.a * halved.b)
    return [
        printed_row(part, "length 2a", "mm", paper.CONTACT_LENGTH, 2.0 * halved.a, diameters),
        printed_row(part, "width 2b", "mm", paper.CONTACT_WIDTH, 2.0 * halved.b, "as above"),
        printed_row(
            part, "length 2a, printed radii", "mm", paper.CONTACT_LENGTH, 2.0 * literal.a,
            f"with {_radii(results.printed_scenario)} taken as radii, as printed",
        ),
        printed_row(
            part, "width 2b, printed radii", "mm", paper.CONTACT_WIDTH, 2.0 * literal.b, "as above"
        ),
        printed_row(
            part, "rolling speed V", "m/s", paper.SPEED, results.mean.point.rolling_speed,
            "1000 rpm of the cylinder; the value is missing in section 3.3",
        ),
        printed_row(
            part, "rolling speed V, printed radii", "m/s", paper.SPEED,
            results.as_printed.point.rolling_speed, "outside the printed range: diameters again",
        ),
        printed_row(
            part, "rise of p0 under the parabolic bound", "%", paper.BOUND_RISE,
            bound / halved.peak_pressure - 1.0,
            "2 N/(pi a b) instead of 3 N/(2 pi a b) for the same load: a third more",
        ),
    ]  # fmt: skip


def _radii(scenario: Scenario) -> str:
    lengths = scenario.roller.radius, scenario.roller.crown_radius, scenario.cylinder.radius
    return "/".join(f"{1e3 * length:g}" for length in lengths) + " mm"


def maxent_of(scenario: Scenario, key: str) -> MaxentDistribution:
    """Return the maximum-entropy distribution of a random input."""
    (item,) = (item for item in scenario.random if item.name == key)
    if not isinstance(item.distribution, MaxentDistribution):
        raise TypeError(f"{key} has no maximum-entropy distribution, but {item.kind}")
    return item.distribution


def printed_area(printed: paper.PrintedMultipliers, distribution: MaxentDistribution) -> float:
    """Return the integral of the density with the printed multipliers; 1 for exact multipliers."""
    low, high = distribution.bulk
    x = np.linspace(low - (high - low), high + (high - low), 20001)
    x = x[(x >= distribution.support[0]) & (x <= distribution.support[1])]
    density = np.exp(-(printed.l0 + printed.l1 * x + printed.l2 * x * x))
    from scipy.integrate import trapezoid  # noqa: PLC0415  (0.3 s to import)

    return float(trapezoid(density, x))


def input_rows(results: Reproduction) -> list[Row]:
    """Return the rows of the maximum-entropy distributions and of the misalignment."""
    load, creepage = maxent_of(results.scenario, LOAD), maxent_of(results.scenario, LONGITUDINAL)
    area = printed_area(paper.LOAD_MULTIPLIERS, load)
    radius, printed_radius = results.scenario.roller.radius, paper.ROLLER_RADIUS.value
    drawn = results.all_inputs.inputs
    lateral, tilt = summarise(drawn[YAW]), summarise(drawn[TILT])
    return [
        *_multipliers(
            "load N", "N", paper.LOAD_MULTIPLIERS, load,
            (
                "agrees",
                "truncated after three digits, not rounded",
                f"agrees; with the printed digits the density integrates to {area:.2f}",
            ),
        ),
        *_multipliers(
            "creepage xi", "", paper.CREEPAGE_MULTIPLIERS, creepage,
            ("the last printed digit differs by one", "agrees", "truncated, not rounded"),
        ),
        printed_row(
            "inputs", "std of lateral creepage", "1", paper.LATERAL_STD, lateral.std,
            "half the radius of the disc", lateral.std_error,
        ),
        printed_row(
            "inputs", "std of spin", "1/m", paper.SPIN_STD, tilt.std / radius,
            f"tilt over {1e3 * radius:g} mm; over the printed {1e3 * printed_radius:g} mm it"
            f" would be {tilt.std / printed_radius:.3f}",
            tilt.std_error / radius,
        ),
    ]  # fmt: skip


def _multipliers(
    what: str,
    unit: str,
    printed: paper.PrintedMultipliers,
    distribution: MaxentDistribution,
    why: tuple[str, str, str],
) -> list[Row]:
    units = ("1", f"1/{unit}", f"1/{unit}^2") if unit else ("1", "1", "1")
    values = zip(
        (printed.l0, printed.l1, printed.l2), distribution.multipliers, units, why, strict=True
    )
    return [
        Row(
            "inputs",
            f"lambda{power} of {what}",
            multiplier_unit,
            value,
            printed.place,
            computed,
            None,
            reason,
        )
        for power, (value, computed, multiplier_unit, reason) in enumerate(values)
    ]


def mean_problem_rows(results: Reproduction) -> list[Row]:
    """Return the rows of the power of the mean problem by several methods."""
    part, printed = "mean problem", paper.MEAN_PROBLEM_POWER
    fastsim, summed = results.mean.solution.power, results.element_sum.solution.power
    literal = results.as_printed.solution.power
    return [
        printed_row(
            part, "P_d, FASTSIM, converged", "W", printed, fastsim,
            "integrated exactly along every strip; the paper sums over elements",
        ),
        printed_row(
            part, "P_d, FASTSIM, element sum 50 x 50", "W", printed, summed,
            "first order: depends on the evaluation points within an element",
        ),
        printed_row(
            part, "P_d, slender", "W", printed, results.slender.solution.power,
            f"exact half-space theory (CONTACT): {EXACT_POWER} W; FASTSIM is"
            f" {percent(1.0 - fastsim / EXACT_POWER)} below it",
        ),
        printed_row(
            part, "P_d, FASTSIM, printed radii", "W", printed, literal,
            f"{literal / fastsim:.1f} times as much, mostly by twice the speed",
        ),
    ]  # fmt: skip
