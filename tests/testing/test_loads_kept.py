"""Every load and term that is installed keeps its promises; those that do not are told."""

from __future__ import annotations

import numpy as np
import pytest

from wearsim.models.loads import ThermalOptions, ThermalTerm
from wearsim.plugins import Load, LoadSpec, Options, registry
from wearsim.testing import PromiseBroken, load_tests
from wearsim.testing.loads import BY_ROLE, LoadBench
from wearsim.testing.specs import Chosen

LOG = "time [min], load [N]\n0, 300\n5, 320\n7, 280\n60, 305\n"
GIVEN = {
    "constant": [({"normal_force": "300 N"}, {})],
    "spring": [({"normal_force": "300 N", "stiffness": "690 N/mm"}, {})],
    "recorded": [({"file": "log.csv", "stiffness": "5 N/mm"}, {"files": {"log.csv": LOG}})],
    "thermal": [
        ({"gain": "50 N/W", "time_constant": "20 min"}, {}),
        ({"gain": "50 N/W", "time_constant": "1 s"}, {}),
    ],
}

for name, cases in GIVEN.items():
    for number, (options, more) in enumerate(cases):
        globals()[f"test_{name}_{number}"] = load_tests(name, options, **more)


def test_that_every_load_is_put_to_the_test():
    assert set(GIVEN) == set(registry().names(LoadSpec))


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
    return type("Spoilt", (Ramp,), members)


def lag(**members):
    return type("Spoilt", (Lag,), members)


def _written(self, time):
    time += 1.0
    return Ramp.force(self, time)


def _euler(self, state, power, duration):
    return state + duration / self.time_constant * (self.gain * power - state)


def _shared(self, state, power, duration):
    return ThermalTerm.advance(self, state, np.full_like(power, power.mean()), duration)


def _kept(self, state, power, duration):
    state *= 1.0 + 1e-9
    return ThermalTerm.mean_force(self, state, power, duration)


MUTANTS = {
    "base": {
        "spec-says-what-it-is": [],
        "options-refuse-what-they-do-not-know": [],
        "role-is-what-the-factory-builds": [Lag],
        "span-is-a-stretch-of-time": [ramp(span=(10.0, 0.0)), ramp(stiffness=-1.0)],
        "force-is-the-same-however-it-is-asked": [
            ramp(force=_written),
            ramp(force=lambda self, time: 300.0 + 0.01 * np.cumsum(np.ravel(time))),
            ramp(force=lambda self, time: np.where(time > 60.0, np.nan, 300.0)),
        ],
        "mean-is-that-of-the-force": [
            ramp(mean=lambda self, start, stop: 300.0),
            ramp(mean=lambda self, start, stop: 1.00001 * Ramp.mean(self, start, stop)),
        ],
        "deviation-is-that-of-the-force": [ramp(deviation=lambda self, start, stop: 0.0)],
        "extremes-hold-the-force": [
            ramp(extremes=lambda self, start, stop: (300.0, 301.0)),
            ramp(extremes=lambda self, start, stop: (0.0, 1e6)),
        ],
    },
    "term": {
        "two-half-steps-are-one": [
            lag(advance=_euler),
            lag(advance=lambda self, state, power, duration: state + 1.0),
        ],
        "mean-force-follows-the-state": [
            lag(mean_force=lambda self, state, power, duration: state),
            lag(mean_force=lambda self, state, power, duration: self.gain * power),
        ],
        "rollers-go-by-themselves": [lag(advance=_shared), lag(mean_force=_kept)],
        "lag-is-a-first-order-lag": [lag(lag=lambda self: (51.0, 1200.0))],
    },
}
OF_ALL = set(list(MUTANTS["base"])[:3])
CASES = [
    pytest.param(role, name, made, id=f"{name}-{number}")
    for role, checks in MUTANTS.items()
    for name, loads in checks.items()
    for number, made in enumerate(loads)
]


def bench(made, role):
    spec = LoadSpec("mutant", Options, "breaks a promise", factory=lambda o: made(), role=role)
    return LoadBench(Chosen(spec))


@pytest.mark.parametrize(("role", "name", "made"), CASES)
def test_that_a_broken_promise_is_told(role, name, made):
    with pytest.raises(PromiseBroken, match="load 'mutant': "):
        BY_ROLE[role][name](bench(made, role))


@pytest.mark.parametrize(("role", "made"), [("base", Ramp), ("term", Lag)])
def test_that_what_mutants_are_made_of_keeps_every_promise(role, made):
    for check in BY_ROLE[role]:
        check(bench(made, role))


def test_that_every_check_has_a_load_that_fails_it():
    for role, checks in MUTANTS.items():
        assert set(BY_ROLE[role].names) == set(checks) | OF_ALL
