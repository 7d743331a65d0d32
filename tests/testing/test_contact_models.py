"""Every contact model that is installed keeps what a contact model promises, with every choice."""

from __future__ import annotations

from typing import Literal, get_args, get_origin

import pytest
from pydantic import ValidationError

from wearsim.plugins import ContactModelSpec, registry
from wearsim.testing import ContactCase, contact_model_tests

ELEMENT_SUM = "the textbook's element sum is of first order, and 3 % low by its own account"
WITHOUT = {
    ("hertz-fastsim", "dissipation", "element-sum"): {
        "power-is-the-work-of-the-rigid-slip": ELEMENT_SUM,
        "fields": ELEMENT_SUM,
    }
}
# spin turns about the load's centre, of which strips that the patch covers in part know roughly
CASES = {"hertz": ContactCase(tolerance=2e-5)}
# what no single choice covers
TOGETHER = [
    ("hertz-fastsim", {"closed_form": "never", "bound": "elliptic"}),
    ("hertz-fastsim", {"patch": {"a": "0.14 mm", "b": "1.5 mm"}}),
    ("hertz-fastsim", {"kalker_coefficients": {"c11": 4.0, "c22": 3.6, "c23": 1.4}}),
]
# without the models of other distributions that are installed
NAMES = [
    item.spec.name
    for item in registry().all()
    if isinstance(item.spec, ContactModelSpec) and item.distribution == "wearsim"
]


def choices(name):
    """Return every single choice that a model's options offer, as key and value."""
    fields = registry().get(ContactModelSpec, name).options.model_fields
    return [
        (key, value)
        for key, field in fields.items()
        if get_origin(field.annotation) is Literal
        for value in get_args(field.annotation)
        if value != field.default
    ]


def options_with(name, key, value):
    """Return options with a choice, and with another one where it makes sense only beside that."""
    model = registry().get(ContactModelSpec, name).options
    tried = [{}, *({other: chosen} for other, chosen in choices(name) if other != key)]
    for beside in tried:
        options = {key: value, **beside}
        try:
            model.model_validate(options)
        except ValidationError:
            continue
        return options
    raise AssertionError(f"{name} takes {key} = {value} beside no other choice")


TESTED = []


def put_to_the_test(item, name, options, without=None):
    made = contact_model_tests(name, options, CASES.get(name), without or {})
    test = f"test_{name}_{item}".replace("-", "_").replace(" ", "_")
    assert test not in globals(), f"two tests are called {test}"
    globals()[test] = made
    TESTED.append((name, options))


for name in NAMES:
    put_to_the_test("by_default", name, {})
    for key, value in choices(name):
        without = WITHOUT.get((name, key, value))
        put_to_the_test(f"with {key} {value}", name, options_with(name, key, value), without)
for number, (name, options) in enumerate(TOGETHER):
    put_to_the_test(f"together_{number}", name, options)


def offered(schema):
    """Return the values that a JSON schema of options lets one choose from, as key and value."""
    return {
        (key, value)
        for key, field in schema["properties"].items()
        for part in [field, *field.get("anyOf", [])]
        for value in part.get("enum", [])
    }


def untested(name, tested):
    """Return what a model offers and none of the tested options takes, by default or by choice."""
    model = registry().get(ContactModelSpec, name).options
    own = [model.model_validate(options) for other, options in tested if other == name]
    taken = {(key, getattr(item, key)) for item in own for key in model.model_fields
             if isinstance(getattr(item, key), str)}  # fmt: skip
    return offered(model.model_json_schema()) - taken


@pytest.mark.parametrize("name", NAMES)
def test_that_no_model_and_no_choice_is_left_out(name):
    assert (name, {}) in TESTED
    assert offered(registry().get(ContactModelSpec, name).options.model_json_schema())
    assert not untested(name, TESTED)


def test_that_a_choice_left_out_is_noticed():
    less = [(name, own) for name, own in TESTED if own.get("variant") != "ayasse-chollet"]
    assert untested("semi-hertzian", less) == {("variant", "ayasse-chollet")}
    assert untested("hertz-fastsim", less) == set()


def test_that_what_is_left_out_exists():
    for name, key, value in WITHOUT:
        assert (key, value) in choices(name)
