"""Conformance tests of the installed wear laws, and of mutants of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from wearsim.plugins import Options, WearLaw, WearLawSpec, registry
from wearsim.testing import ConformanceError, sliding_contact, wear_law_tests
from wearsim.testing.checks import ConfiguredSpec
from wearsim.testing.wear_and_loads import WEAR_LAW, WearLawFixture

FACTORS = {"cylinder": {"k_over_h": "1.1e-11 1/Pa"}, "roller": {"k_over_h": "0 1/Pa"}}
TESTED = {
    "archard-dissipation": [FACTORS],
    "t-gamma": [{}, {"roller": {"factor": 0.5}}],
}

for name, cases in TESTED.items():
    for number, options in enumerate(cases):
        globals()[f"test_{name.replace('-', '_')}_{number}"] = wear_law_tests(name, options)


def test_all_installed_wear_laws_are_tested():
    assert set(TESTED) == set(registry().names(WearLawSpec))


class LinearLaw(WearLaw):
    """Linear, on both bodies."""

    def depth_per_pass(self, body, solution, rolling_speed):
        return self.depth_per_dissipation(body, rolling_speed) * solution.dissipation

    def depth_per_dissipation(self, body, rolling_speed):
        return 1e-11 / rolling_speed


def law(depth, factor=None):
    """Return a law with the depth `depth(solution)` and the depth per dissipation `factor`."""

    class Mutant(LinearLaw):
        def depth_per_pass(self, body, solution, rolling_speed):
            return depth(solution)

        def depth_per_dissipation(self, body, rolling_speed):
            return factor

    return Mutant


class Drifting(LinearLaw):
    calls = 0

    def depth_per_pass(self, body, solution, rolling_speed):
        self.calls += 1
        return super().depth_per_pass(body, solution, rolling_speed) * self.calls


class ChangesInput(LinearLaw):
    def depth_per_pass(self, body, solution, rolling_speed):
        solution.dissipation[0] += 1.0
        return 1e-11 * np.maximum(replace(solution).line_load, 0.0)


MUTANTS = {
    "factory-builds-a-wear-law": [dict],
    "depth-is-never-negative": [
        law(lambda s: -1e-12 * s.dissipation),
        law(lambda s: s.dissipation[1:]),
        law(lambda s: s.dissipation / s.line_load.min()),
    ],
    "no-wear-outside-contact": [law(lambda s: s.dissipation + 1e-15)],
    "no-wear-without-dissipation": [law(lambda s: 1e-15 * s.line_load)],
    "linear-factor-matches-depth": [law(lambda s: 1e-12 * s.dissipation, 1.1e-12)],
    "depth-independent-of-strips": [law(lambda s: 1e-12 * s.dissipation / len(s.y))],
    "depth-is-reproducible": [Drifting, ChangesInput],
}
OF_SPECS = {"spec-is-complete", "options-reject-unknown-keys"}
CASES = [
    pytest.param(name, law_class, id=f"{name}-{number}")
    for name, laws in MUTANTS.items()
    for number, law_class in enumerate(laws)
]


def fixture(law_class):
    spec = WearLawSpec(
        "mutant", Options, "violates a requirement", factory=lambda options: law_class(), protocol=2
    )
    return WearLawFixture(ConfiguredSpec(spec))


@pytest.mark.parametrize(("name", "law_class"), CASES)
@pytest.mark.filterwarnings("ignore:(divide by zero|invalid value):RuntimeWarning")
def test_violations_are_reported(name, law_class):
    with pytest.raises(ConformanceError, match="wear law 'mutant': "):
        WEAR_LAW[name](fixture(law_class))


def test_base_class_of_the_mutants_conforms():
    for check in WEAR_LAW.values():
        check(fixture(LinearLaw))


def test_every_check_has_a_failing_wear_law():
    assert set(MUTANTS) | OF_SPECS == set(WEAR_LAW)


def test_sliding_contact_is_a_hertzian_ellipse():
    contact = sliding_contact(400)
    spacing = contact.y[1] - contact.y[0]
    assert contact.line_load.sum() * spacing == pytest.approx(300.0, rel=1e-4)
    assert contact.power == pytest.approx(-2.618 * 1e-3 * contact.force_x, rel=1e-4)
    # p = 2 q/(pi a) is largest in the middle
    middle = 2.0 * contact.line_load.max() / (np.pi * contact.half_length.max())
    assert contact.peak_pressure == pytest.approx(middle, rel=1e-3)
