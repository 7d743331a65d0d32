"""Conformance tests of the installed fatigue laws, of mutants of one, and their closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from wearsim.plugins import FatigueLaw, FatigueLawSpec, Options, registry
from wearsim.testing import ConformanceError, fatigue_law_tests
from wearsim.testing.checks import ConfiguredSpec
from wearsim.testing.fatigue_laws import FATIGUE_LAW, FatigueLawFixture

POWER = {"reference_passes": 1e6, "reference_pressure": "1 GPa", "exponent": 8.0}
TESTED = {
    "pressure-life": [POWER, {**POWER, "endurance_pressure": "600 MPa"}],
    "load-stress-factor": [{"a": 7.74, "b": 37.63, "unit": "psi"}],
}

for name, cases in TESTED.items():
    for number, options in enumerate(cases):
        globals()[f"test_{name.replace('-', '_')}_{number}"] = fatigue_law_tests(name, options)


def test_all_installed_fatigue_laws_are_tested():
    assert set(TESTED) == set(registry().names(FatigueLawSpec))


def mutant(change, build=None):
    def factory(options, contact_modulus):
        law = {"damage_per_pass": lambda self, p: change(np.asarray((p / 1e9) ** 8.0))}
        return type("Mutant", (FatigueLaw,), law)()

    spec = FatigueLawSpec(
        "mutant", Options, "violates a requirement", factory=build or factory, protocol=2
    )
    return FatigueLawFixture(ConfiguredSpec(spec))


COUNT = iter(range(1, 10_000))
MUTANTS = {
    "factory-builds-a-fatigue-law": mutant(None, lambda *arguments: object()),
    "damage-is-elementwise": mutant(lambda damage: damage + damage.max()),
    "no-damage-without-pressure": mutant(lambda damage: damage + 1e-9),
    "damage-never-falls-with-the-pressure": mutant(lambda damage: damage * (2e3 - damage)),
    "damage-is-repeatable": mutant(lambda damage: damage * next(COUNT)),
}


@pytest.mark.parametrize("name", MUTANTS)
def test_violations_are_reported(name):
    with pytest.raises(ConformanceError, match="fatigue law 'mutant': "):
        FATIGUE_LAW[name](MUTANTS[name])


def test_every_check_has_a_failing_law():
    common = {"spec-is-complete", "options-reject-unknown-keys"}
    assert set(FATIGUE_LAW) == set(MUTANTS) | common


def law(name, options, modulus=110e9):
    spec = registry().get(FatigueLawSpec, name)
    return spec.factory(spec.options.model_validate_json(json_of(options), strict=True), modulus)


def json_of(options):
    import json

    return json.dumps(options)


def test_load_stress_factor_is_a_power_of_the_pressure():
    # K = pi p^2/E*; at K = 1000 psi the life is 10^(B - 3 A)
    modulus, psi = 113e9, 6894.757293168
    pressure = np.array([np.sqrt(1000.0 * psi * modulus / np.pi)])
    life = 1.0 / law(
        "load-stress-factor", TESTED["load-stress-factor"][0], modulus
    ).damage_per_pass(np.concatenate([pressure, 2.0 * pressure]))
    assert np.log10(life[0]) == pytest.approx(37.63 - 3.0 * 7.74, abs=1e-10)
    assert life[0] / life[1] == pytest.approx(2.0 ** (2.0 * 7.74), rel=1e-12)


def test_endurance_pressure_ends_the_damage():
    pressures = np.array([5.9e8, 6e8, 6.1e8])
    damage = law("pressure-life", TESTED["pressure-life"][1]).damage_per_pass(pressures)
    assert damage[:2].tolist() == [0.0, 0.0]
    assert damage[2] == pytest.approx(0.61**8 / 1e6, rel=1e-12)
