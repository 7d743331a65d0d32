"""Topic `savings`: speed-up and errors of omitted computations."""

import json

import numpy as np
import pytest

from wearsim.models.contact.strip_model import SemiHertzian
from wearsim_bench.contact.methods import Method, compared_models
from wearsim_bench.measure.measurement import Effort
from wearsim_bench.savings.contacts import (
    MeanContact,
    closed_forms,
    fields,
    strips_outside,
    uniform_friction,
)
from wearsim_bench.savings.runs import OFFSETS, RIG, STEPPERS
from wearsim_bench.savings.saving import Alternatives, Saving
from wearsim_bench.savings.topic import savings
from wearsim_bench.stepping.runs import PreparedTest, WearTest

QUICK = Effort(quick=True, repetitions=1)
STEPPED_THEORIES = (
    "hertz, fastsim",
    "hertz, fastsim, bound parabolic",
    "hertz, fastsim, flexibility one",
    "hertz-fastsim",
)


@pytest.fixture(scope="module")
def topic():
    return savings(QUICK, lambda what, part: None)


def rows(topic, group):
    by_method = {}
    for item in topic.of(group):
        by_method.setdefault(item.method, []).append(item)
    return by_method


def test_all_savings_have_speed_ups(topic):
    assert len(topic.groups) == 8
    for item in topic.measurements:
        assert item.failed == ""
        assert item.seconds > 0.0
    for group in topic.groups:
        for items in rows(topic, group).values():
            assert [item.default for item in items] == [True, *(False for _ in items[1:])]
            assert items[0].counts["times"] == items[-1].seconds / items[0].seconds
    json.dumps(topic.as_json())


def test_closed_form_is_more_accurate_than_steps(topic):
    by_method = rows(topic, "no spin")
    for method in STEPPED_THEORIES:
        closed, stepped = by_method[method]
        assert closed.errors["result"] < 0.1 * stepped.errors["result"] < 1e-3


@pytest.mark.parametrize(
    ("group", "most"),
    [
        ("identical rollers", 1e-7),  # effect of OFFSETS
        ("records", 0.0),
        ("idle inputs", 0.0),
        ("fields", 0.0),
        ("strips outside", 1e-4),  # relative to as many strips in the contact
        ("uniform friction", 1e-3),  # relative to many steps
    ],
)
def test_savings_keep_the_result(topic, group, most):
    assert all(item.errors["result"] <= most for item in topic.of(group))


def test_all_models_are_included():
    named = {saving.method.split(",")[0] for saving in strips_outside()}
    assert named == set(compared_models())
    assert {"hertz, strip", "hertz, fastrip", *STEPPED_THEORIES} == {
        saving.method for saving in closed_forms()
    }


@pytest.mark.parametrize(
    ("stepper", "model"),
    [
        (stepper, model)
        for stepper in STEPPERS
        for model in compared_models()
        if stepper != "implicit" or Method(model).spec.capabilities.coupled
    ],
)
def test_identical_rollers_are_one_contact(stepper, model):
    changes = {"evolution.stepper": stepper, "contact": {"model": model}}
    test = WearTest(RIG, 0.2)
    merged = PreparedTest(test.scenario_with(changes)).problem
    separate = PreparedTest(test.scenario_with({**changes, "roller.offset": OFFSETS})).problem
    assert (merged.shape[1], separate.shape[1]) == (1, 3)
    assert merged.kinematics.physical_rollers == separate.kinematics.physical_rollers == 3.0


def test_wide_grid_has_strips_outside_the_contact():
    usual, wide = (MeanContact(Method("slender"), wide=times) for times in (1, 3))
    touching = [
        np.count_nonzero(rig.model.solve_one(rig.gap, rig.curvature, rig.point).line_load)
        for rig in (usual, wide)
    ]
    assert touching[0] == touching[1] > 0.8 * usual.grid.strips
    assert wide.grid.strips == 3 * usual.grid.strips


def test_failed_alternative_is_reported():
    def fail():
        raise RuntimeError("no result")

    alternatives = Alternatives({"short": lambda: np.ones(3), "long": fail})
    (row,) = Saving("problems", "method", lambda: alternatives).measured(1)
    assert row.failed == "raised RuntimeError: no result"
    assert row.setting == "short"


@pytest.mark.parametrize("kind", [strips_outside, fields, uniform_friction])
def test_faulty_model_does_not_stop_the_others(kind, monkeypatch):
    def fail(self, *arguments):
        raise TypeError("no grid")

    monkeypatch.setattr(SemiHertzian, "__init__", fail)
    for saving in kind():
        failures = {row.failed for row in saving.measured(1)}
        faulty = saving.method.startswith("semi-hertzian")
        assert failures == {"raised TypeError: no grid" if faulty else ""}, saving.method
