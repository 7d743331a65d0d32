"""Conformance tests of the installed motion laws, and of mutants of one."""

from __future__ import annotations

import numpy as np
import pytest

from wearsim.models.motion import Sinusoidal
from wearsim.plugins import MotionLaw, MotionLawSpec, Options, registry
from wearsim.testing import ConformanceError, motion_law_tests
from wearsim.testing.checks import ConfiguredSpec
from wearsim.testing.motion_laws import MOTION_LAW, MotionLawFixture

ANGLES = np.linspace(0.0, 1.5, 31)
PLACES = ANGLES / 1.5
LIFTS = 8.0 * PLACES**3 * (10.0 - 15.0 * PLACES + 6.0 * PLACES**2)
ROWS = [f"{angle!r}, {lift!r}" for angle, lift in zip(ANGLES.tolist(), LIFTS.tolist(), strict=True)]
FILES = {"lift.csv": "\n".join(["angle [rad], lift [mm]", *ROWS])}
TESTED = {
    "constant-velocity": [{"blend": "10 deg"}],
    "cycloidal": [{}],
    "dwell": [{}],
    "harmonic": [{}],
    "modified-sine": [{}],
    "modified-trapezoid": [{}],
    "polynomial": [{}, {"start": ["5 mm/rad"], "end": [0.0, "-3 mm/rad^2", 0.0]}],
    "polynomial-345": [{}],
    "polynomial-4567": [{}],
    "table": [{"file": "lift.csv"}],
}

for name, cases in TESTED.items():
    for number, options in enumerate(cases):
        label = name.replace("-", "_")
        globals()[f"test_{label}_{number}"] = motion_law_tests(name, options, files=FILES)


def test_all_installed_motion_laws_are_tested():
    assert set(TESTED) == set(registry().names(MotionLawSpec))


def mutant(lift=None, **members):
    def build(options, angle, rise, unit):
        law = Sinusoidal(angle, rise, [(0.0, 1.0, 2.0 * np.pi, 0.0)])
        own = dict(members)
        if lift:
            own["lift"] = lambda self, at: lift(law.lift(at), at)
        else:
            own["lift"] = lambda self, at: law.lift(at)
        return type("Mutant", (MotionLaw,), own)()

    return build


MUTANTS = {
    "factory-builds-a-motion-law": [lambda *arguments: object()],
    "breaks-are-inside-the-segment": [mutant(breaks=(1.6,)), mutant(breaks=(1.0, 0.5))],
    "lift-is-elementwise": [
        mutant(lambda lift, at: lift[:2]),
        mutant(lambda lift, at: lift + 1e-6 * len(at)),
    ],
    "lift-spans-the-rise": [mutant(lambda lift, at: 1.001 * lift)],
    "derivatives-match-the-lift": [
        mutant(lambda lift, at: lift * np.array([1.0, 1.01, 1.0])[:, None]),
        mutant(lambda lift, at: lift * np.array([1.0, 1.0, -1.0])[:, None]),
    ],
}
CASES = [(name, build) for name, builds in MUTANTS.items() for build in builds]


def fixture(build):
    spec = MotionLawSpec("mutant", Options, "violates a requirement", factory=build, protocol=2)
    return MotionLawFixture(ConfiguredSpec(spec))


@pytest.mark.parametrize(("name", "build"), CASES)
def test_violations_are_reported(name, build):
    with pytest.raises(ConformanceError, match="motion law 'mutant': "):
        MOTION_LAW[name](fixture(build))


def test_law_of_the_mutants_conforms():
    for check in MOTION_LAW.values():
        check(fixture(mutant()))


def test_every_check_has_a_failing_law():
    common = {"spec-is-complete", "options-reject-unknown-keys"}
    assert set(MOTION_LAW) == set(MUTANTS) | common
