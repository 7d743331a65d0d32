"""Every random input that is installed keeps what its role promises; those that do not are told."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from wearsim.models.random.distributions import Disc, DiscOptions
from wearsim.models.random.friction_fields import White, WhiteOptions
from wearsim.models.random.processes import OrnsteinUhlenbeck, OrnsteinUhlenbeckOptions
from wearsim.plugins import Distribution, Options, RandomInputSpec, registry
from wearsim.testing import PromiseBroken, random_input_tests
from wearsim.testing.random_bench import RandomBench
from wearsim.testing.random_inputs import BY_ROLE
from wearsim.testing.specs import Chosen
from wearsim.units import ANGLE, FORCE

FILES = {"loads.csv": "value [N]\n280\n300\n300\n340\n", "table.csv":
         "probability, value [N]\n0, 250\n0.3, 290\n1, 350\n"}  # fmt: skip
LOAD = {"kind": FORCE, "files": FILES}
FRICTION = {"marginal": ("uniform", {"low": 0.08, "high": 0.12})}
GIVEN = {
    "maxent": [
        ({"support": ["0 N", "inf"], "mean": "307 N", "std": "32 N"}, LOAD),
        ({"support": ["-inf", "inf"], "mean": "307 N", "std": "32 N"}, LOAD),
        ({"support": [0, 1], "mean": 1e-3, "std": 4e-4}, {}),
        ({"support": [0, "inf"], "mean": 1.0, "mean_log": -0.5}, {}),
    ],
    "normal": [({"mean": "300 N", "std": "30 N"}, LOAD)],
    "lognormal": [
        ({"mean": "300 N", "std": "60 N"}, LOAD),
        ({"median": 0.1, "factor": 1.5}, {}),
    ],
    "uniform": [({"low": "250 N", "high": "350 N"}, LOAD)],
    "truncated-normal": [
        ({"parent_mean": "300 N", "parent_std": "60 N", "support": ["200 N", "inf"]}, LOAD)
    ],
    "constant": [({"value": "300 N"}, LOAD)],
    "table": [({"file": "loads.csv"}, LOAD), ({"file": "table.csv"}, LOAD)],
    "disc": [({"radius": "2 mrad"}, {"kind": ANGLE})],
    "white": [({}, FRICTION), ({"frame": "roller"}, FRICTION)],
    "gaussian-field": [({"correlation_length": "50 um"}, FRICTION)],
    "ornstein-uhlenbeck": [
        ({"correlation_time": "5 min"}, FRICTION),
        ({"correlation_time": "5 min", "spacing": "75 s"}, FRICTION),
    ],
}

for name, cases in GIVEN.items():
    for number, (options, more) in enumerate(cases):
        item = f"test_{name.replace('-', '_')}_{number}"
        globals()[item] = random_input_tests(name, options, **more)


def test_that_every_random_input_is_put_to_the_test():
    assert set(GIVEN) == set(registry().names(RandomInputSpec))


class Flat(Distribution):
    """Uniform from 2 to 4, with its cdf and pdf."""

    low, high = 2.0, 4.0

    def quantile(self, probability):
        return self.low + (self.high - self.low) * probability

    def cdf(self, value):
        return (value - self.low) / (self.high - self.low)

    def pdf(self, value):
        return np.full_like(value, 1.0 / (self.high - self.low))


def uniform():
    return Flat()


def bench(thing, role="scalar", **changes):
    spec = {"name": "mutant", "options": Options, "summary": "breaks a promise"} | changes
    made = RandomInputSpec(factory=lambda options: thing(), role=role, **spec)
    return RandomBench(Chosen(made))


def flat(**members):
    return type("Spoilt", (Flat,), members)


class Counting(Flat):
    asked = 0

    def quantile(self, probability):
        self.asked += 1
        return super().quantile(probability) * (1.0 + 1e-15 * self.asked)


class Writing(Flat):
    def quantile(self, probability):
        found = super().quantile(probability)
        if np.ndim(probability):
            probability *= 0.5
        return found


class Slack(Disc):
    def __init__(self):
        super().__init__(DiscOptions(radius=2e-3))


def slack(**members):
    return type("Spoilt", (Slack,), members)


class Noise(White):
    def __init__(self):
        super().__init__(WhiteOptions(), uniform())


def noise(**members):
    return type("Spoilt", (Noise,), members)


class Grounded(Noise):
    def __init__(self):
        super().__init__()
        self.frame = "ground"


class Wander(OrnsteinUhlenbeck):
    def __init__(self):
        super().__init__(OrnsteinUhlenbeckOptions.model_construct(
            correlation_time=300.0, spacing=None), uniform())  # fmt: skip


def wander(**members):
    return type("Spoilt", (Wander,), members)


def standing(field, x, y, uniforms):
    return field.marginal.quantile(np.full(x.shape, 0.3))


MUTANTS = {
    "scalar": {
        "spec-says-what-it-is": [],
        "options-refuse-what-they-do-not-know": [],
        "role-is-what-the-factory-builds": [Slack],
        "quantile-rises-within-the-support": [
            flat(support=(2.1, 4.0)),
            flat(quantile=lambda self, p: 4.0 - 2.0 * p, support=(4.0, 2.0)),
            flat(quantile=lambda self, p: 2.0 + 2.0 * p + 0.5 * np.sin(6 * np.pi * p)),
            flat(quantile=lambda self, p: np.where(p == 0.5, np.nan, 2.0 + 2.0 * p)),
        ],
        "quantile-takes-any-shape": [flat(quantile=lambda self, p: np.ravel(2.0 + 2.0 * p))],
        "quantile-has-the-same-bits-twice": [Counting, Writing],
        "mean-and-std-are-those-of-the-quantiles": [flat(mean=3.01), flat(std=0.6)],
        "cdf-and-pdf-belong-to-the-quantiles": [
            flat(cdf=lambda self, value: 0.5 * (value - 2.01)),
            flat(pdf=lambda self, value: np.full_like(value, 0.51)),
        ],
    },
    "joint": {
        "components-are-named": [slack(components=("yaw", "yaw")), slack(mean=(0.0,))],
        "joint-draws-keep-mean-and-reach": [
            slack(reach=(1e-3, 1e-3)),
            slack(mean=(1e-4, 0.0)),
            slack(values=lambda self, uniform: uniform[:, :1]),
        ],
        "joint-draws-have-the-same-bits-alone": [
            slack(values=lambda self, uniform: uniform * len(uniform))
        ],
    },
    "field": {
        "field-stays-in-its-marginal": [
            Grounded,
            noise(values=standing),
            noise(
                values=lambda self, x, y, u: (
                    self.marginal.quantile(u(0, x.size)).reshape(x.shape) * 1.05
                )
            ),
        ],
        "field-has-the-same-bits-twice": [noise(values=standing)],
        "field-tells-which-grids-are-too-coarse": [
            noise(unresolved=lambda self, along, across: "too coarse"),
            noise(unresolved=lambda self, along, across: False),
        ],
    },
    "process": {
        "path-begins-with-the-shorter-one": [
            wander(path=lambda self, points, u: self.marginal.quantile(u(0, points)[::-1])),
            wander(path=lambda self, points, u: np.full(points, 3.0)),
        ],
        "process-stays-in-its-marginal": [
            wander(path=lambda self, points, u: 2.0 + 2.5 * u(0, points)),
            wander(path=lambda self, points, u: np.full(points, 3.0)),
        ],
    },
}
OF_ALL = set(list(MUTANTS["scalar"])[:3])
CASES = [
    pytest.param(role, name, thing, id=f"{name}-{number}")
    for role, checks in MUTANTS.items()
    for name, things in checks.items()
    for number, thing in enumerate(things)
]


@pytest.mark.parametrize(("role", "name", "thing"), CASES)
def test_that_a_broken_promise_is_told(role, name, thing):
    with pytest.raises(PromiseBroken, match="random input 'mutant': "):
        BY_ROLE[role][name](bench(thing, role))


@pytest.mark.parametrize(
    ("role", "thing"), [("scalar", Flat), ("joint", Slack), ("field", Noise), ("process", Wander)]
)
def test_that_what_mutants_are_made_of_keeps_every_promise(role, thing):
    for check in BY_ROLE[role]:
        check(bench(thing, role))


def test_that_every_check_has_a_random_input_that_fails_it():
    for role, checks in MUTANTS.items():
        assert set(BY_ROLE[role].names) == set(checks) | OF_ALL


@pytest.mark.parametrize("change", [{"name": "Flat"}, {"summary": "two\nlines"}])
def test_that_a_broken_spec_is_told(change):
    with pytest.raises(PromiseBroken):
        BY_ROLE["scalar"]["spec-says-what-it-is"](bench(Flat, **change))


def test_that_open_options_are_told():
    loose = SimpleNamespace(chosen=SimpleNamespace(spec=SimpleNamespace(
        options=type("Loose", (Options,), {"model_config": {"frozen": False}}))))  # fmt: skip
    check = BY_ROLE["scalar"]["options-refuse-what-they-do-not-know"]
    with pytest.raises(PromiseBroken, match="can be changed"):
        check(loose)
