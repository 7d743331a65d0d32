"""Every check of a contact model finds a model that breaks its promise, and says so."""

from __future__ import annotations

import pytest
from mutants import MUTANTS, Sound, spec_of

from wearsim.plugins import Capabilities, Options
from wearsim.testing import PromiseBroken
from wearsim.testing.contact_bench import ContactBench
from wearsim.testing.kit import CONTACT_MODEL
from wearsim.testing.specs import Chosen

PAIRS = [(name, model) for name, models in MUTANTS.items() for model in models]


def bench(model=Sound, **changes):
    return ContactBench(Chosen(spec_of(model, **changes)))


def test_that_the_model_that_mutants_are_made_of_keeps_every_promise():
    own = bench()
    for check in CONTACT_MODEL:
        check(own)


@pytest.mark.parametrize(("name", "model"), PAIRS, ids=[f"{n}-{m.__name__}" for n, m in PAIRS])
def test_that_a_broken_promise_is_told(name, model):
    check = CONTACT_MODEL[name]
    with pytest.raises(PromiseBroken) as told:
        check(bench(model))
    assert str(told.value).startswith("contact model 'mutant': ")
    assert str(told.value).endswith(f"It breaks a promise: {check.promise} ({check.promised_in})")


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("spec-says-what-it-is", {"name": "My Model"}),
        ("spec-says-what-it-is", {"summary": " "}),
        ("spec-says-what-it-is", {"references": "a paper"}),
        ("options-refuse-what-they-do-not-know", {"options": type("Loose", (Options,), {
            "model_config": {"extra": "ignore"}, "__module__": __name__})}),
        ("spec-claims-what-its-models-claim", {"capabilities": Capabilities()}),
        ("spec-claims-what-its-models-claim", {"capabilities": Capabilities(friction_field=True,
            **dict.fromkeys(Sound.capabilities.names(), True))}),
    ],
)  # fmt: skip
def test_that_a_broken_spec_is_told(name, changes):
    with pytest.raises(PromiseBroken):
        CONTACT_MODEL[name](bench(**changes))


def test_that_every_check_has_a_model_that_fails_it():
    of_specs = {
        "spec-says-what-it-is",
        "options-refuse-what-they-do-not-know",
        "spec-claims-what-its-models-claim",
    }
    assert set(MUTANTS) | of_specs == set(CONTACT_MODEL.names)


def test_that_numbers_are_told():
    with pytest.raises(PromiseBroken, match=r"is 303, expected 300: off by 1\.00e-02 of 300"):
        CONTACT_MODEL["strips-carry-the-load"](bench(MUTANTS["strips-carry-the-load"][0]))


def test_that_a_silently_ignored_request_is_told():
    with pytest.raises(PromiseBroken, match=r"wear_compliance is not claimed, .* silently ignored"):
        CONTACT_MODEL["wear-compliance"](bench(MUTANTS["wear-compliance"][0]))
