"""Conformance tests of the installed axial profiles, and of mutants of one."""

from __future__ import annotations

import numpy as np
import pytest

from wearsim.plugins import AxialProfile, AxialProfileSpec, Options, registry
from wearsim.testing import ConformanceError, axial_profile_tests
from wearsim.testing.axial_profiles import AXIAL_PROFILE, AxialProfileFixture
from wearsim.testing.checks import ConfiguredSpec

PLACES = np.linspace(-5.0, 5.0, 21)
ROWS = [f"{y!r}, {-0.1 * y * y!r}" for y in PLACES.tolist()]
FILES = {"crown.csv": "\n".join(["y [mm], height [um]", *ROWS])}
TESTED = {
    "crown": [{"radius": "500 mm"}],
    "logarithmic": [
        {"design_load": "5 kN"},
        {"design_load": "5 kN", "variant": "lundberg", "length": "12 mm"},
        {"design_load": "5 kN", "k1": 1.5, "k2": 0.6, "drop": "20 um"},
    ],
    "partial-crown": [{"straight": "4 mm", "radius": "200 mm"}],
    "straight": [{}],
    "table": [{"file": "crown.csv"}],
}

for name, cases in TESTED.items():
    for number, options in enumerate(cases):
        label = name.replace("-", "_")
        globals()[f"test_{label}_{number}"] = axial_profile_tests(name, options, files=FILES)


def test_all_installed_axial_profiles_are_tested():
    names = registry().names(AxialProfileSpec)
    found = {name: registry().registered(AxialProfileSpec, name) for name in names}
    assert set(TESTED) == {name for name, item in found.items() if item.distribution == "wearsim"}


def mutant(drop=lambda s: s * s, **members):
    def build(options, pair):
        own = {"length": 8e-3, "drop": lambda self, s: drop(s), **members}
        return type("Mutant", (AxialProfile,), own)()

    return build


def changing(s):
    s *= 2.0
    return s * s


MUTANTS = {
    "factory-builds-an-axial-profile": [lambda *arguments: object(), mutant(length=0.0)],
    "drop-is-elementwise": [
        mutant(lambda s: s * s + len(s) * 1e-9),
        mutant(lambda s: (s * s)[:-1]),
        mutant(changing),
        mutant(lambda s: np.where(np.abs(s) > 3.99e-3, np.inf, s * s)),
    ],
    "drop-is-counted-from-the-highest-line": [
        mutant(lambda s: s * s - 1e-6),
        mutant(lambda s: s * s + 1e-6),
    ],
    "crown-radius-is-that-of-the-drop": [mutant(crown_radius=0.49)],
}
CASES = [(name, build) for name, builds in MUTANTS.items() for build in builds]


def fixture(build):
    spec = AxialProfileSpec("mutant", Options, "violates a requirement", factory=build, protocol=2)
    return AxialProfileFixture(ConfiguredSpec(spec))


@pytest.mark.parametrize(("name", "build"), CASES)
def test_violations_are_reported(name, build):
    with pytest.raises(ConformanceError, match="axial profile 'mutant': "):
        AXIAL_PROFILE[name](fixture(build))


def test_profile_of_the_mutants_conforms():
    for check in AXIAL_PROFILE.values():
        check(fixture(mutant(crown_radius=0.5)))


def test_every_check_has_a_failing_profile():
    common = {"spec-is-complete", "options-reject-unknown-keys"}
    assert set(AXIAL_PROFILE) == set(MUTANTS) | common
