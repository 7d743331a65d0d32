"""Conformance tests of the installed loads and load terms, and of mutants of them."""

from __future__ import annotations

import numpy as np
import pytest

from wearsim.models.loads import ThermalOptions, ThermalTerm
from wearsim.plugins import Load, LoadSpec, Options, registry
from wearsim.testing import ConformanceError, load_tests
from wearsim.testing.checks import ConfiguredSpec
from wearsim.testing.wear_and_loads import LOADS, LoadFixture

LOG = "time [min], load [N]\n0, 300\n5, 320\n7, 280\n60, 305\n"
PAUSED = "time [min], load [N]\n0, 0\n5, 0\n7, 280\n20, 290\n21, 0\n30, 0\n40, 10\n60, 305\n"
FORCE = {"f.csv": "angle [deg], force [N]\n0, 10\n90, 20\n180, 10\n270, 0\n"}
TESTED = {
    "constant": [({"normal_force": "300 N"}, {})],
    "spring": [({"normal_force": "300 N", "stiffness": "690 N/mm"}, {})],
    "follower": [
        ({"preload": "300 N", "stiffness": "5 N/mm", "external": "f.csv"}, {"files": FORCE})
    ],
    "follower-arm": [({"preload": "24 N m", "stiffness": "32 N m/rad"}, {})],
    "recorded": [
        ({"file": "log.csv", "stiffness": "5 N/mm"}, {"files": {"log.csv": LOG}}),
        ({"file": "log.csv"}, {"files": {"log.csv": PAUSED}}),
    ],
    "thermal": [
        ({"gain": "50 N/W", "time_constant": "20 min"}, {}),
        ({"gain": "50 N/W", "time_constant": "1 s"}, {}),
    ],
}

for name, cases in TESTED.items():
    for number, (options, keywords) in enumerate(cases):
        globals()[f"test_{name}_{number}"] = load_tests(name, options, **keywords)


def test_all_installed_loads_are_tested():
    assert set(TESTED) == set(registry().names(LoadSpec))


class Ramp(Load):
    """Rises by 1 N in 100 s."""

    def force(self, time):
        return 300.0 + 0.01 * np.asarray(time)

    def mean(self, start, stop):
        return 300.0 + 0.005 * (start + stop)

    def deviation(self, start, stop):
        return 0.01 * (stop - start) / 12**0.5


class Lag(ThermalTerm):
    def __init__(self):
        super().__init__(ThermalOptions(gain="50 N/W", time_constant="20 min"))


def ramp(**members):
    return type("Mutant", (Ramp,), members)


def lag(**members):
    return type("Mutant", (Lag,), members)


def _force_changes_input(self, time):
    time += 1.0
    return Ramp.force(self, time)


def _advance_by_euler(self, state, power, duration):
    return state + duration / self.time_constant * (self.gain * power - state)


def _advance_by_mean_power(self, state, power, duration):
    return ThermalTerm.advance(self, state, np.full_like(power, power.mean()), duration)


def _mean_force_changes_input(self, state, power, duration):
    state *= 1.0 + 1e-9
    return ThermalTerm.mean_force(self, state, power, duration)


MUTANTS = {
    "base": {
        "spec-is-complete": [],
        "options-reject-unknown-keys": [],
        "factory-matches-role": [Lag],
        "span-is-an-interval": [ramp(span=(10.0, 0.0)), ramp(stiffness=-1.0)],
        "force-is-elementwise": [
            ramp(force=_force_changes_input),
            ramp(force=lambda self, time: 300.0 + 0.01 * np.cumsum(np.ravel(time))),
            ramp(force=lambda self, time: np.where(time > 60.0, np.nan, 300.0)),
        ],
        "mean-matches-force": [
            ramp(mean=lambda self, start, stop: 300.0),
            ramp(mean=lambda self, start, stop: 1.00001 * Ramp.mean(self, start, stop)),
        ],
        "deviation-matches-force": [ramp(deviation=lambda self, start, stop: 0.0)],
        "extremes-bound-force": [
            ramp(extremes=lambda self, start, stop: (300.0, 301.0)),
            ramp(extremes=lambda self, start, stop: (0.0, 1e6)),
        ],
        "pauses-are-without-load": [
            ramp(pauses=np.array([[10.0, 20.0]])),
            ramp(pauses=np.array([[20.0, 10.0]])),
            ramp(pauses=np.array([10.0, 20.0])),
        ],
    },
    "term": {
        "two-half-steps-equal-one": [
            lag(advance=_advance_by_euler),
            lag(advance=lambda self, state, power, duration: state + 1.0),
        ],
        "mean-force-matches-state": [
            lag(mean_force=lambda self, state, power, duration: state),
            lag(mean_force=lambda self, state, power, duration: self.gain * power),
        ],
        "rollers-are-independent": [
            lag(advance=_advance_by_mean_power),
            lag(mean_force=_mean_force_changes_input),
        ],
        "lag-parameters-match": [lag(lag=lambda self: (51.0, 1200.0))],
    },
}
COMMON = set(list(MUTANTS["base"])[:3])
CASES = [
    pytest.param(role, name, load_class, id=f"{name}-{number}")
    for role, checks in MUTANTS.items()
    for name, load_classes in checks.items()
    for number, load_class in enumerate(load_classes)
]


def fixture(load_class, role):
    spec = LoadSpec(
        "mutant",
        Options,
        "violates a requirement",
        factory=lambda o: load_class(),
        role=role,
        protocol=2,
    )
    return LoadFixture(ConfiguredSpec(spec))


@pytest.mark.parametrize(("role", "name", "load_class"), CASES)
def test_violations_are_reported(role, name, load_class):
    with pytest.raises(ConformanceError, match="load 'mutant': "):
        LOADS[role][name](fixture(load_class, role))


@pytest.mark.parametrize(("role", "load_class"), [("base", Ramp), ("term", Lag)])
def test_base_classes_of_the_mutants_conform(role, load_class):
    for check in LOADS[role].values():
        check(fixture(load_class, role))


def test_every_check_has_a_failing_load():
    for role, checks in MUTANTS.items():
        assert set(LOADS[role]) == set(checks) | COMMON
