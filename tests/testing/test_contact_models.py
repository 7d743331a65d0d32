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


def put_to_the_test(item, name, options, without=None):
    made = contact_model_tests(name, options, CASES.get(name), without or {})
    globals()[f"test_{name}_{item}".replace("-", "_").replace(" ", "_")] = made


for name in registry().names(ContactModelSpec):
    put_to_the_test("by_default", name, {})
    for key, value in choices(name):
        without = WITHOUT.get((name, key, value))
        put_to_the_test(f"with {key} {value}", name, options_with(name, key, value), without)
for number, (name, options) in enumerate(TOGETHER):
    put_to_the_test(f"together_{number}", name, options)


@pytest.mark.parametrize("name", registry().names(ContactModelSpec))
def test_that_no_model_and_no_choice_is_left_out(name):
    own = [item for item in globals() if item.startswith(f"test_{name.replace('-', '_')}_")]
    assert len(own) >= 1 + len(choices(name))


def test_that_what_is_left_out_exists():
    for name, key, value in WITHOUT:
        assert (key, value) in choices(name)
