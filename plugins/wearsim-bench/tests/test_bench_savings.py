"""Savings: what is left out where a problem has no need of it, and that nothing else changes."""

import json

import numpy as np
import pytest

from wearsim.models.contact.semi_hertzian import SemiHertzian
from wearsim.plugins import ContactModelSpec, registry
from wearsim_bench.contact.methods import Method
from wearsim_bench.measure.measurement import Effort
from wearsim_bench.savings.contacts import (
    Rig,
    closed_forms,
    fields,
    strips_outside,
    uniform_friction,
)
from wearsim_bench.savings.pairs import Pair, Ways
from wearsim_bench.savings.runs import APART, RIG, STEPPERS
from wearsim_bench.savings.topic import savings
from wearsim_bench.stepping.runs import Ready, WearTest

pytestmark = pytest.mark.bench

QUICK = Effort(quick=True, repetitions=1)
MARCHES = (
    "hertz, fastsim",
    "hertz, fastsim, bound parabolic",
    "hertz, fastsim, flexibility one",
    "hertz-fastsim",
)


@pytest.fixture(scope="module")
def topic():
    return savings(QUICK, lambda what, part: None)


def rows(topic, group):
    found = {}
    for item in topic.of(group):
        found.setdefault(item.method, []).append(item)
    return found


def test_that_every_saving_is_timed_beside_the_way_without_it(topic):
    assert len(topic.groups) == 8
    for item in topic.measurements:
        assert item.failed == ""
        assert item.seconds > 0.0
    for group in topic.groups:
        for ways in rows(topic, group).values():
            assert [item.default for item in ways] == [True, *(False for _ in ways[1:])]
            assert ways[0].counts["times"] == ways[-1].seconds / ways[0].seconds
    json.dumps(topic.as_json())


def test_that_a_closed_form_is_nearer_to_the_limit_of_a_march_than_the_march(topic):
    found = rows(topic, "no spin")
    for method in MARCHES:
        closed, marched = found[method]
        assert closed.errors["result"] < 0.1 * marched.errors["result"] < 1e-3


@pytest.mark.parametrize(
    ("group", "most"),
    [
        ("alike rollers", 1e-7),  # what APART moves
        ("records", 0.0),
        ("idle inputs", 0.0),
        ("fields", 0.0),
        ("strips outside", 1e-4),  # of as many strips in the contact
        ("uniform friction", 1e-3),  # of a march
    ],
)
def test_that_nothing_else_changes(topic, group, most):
    assert all(item.errors["result"] <= most for item in topic.of(group))


def test_that_the_rows_name_every_model():
    named = {pair.method.split(",")[0] for pair in strips_outside()}
    assert named == set(registry().names(ContactModelSpec))
    assert {"hertz, strip", "hertz, fastrip", *MARCHES} == {pair.method for pair in closed_forms()}


@pytest.mark.parametrize(
    ("stepper", "model"),
    [
        (stepper, model)
        for stepper in STEPPERS
        for model in registry().names(ContactModelSpec)
        if stepper != "implicit" or Method(model).spec.capabilities.coupled
    ],
)
def test_that_alike_rollers_are_one_contact(stepper, model):
    changes = {"evolution.stepper": stepper, "contact": {"model": model}}
    test = WearTest(RIG, 0.2)
    merged = Ready(test.asked(changes)).problem
    apart = Ready(test.asked({**changes, "roller.offset": APART})).problem
    assert (merged.shape[1], apart.shape[1]) == (1, 3)
    assert merged.kinematics.physical_rollers == apart.kinematics.physical_rollers == 3.0


def test_that_strips_lie_outside_where_it_is_said():
    alone, wide = (Rig(Method("slender"), wide=times) for times in (1, 3))
    touching = [
        np.count_nonzero(rig.model.solve(rig.gap, rig.curvature, rig.point).line_load)
        for rig in (alone, wide)
    ]
    assert touching[0] == touching[1] > 0.8 * alone.grid.strips
    assert wide.grid.strips == 3 * alone.grid.strips


def test_that_a_way_that_fails_is_told():
    def lost():
        raise RuntimeError("no way")

    ways = Ways({"short": lambda: np.ones(3), "long": lost})
    (row,) = Pair("problems", "method", lambda: ways).measured(1)
    assert row.failed == "raised RuntimeError: no way"
    assert row.setting == "short"


@pytest.mark.parametrize("kind", [strips_outside, fields, uniform_friction])
def test_that_a_model_that_cannot_be_prepared_stops_no_other(kind, monkeypatch):
    def mistaken(self, grid, materials):
        raise TypeError("no grid")

    monkeypatch.setattr(SemiHertzian, "prepare", mistaken)
    for pair in kind():
        told = {row.failed for row in pair.measured(1)}
        wrong = pair.method.startswith("semi-hertzian")
        assert told == {"raised TypeError: no grid" if wrong else ""}, pair.method
