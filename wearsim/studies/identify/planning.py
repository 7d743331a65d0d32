"""Planning of tests: power of the verdict against the number of tests and the measured inputs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from wearsim.errors import CapabilityError
from wearsim.report.view import Table
from wearsim.scenario import Scenario, as_scenario, require_run
from wearsim.studies.automatic import with_chosen_model
from wearsim.studies.cam.cam_wear import Wanted
from wearsim.studies.ensemble.realisation import closed_form_depths
from wearsim.studies.identify.analysis import kernel_of
from wearsim.studies.identify.inputs import with_measured
from wearsim.studies.identify.likelihood import depth_likelihood, depth_range
from wearsim.studies.identify.measurements import key_of
from wearsim.studies.identify.trajectories import CYLINDER, ROLLER, Grower, check_law, factors
from wearsim.uq.hierarchy.kernels import LikelihoodMixture
from wearsim.uq.hierarchy.verdict import MOST_TESTS, NEGLIGIBLE, POWER_SETS, Power

SCATTERS = (0.2, 0.4, 0.8)
DEPTH_ERROR = 0.01  # relative error of a measured depth
_MOST_SIZES = 9


@dataclass(frozen=True)
class PlannedDesign:
    """Rates of the verdicts for some numbers of tests.

    Parameters
    ----------
    name : str
        "as in the scenario", or the measured inputs.
    scatter_from_inputs : float
        Scatter of ln K/H of tests that the inputs cause.
    tests : tuple of int
        Numbers of tests.
    random : dict of float to tuple of float
        Rate of the verdict "random" for each number of tests, by the scatter of ln K/H.
    explained : dict of float to tuple of float
        Rate of the verdict "explained".
    needed : dict of float to int or None
        Least number of tests that finds a scatter with power 0.8, or None if it exceeds 128.
    """

    name: str
    scatter_from_inputs: float
    tests: tuple[int, ...]
    random: Mapping[float, tuple[float, ...]]
    explained: Mapping[float, tuple[float, ...]]
    needed: Mapping[float, int | None]


def plan_tests(
    scenario: Scenario | str | Path,
    tests: Sequence[int],
    measured: Mapping[str, float] | None = None,
    *,
    negligible: float = NEGLIGIBLE,
    draws: int | None = None,
    sets: int = POWER_SETS,
    on_progress: Callable[[int, int], None] | None = None,
) -> list[PlannedDesign]:
    """Return the power of tests of a scenario to show whether the wear factor scatters.

    Parameters
    ----------
    scenario : Scenario or path
        Its random inputs differ between the tests.
    tests : sequence of int
        Numbers of tests, each 2 or more.
    measured : mapping of str to float, optional
        Inputs that are measured in every test: standard deviation of the logarithm, {"load": 0.1}.
    negligible : float
        Scatter of ln K/H below which it is negligible.
    draws : int, optional
        Number of draws of the inputs; by default 256, or 128 where a wear test is needed for each
        of several K/H.
    sets : int
        Number of simulated sets of tests.
    on_progress : callable, optional
        Called with the numbers of completed and of all wear tests.

    Returns
    -------
    list of PlannedDesign
        For the inputs of the scenario, and for measured ones if there are any.

    Raises
    ------
    ScenarioError, CapabilityError
        If the scenario cannot be used.
    ValueError
        If a number of tests is below 2.
    """
    scenario = as_scenario(scenario)
    require_run(scenario)
    check_law(scenario)
    if scenario.cam is not None:
        raise CapabilityError(
            f"{scenario.file}: holds a cam; tests are planned for a cylinder, whose groove is the"
            " same all around"
        )
    scenario = with_chosen_model(scenario, test=True)
    if not tests or min(tests) < 2:
        raise ValueError("scatter needs 2 tests or more")
    designs = [("as in the scenario", scenario)]
    if measured:
        stds = {key_of(key): std for key, std in measured.items()}
        name = ", ".join(f"{key} measured to {std:.3g}" for key, std in stds.items())
        designs.append((name, with_measured(scenario, stds)))
    return [
        _planned(name, _kernel(design, draws, on_progress), tests, negligible, sets, scenario.seed)
        for name, design in designs
    ]


def sizes(first: int, last: int) -> list[int]:
    """Return at most nine numbers of tests from the first to the last, about equal in ratio."""
    return sorted(
        {first, last, *np.geomspace(first, last, _MOST_SIZES).round().astype(int).tolist()}
    )


def _kernel(
    scenario: Scenario, draws: int | None, on_progress: Callable[[int, int], None] | None
) -> LikelihoodMixture:
    """Return the likelihood of ln K/H by a test of mean inputs that wears as the scenario."""
    cylinder, roller = factors(scenario)
    known = {CYLINDER: np.array([cylinder]), ROLLER: np.array([roller])}
    depth = float(closed_form_depths(scenario, known, 1)[0])
    if not depth > 0.0:
        raise CapabilityError(
            f"{scenario.file}: tests are planned for the depth that rigid bodies wear in full slip,"
            " which is zero; give creepage.longitudinal or creepage.yaw"
        )
    passes = float(scenario.total_passes)
    std = DEPTH_ERROR * depth
    grower = Grower(scenario, draws, on_progress=on_progress)
    grown = grower.grow([Wanted("cylinder", passes, *depth_range(depth, std))]).by_passes[passes]
    return kernel_of(depth_likelihood(depth, std, grown, "cylinder"), scenario.file)


def _planned(
    name: str,
    kernel: LikelihoodMixture,
    tests: Sequence[int],
    negligible: float,
    sets: int,
    seed: int,
) -> PlannedDesign:
    power = Power([kernel], negligible=negligible, seed=seed, sets=sets)
    rates = {t: [power.rates(count, t) for count in tests] for t in (0.0, *SCATTERS)}
    return PlannedDesign(
        name,
        kernel.variance**0.5,
        tuple(tests),
        {t: tuple(random for random, _ in pairs) for t, pairs in rates.items()},
        {t: tuple(explained for _, explained in pairs) for t, pairs in rates.items()},
        {t: power.needed(t) for t in SCATTERS},
    )


def plan_data(designs: Sequence[PlannedDesign]) -> dict[str, Any]:
    """Return the power of planned tests for JSON."""
    return {
        "designs": [
            {
                "inputs": design.name,
                "scatter_from_inputs": design.scatter_from_inputs,
                "tests": design.tests,
                "false_random": design.random[0.0],
                "explained": design.explained[0.0],
                "power": {f"{t:g}": design.random[t] for t in SCATTERS},
                "tests_for_power_0.8": {f"{t:g}": design.needed[t] for t in SCATTERS},
            }
            for design in designs
        ]
    }


def plan_tables(designs: Sequence[PlannedDesign]) -> Iterator[tuple[Table, list[str]]]:
    """Yield the power of planned tests as a table for each design, with sentences below it."""
    heads = ("tests", *(f"power, t = {t:g}" for t in SCATTERS))
    for design in designs:
        rates = (*(design.random[t] for t in (*SCATTERS, 0.0)), design.explained[0.0])
        rows = zip(design.tests, *rates, strict=True)
        cells = [(str(row[0]), *(f"{rate:.2f}" for rate in row[1:])) for row in rows]
        scatter = f"they scatter ln K/H by {design.scatter_from_inputs:.3f}"
        sentences = [
            f"a scatter of {t:g} is found with power 0.8 by"
            f" {design.needed[t] or f'more than {MOST_TESTS}'} tests"
            for t in SCATTERS
        ]
        named = (*heads, "false 'random'", "'explained' if t = 0")
        yield Table(f"inputs {design.name}: {scatter}", cells, named), sentences
