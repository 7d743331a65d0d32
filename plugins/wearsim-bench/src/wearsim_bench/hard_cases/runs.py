"""The runs that a hard case is judged by: as it is, finer, and in the mirror."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from wearsim.results import Result
from wearsim.scenario import Drawn, Scenario, parse_scenario
from wearsim.studies.run.run import run
from wearsim.types import Profile
from wearsim_bench.hard_cases.cases import LONG, SHORT, HardCase

TIGHTER = 10.0  # times lower a tolerance, for steps a third as long
_MIRRORED = "mirrored.csv"


@dataclass(frozen=True)
class Plan:
    """How long and how fine the runs of hard cases are.

    Parameters
    ----------
    passes : int
        Of a test.
    finer : int
        Times the coarsest strips on which steps are chosen or forced.
    steps : int
        That the coarsest forced steps make of a test.
    doublings : int
        Of the strips.
    tighter : bool
        Whether a run is compared with one of a lower tolerance.
    changes : mapping of str to object
        What all runs have besides.
    """

    passes: int
    finer: int
    steps: int
    doublings: int
    tighter: bool
    changes: Mapping[str, object]

    @classmethod
    def of(cls, quick: bool, changes: Mapping[str, object]) -> Plan:
        """Return the plan of a test run, or of the whole."""
        if quick:
            return cls(SHORT, 1, 5, 2, False, {"evolution.tolerance": 5e-3, **changes})
        return cls(LONG, 2, 10, 3, True, changes)

    def run(self, case: HardCase, **others: object) -> Result:
        """Run a case with further changes; two underscores stand for the dot of a key."""
        return run(self.scenario(case, **others))

    def scenario(self, case: HardCase, **others: object) -> Scenario:
        """Return a case's scenario, see `run`."""
        changes = dict(self.changes)
        if case.strips and not case.refused:
            changes["contact.strips"] = case.strips * self.finer
        changes |= {key.replace("__", "."): value for key, value in others.items()}
        return case.scenario(self.passes, changes)

    def chosen(self, case: HardCase) -> list[Result]:
        """Return a case's run with steps of its choice, and one with a lower tolerance if asked."""
        records = {"outputs__records": 20, "outputs__spacing": "log"}
        found = [self.run(case, **records)]
        if self.tighter and case.strips:
            tolerance = found[0].raw.tolerance / TIGHTER
            found.append(self.run(case, evolution__tolerance=tolerance, **records))
        return found

    def forced(self, case: HardCase) -> list[Result]:
        """Return a case's runs with equal steps, each half as long as the last.

        They record the ends of their half steps, where these are whole passes.
        """
        halvings = (0, 1, 2) if case.strips else (0,)
        found = []
        for halving in halvings:
            step = self._coarsest_step(case) >> halving
            every = {"outputs__every_passes": max(1, step // 2)}
            found.append(self.run(case, evolution__step=step, **every))
        return found

    def refined(self, case: HardCase) -> list[Result]:
        """Return a case's runs with equal steps, each on twice as many strips as the last."""
        if not case.strips:
            return []
        step = self._coarsest_step(case)
        counts = [case.strips << doubling for doubling in range(self.doublings + 1)]
        return [self.run(case, evolution__step=step, contact__strips=n) for n in counts]

    def mirrored(self, case: HardCase) -> Result:
        """Return the run of a case's mirror image, with the coarsest of the forced steps.

        Steps of a run's choice hang on round-off, and their mirror image on its amplification.
        """
        return run(mirror_image(self.scenario(case, evolution__step=self._coarsest_step(case))))

    def _coarsest_step(self, case: HardCase) -> int:
        """Return the passes of the coarsest step, which must be halved twice."""
        return max(case.passes(self.passes) // (self.steps * case.steps), 4)


def mirror_image(scenario: Scenario) -> Scenario:
    """Return a scenario with y turned about.

    Offsets, angles, the strips' middle and the profile change sides; yaw and tilt are a lateral
    creepage and a spin, which a mirror turns about.

    Parameters
    ----------
    scenario : Scenario
        Without random angles.
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
    straight = not any(np.any(number) for number in numbers)
    if profile is None:
        return straight
    turned = np.array_equal(profile.y, -profile.y[::-1])
    return straight and turned and np.array_equal(profile.height, profile.height[::-1])


def _negative(value: Drawn, unit: str) -> str | list[str]:
    if isinstance(value, tuple):
        return [f"{-number!r} {unit}" for number in value]
    return f"{-value!r} {unit}"


def _mirrored_csv(profile: Profile) -> str:
    rows: Sequence[list[float]] = np.stack([-profile.y, profile.height], axis=1)[::-1].tolist()
    return "\n".join(["y [m], height [m]", *(f"{y!r}, {height!r}" for y, height in rows)])
