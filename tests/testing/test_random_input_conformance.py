"""Conformance tests of the installed random inputs, and of mutants of them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from wearsim.errors import PluginError
from wearsim.models.random.distributions import Disc, DiscOptions
from wearsim.models.random.varying import (
    OrnsteinUhlenbeck,
    OrnsteinUhlenbeckOptions,
    White,
    WhiteOptions,
)
from wearsim.plugins import Distribution, Options, RandomInputSpec, registry
from wearsim.testing import ConformanceError, random_input_tests
from wearsim.testing.checks import ConfiguredSpec
from wearsim.testing.random_inputs import BY_ROLE, RandomInputFixture
from wearsim.units import ANGLE, FORCE, WEAR_FACTOR

FILES = {"loads.csv": "value [N]\n280\n300\n300\n340\n", "table.csv":
         "probability, value [N]\n0, 250\n0.3, 290\n1, 350\n"}  # fmt: skip
POSTERIOR = {"levels.csv": "# specimens: 8\nmedian [1/Pa], scatter, weight\n"
             "1e-11, 0.2, 1\n1.2e-11, 0.3, 2\n1.5e-11, 0.4, 1\n"}  # fmt: skip
LOAD = {"kind": FORCE, "files": FILES}
FRICTION = {"marginal": ("uniform", {"low": 0.08, "high": 0.12})}
TESTED = {
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
    "mixture": [
        (
            {
                "of": [
                    {"distribution": "normal", "mean": "300 N", "std": "20 N"},
                    {"distribution": "uniform", "low": "100 N", "high": "200 N"},
                ],
                "weights": [0.7, 0.3],
            },
            LOAD,
        ),
        (
            {
                "of": [
                    {"distribution": "lognormal", "median": 0.1, "factor": 1.2},
                    {"distribution": "constant", "value": 0.15},
                ],
                "weights": [3, 1],
            },
            {},
        ),
    ],
    "posterior": [({"file": "levels.csv"}, {"kind": WEAR_FACTOR, "files": POSTERIOR})],
    "disc": [({"radius": "2 mrad"}, {"kind": ANGLE})],
    "white": [({}, FRICTION), ({"frame": "roller"}, FRICTION)],
    "gaussian-field": [({"correlation_length": "50 um"}, FRICTION)],
    "ornstein-uhlenbeck": [
        ({"correlation_time": "5 min"}, FRICTION),
        ({"correlation_time": "5 min", "spacing": "75 s"}, FRICTION),
    ],
}

for name, cases in TESTED.items():
    for number, (options, keywords) in enumerate(cases):
        item = f"test_{name.replace('-', '_')}_{number}"
        globals()[item] = random_input_tests(name, options, **keywords)


def test_all_installed_random_inputs_are_tested():
    assert set(TESTED) == set(registry().names(RandomInputSpec))


def test_field_without_marginal_is_refused_by_the_name_of_the_argument():
    with pytest.raises(TypeError, match=r"'white' is a field: give .* as marginal=\("):
        random_input_tests("white")


def test_values_with_units_need_a_kind():
    disc = ConfiguredSpec(registry().get(RandomInputSpec, "disc"), {"radius": "2 mrad"})
    with pytest.raises(PluginError, match="values with units need the argument kind"):
        _ = disc.options


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


def fixture(input_class, role="scalar", **changes):
    spec = {"name": "mutant", "options": Options, "summary": "violates a requirement"} | changes
    spec = RandomInputSpec(factory=lambda options: input_class(), role=role, protocol=2, **spec)
    return RandomInputFixture(ConfiguredSpec(spec))


def flat(**members):
    return type("Mutant", (Flat,), members)


class Drifting(Flat):
    calls = 0

    def quantile(self, probability):
        self.calls += 1
        return super().quantile(probability) * (1.0 + 1e-15 * self.calls)


class ChangesInput(Flat):
    def quantile(self, probability):
        found = super().quantile(probability)
        if np.ndim(probability):
            probability *= 0.5
        return found


class Slack(Disc):
    def __init__(self):
        super().__init__(DiscOptions(radius=2e-3))


def slack(**members):
    return type("Mutant", (Slack,), members)


class Noise(White):
    def __init__(self):
        super().__init__(WhiteOptions(), uniform())


def noise(**members):
    return type("Mutant", (Noise,), members)


class UnknownFrame(Noise):
    def __init__(self):
        super().__init__()
        self.frame = "ground"


class Wander(OrnsteinUhlenbeck):
    def __init__(self):
        super().__init__(OrnsteinUhlenbeckOptions.model_construct(
            correlation_time=300.0, spacing=None), uniform())  # fmt: skip


def wander(**members):
    return type("Mutant", (Wander,), members)


def _uniform_in_space(field, x, y, uniforms):
    return field.marginal.quantile(np.full(x.shape, 0.3))


MUTANTS = {
    "scalar": {
        "spec-is-complete": [],
        "options-reject-unknown-keys": [],
        "factory-matches-role": [Slack],
        "quantile-rises-within-support": [
            flat(support=(2.1, 4.0)),
            flat(quantile=lambda self, p: 4.0 - 2.0 * p, support=(4.0, 2.0)),
            flat(quantile=lambda self, p: None, support=(2.0, 4.0)),
            flat(quantile=lambda self, p: 2.0 + 2.0 * p + 0.5 * np.sin(6 * np.pi * p)),
            flat(quantile=lambda self, p: np.where(p == 0.5, np.nan, 2.0 + 2.0 * p)),
        ],
        "quantile-keeps-shape": [flat(quantile=lambda self, p: np.ravel(2.0 + 2.0 * p))],
        "quantile-is-reproducible": [Drifting, ChangesInput],
        "mean-and-std-match-quantile": [flat(mean=3.01), flat(std=0.6)],
        "cdf-and-pdf-match-quantile": [
            flat(cdf=lambda self, value: 0.5 * (value - 2.01)),
            flat(pdf=lambda self, value: np.full_like(value, 0.51)),
        ],
    },
    "joint": {
        "components-are-named": [slack(components=("yaw", "yaw")), slack(mean=(0.0,))],
        "joint-draws-match-mean-and-reach": [
            slack(reach=(1e-3, 1e-3)),
            slack(mean=(1e-4, 0.0)),
            slack(values=lambda self, uniform: uniform[:, :1]),
        ],
        "joint-draws-independent-of-batch": [
            slack(values=lambda self, uniform: uniform * len(uniform))
        ],
    },
    "field": {
        "field-matches-marginal": [
            UnknownFrame,
            noise(values=_uniform_in_space),
            noise(
                values=lambda self, x, y, u: (
                    self.marginal.quantile(u(0, x.size)).reshape(x.shape) * 1.05
                )
            ),
        ],
        "field-is-reproducible": [noise(values=_uniform_in_space)],
        "field-reports-coarse-grids": [
            noise(unresolved=lambda self, along, across: "too coarse"),
            noise(unresolved=lambda self, along, across: False),
        ],
    },
    "process": {
        "longer-path-extends-shorter": [
            wander(path=lambda self, points, u: self.marginal.quantile(u(0, points)[::-1])),
            wander(path=lambda self, points, u: np.full(points, 3.0)),
        ],
        "process-matches-marginal": [
            wander(path=lambda self, points, u: 2.0 + 2.5 * u(0, points)),
            wander(path=lambda self, points, u: np.full(points, 3.0)),
        ],
    },
}
COMMON = set(list(MUTANTS["scalar"])[:3])
CASES = [
    pytest.param(role, name, input_class, id=f"{name}-{number}")
    for role, checks in MUTANTS.items()
    for name, classes in checks.items()
    for number, input_class in enumerate(classes)
]


@pytest.mark.parametrize(("role", "name", "input_class"), CASES)
def test_violations_are_reported(role, name, input_class):
    with pytest.raises(ConformanceError, match="random input 'mutant': "):
        BY_ROLE[role][name](fixture(input_class, role))


@pytest.mark.parametrize(
    ("role", "input_class"),
    [("scalar", Flat), ("joint", Slack), ("field", Noise), ("process", Wander)],
)
def test_base_classes_of_the_mutants_conform(role, input_class):
    for check in BY_ROLE[role].values():
        check(fixture(input_class, role))


def test_every_check_has_a_failing_random_input():
    for role, checks in MUTANTS.items():
        assert set(BY_ROLE[role]) == set(checks) | COMMON


@pytest.mark.parametrize("change", [{"name": "Flat"}, {"summary": "two\nlines"}])
def test_invalid_specs_are_reported(change):
    with pytest.raises(ConformanceError):
        BY_ROLE["scalar"]["spec-is-complete"](fixture(Flat, **change))


def test_mutable_options_are_reported():
    loose = SimpleNamespace(configured=SimpleNamespace(spec=SimpleNamespace(
        options=type("Loose", (Options,), {"model_config": {"frozen": False}}))))  # fmt: skip
    check = BY_ROLE["scalar"]["options-reject-unknown-keys"]
    with pytest.raises(ConformanceError, match="can be changed"):
        check(loose)
