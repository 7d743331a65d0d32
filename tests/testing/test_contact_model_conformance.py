"""Conformance tests of all contact models of the core, with every choice of their options."""

from __future__ import annotations

from typing import Literal, get_args, get_origin

import pytest
from pydantic import ValidationError

from wearsim.plugins import ContactModelSpec, registry
from wearsim.testing import ContactCase, contact_model_tests

ELEMENT_SUM = "the element sum is first-order accurate, with an error of 3 %"
WITHOUT = {
    ("hertz-fastsim", "dissipation", "element-sum"): {
        "power-equals-rigid-slip-work": ELEMENT_SUM,
        "fields": ELEMENT_SUM,
    }
}
# the centre of load is inexact for strips that the patch covers in part
CASES = {"hertz": ContactCase(tolerance=2e-5)}
# combinations not covered by single choices
COMBINATIONS = [
    ("hertz-fastsim", {"closed_form": "never", "bound": "elliptic"}),
    ("hertz-fastsim", {"patch": {"a": "0.14 mm", "b": "1.5 mm"}}),
    ("hertz-fastsim", {"kalker_coefficients": {"c11": 4.0, "c22": 3.6, "c23": 1.4}}),
]
# models of the core only
NAMES = [
    item.spec.name
    for item in registry().all()
    if isinstance(item.spec, ContactModelSpec) and item.distribution == "wearsim"
]


def choices(name):
    """Return all non-default choices of a model's options, as key and value."""
    fields = registry().get(ContactModelSpec, name).options.model_fields
    return [
        (key, value)
        for key, field in fields.items()
        if get_origin(field.annotation) is Literal
        for value in get_args(field.annotation)
        if value != field.default
    ]


def options_with(name, key, value):
    """Return options with a choice, and with a second choice if the first requires it."""
    model = registry().get(ContactModelSpec, name).options
    candidates = [{}, *({other: chosen} for other, chosen in choices(name) if other != key)]
    for other_choice in candidates:
        options = {key: value, **other_choice}
        try:
            model.model_validate(options)
        except ValidationError:
            continue
        return options
    raise AssertionError(f"{name} takes {key} = {value} with no other choice")


TESTED = []


def add_tests(item, name, options, without=None):
    test_function = contact_model_tests(name, options, CASES.get(name), without or {})
    test = f"test_{name}_{item}".replace("-", "_").replace(" ", "_")
    assert test not in globals(), f"two tests are called {test}"
    globals()[test] = test_function
    TESTED.append((name, options))


for name in NAMES:
    add_tests("by_default", name, {})
    for key, value in choices(name):
        without = WITHOUT.get((name, key, value))
        add_tests(f"with {key} {value}", name, options_with(name, key, value), without)
for number, (name, options) in enumerate(COMBINATIONS):
    add_tests(f"together_{number}", name, options)


def choices_in_schema(schema):
    """Return the choices in the JSON schema of options, as key and value."""
    return {
        (key, value)
        for key, field in schema["properties"].items()
        for part in [field, *field.get("anyOf", [])]
        for value in part.get("enum", [])
    }


def untested(name, tested):
    """Return the choices of a model that no tested options contain."""
    model = registry().get(ContactModelSpec, name).options
    instances = [model.model_validate(options) for other, options in tested if other == name]
    used = {(key, getattr(item, key)) for item in instances for key in model.model_fields
             if isinstance(getattr(item, key), str)}  # fmt: skip
    return choices_in_schema(model.model_json_schema()) - used


@pytest.mark.parametrize("name", NAMES)
def test_all_models_and_choices_are_tested(name):
    assert (name, {}) in TESTED
    assert choices_in_schema(registry().get(ContactModelSpec, name).options.model_json_schema())
    assert not untested(name, TESTED)


def test_missing_choice_is_detected():
    fewer = [(name, own) for name, own in TESTED if own.get("variant") != "ayasse-chollet"]
    assert untested("semi-hertzian", fewer) == {("variant", "ayasse-chollet")}
    assert untested("hertz-fastsim", fewer) == set()


def test_skipped_choices_exist():
    for name, key, value in WITHOUT:
        assert (key, value) in choices(name)
