"""Every wear law that is installed keeps what a wear law promises; those that do not are told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from wearsim.plugins import Options, WearLaw, WearLawSpec, registry
from wearsim.testing import PromiseBroken, sliding_contact, wear_law_tests
from wearsim.testing.specs import Chosen
from wearsim.testing.wear_laws import WEAR_LAW, WearLawBench

FACTORS = {"cylinder": {"k_over_h": "1.1e-11 1/Pa"}, "roller": {"k_over_h": "0 1/Pa"}}
GIVEN = {
    "archard-dissipation": [FACTORS],
    "t-gamma": [{}, {"roller": {"factor": 0.5}}],
}

for name, cases in GIVEN.items():
    for number, options in enumerate(cases):
        globals()[f"test_{name.replace('-', '_')}_{number}"] = wear_law_tests(name, options)


def test_that_every_wear_law_is_put_to_the_test():
    assert set(GIVEN) == set(registry().names(WearLawSpec))


class Sound(WearLaw):
    """Linear, on both bodies."""

    def depth_per_pass(self, body, solution, rolling_speed):
        return self.depth_per_dissipation(body, rolling_speed) * solution.dissipation

    def depth_per_dissipation(self, body, rolling_speed):
        return 1e-11 / rolling_speed


def law(depth, factor=None):
    """Return a law with the depth `depth(solution)` and the depth per dissipation `factor`."""

    class Spoilt(Sound):
        def depth_per_pass(self, body, solution, rolling_speed):
            return depth(solution)

        def depth_per_dissipation(self, body, rolling_speed):
            return factor

    return Spoilt


class Restless(Sound):
    asked = 0

    def depth_per_pass(self, body, solution, rolling_speed):
        self.asked += 1
        return super().depth_per_pass(body, solution, rolling_speed) * self.asked


class Scribbling(Sound):
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
    "nothing-wears-outside-the-contact": [law(lambda s: s.dissipation + 1e-15)],
    "nothing-wears-where-nothing-slides": [law(lambda s: 1e-15 * s.line_load)],
    "linear-law-is-linear": [law(lambda s: 1e-12 * s.dissipation, 1.1e-12)],
    "depth-does-not-depend-on-the-strips": [law(lambda s: 1e-12 * s.dissipation / len(s.y))],
    "depth-has-the-same-bits-twice": [Restless, Scribbling],
}
OF_SPECS = {"spec-says-what-it-is", "options-refuse-what-they-do-not-know"}
CASES = [
    pytest.param(name, made, id=f"{name}-{number}")
    for name, laws in MUTANTS.items()
    for number, made in enumerate(laws)
]


def bench(made):
    spec = WearLawSpec("mutant", Options, "breaks a promise", factory=lambda options: made())
    return WearLawBench(Chosen(spec))


@pytest.mark.parametrize(("name", "made"), CASES)
@pytest.mark.filterwarnings("ignore:(divide by zero|invalid value):RuntimeWarning")
def test_that_a_broken_promise_is_told(name, made):
    with pytest.raises(PromiseBroken, match="wear law 'mutant': "):
        WEAR_LAW[name](bench(made))


def test_that_what_mutants_are_made_of_keeps_every_promise():
    for check in WEAR_LAW:
        check(bench(Sound))


def test_that_every_check_has_a_law_that_fails_it():
    assert set(MUTANTS) | OF_SPECS == set(WEAR_LAW.names)


def test_that_the_sliding_contact_is_a_hertzian_ellipse():
    contact = sliding_contact(400)
    spacing = contact.y[1] - contact.y[0]
    assert contact.line_load.sum() * spacing == pytest.approx(300.0, rel=1e-4)
    assert contact.power == pytest.approx(-2.618 * 1e-3 * contact.force_x, rel=1e-4)
    # p = 2 q/(pi a) is greatest in the middle, where the ellipse is longest
    middle = 2.0 * contact.line_load.max() / (np.pi * contact.half_length.max())
    assert contact.peak_pressure == pytest.approx(middle, rel=1e-3)
