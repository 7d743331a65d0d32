"""Runs of a hard case: unchanged, refined and mirrored."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from wearsim.scenario import Drawn, Scenario, parse_scenario
from wearsim.studies.run.result import Result
from wearsim.studies.run.run import run
from wearsim.types import Profile
from wearsim_bench.hard_cases.cases import LONG, SHORT, RobustnessCase

TIGHTER = 10.0  # factor on the tolerance, for steps a third as long
_MIRRORED = "mirrored.csv"


@dataclass(frozen=True)
class Plan:
    """Length and resolution of the runs of hard cases.

    Parameters
    ----------
    passes : int
        Roller passes of a test.
    finer : int
        Refinement of the coarsest strips for runs with adaptive and fixed steps.
    steps : int
        Smallest number of fixed steps of a test.
    doublings : int
        Number of refinements of the strips.
    tighter : bool
        Whether a run is compared with one of lower tolerance.
    changes : mapping of str to object
        Changes common to all runs.
    """

    passes: int
    finer: int
    steps: int
    doublings: int
    tighter: bool
    changes: Mapping[str, object]

    @classmethod
    def of(cls, quick: bool, changes: Mapping[str, object]) -> Plan:
        """Return the plan of a quick or a full evaluation."""
        if quick:
            return cls(SHORT, 1, 5, 2, False, {"evolution.tolerance": 5e-3, **changes})
        return cls(LONG, 2, 10, 3, True, changes)

    def run(self, case: RobustnessCase, **further: object) -> Result:
        """Run a case with further changes; two underscores represent the dot of a key."""
        return run(self.scenario(case, **further))

    def scenario(self, case: RobustnessCase, **further: object) -> Scenario:
        """Return the scenario of a case, see `run`."""
        changes = dict(self.changes)
        if case.strips and not case.refused:
            changes["contact.strips"] = case.strips * self.finer
        changes |= {key.replace("__", "."): value for key, value in further.items()}
        return case.scenario(self.passes, changes)

    def adaptive(self, case: RobustnessCase) -> list[Result]:
        """Run a case with adaptive steps, and again with a lower tolerance if `tighter`."""
        records = {"outputs__records": 20, "outputs__spacing": "log"}
        runs = [self.run(case, **records)]
        if self.tighter and case.strips:
            tolerance = runs[0].raw.tolerance / TIGHTER
            runs.append(self.run(case, evolution__tolerance=tolerance, **records))
        return runs

    def fixed(self, case: RobustnessCase) -> list[Result]:
        """Run a case with equal steps, which are halved from run to run.

        The ends of half steps are recorded if they are whole passes.
        """
        halvings = (0, 1, 2) if case.strips else (0,)
        runs = []
        for halving in halvings:
            step = self._coarsest_step(case) >> halving
            every = {"outputs__every_passes": max(1, step // 2)}
            runs.append(self.run(case, evolution__step=step, **every))
        return runs

    def refined(self, case: RobustnessCase) -> list[Result]:
        """Run a case with equal steps on strips that are doubled from run to run."""
        if not case.strips:
            return []
        step = self._coarsest_step(case)
        counts = [case.strips << doubling for doubling in range(self.doublings + 1)]
        return [self.run(case, evolution__step=step, contact__strips=n) for n in counts]

    def mirrored(self, case: RobustnessCase) -> Result:
        """Run the mirror image of a case with the coarsest fixed steps.

        Adaptive steps would amplify differences of round-off.
        """
        return run(mirror_image(self.scenario(case, evolution__step=self._coarsest_step(case))))

    def _coarsest_step(self, case: RobustnessCase) -> int:
        """Return the passes of the coarsest step; at least 4, since it is halved twice."""
        return max(case.passes(self.passes) // (self.steps * case.steps), 4)


def mirror_image(scenario: Scenario) -> Scenario:
    """Return a scenario mirrored in y; random angles are not supported.

    Offsets, yaw, tilt, the centre of the strips and the profile are mirrored.
    """
    creepage, choice, files = scenario.creepage, scenario.contact, dict(scenario.files)
    changes: dict[str, object] = {
        "roller.offset": _negative(scenario.roller.offset, "m"),
        "creepage.yaw": _negative(creepage.yaw, "rad"),
        "creepage.tilt": _negative(creepage.tilt, "rad"),
    }
    if choice.centre is not None:
        changes["contact.centre"] = _negative(choice.centre, "m")
    profile = scenario.cylinder.profile
    if profile is not None:
        files[_MIRRORED] = _mirrored_csv(profile)
        changes["cylinder.profile"] = _MIRRORED
    return parse_scenario(scenario.text, scenario.file, files.__getitem__, changes)


def is_symmetric(scenario: Scenario) -> bool:
    """Return whether a scenario is its own mirror image."""
    creepage, profile = scenario.creepage, scenario.cylinder.profile
    numbers = [scenario.roller.offset, creepage.yaw, creepage.tilt, scenario.contact.centre or 0.0]
    symmetric = not any(np.any(number) for number in numbers)
    if profile is None:
        return symmetric
    even_grid = np.array_equal(profile.y, -profile.y[::-1])
    return symmetric and even_grid and np.array_equal(profile.height, profile.height[::-1])


def _negative(value: Drawn, unit: str) -> str | list[str]:
    if isinstance(value, tuple):
        return [f"{-number!r} {unit}" for number in value]
    return f"{-value!r} {unit}"


def _mirrored_csv(profile: Profile) -> str:
    rows: Sequence[list[float]] = np.stack([-profile.y, profile.height], axis=1)[::-1].tolist()
    return "\n".join(["y [m], height [m]", *(f"{y!r}, {height!r}" for y, height in rows)])
