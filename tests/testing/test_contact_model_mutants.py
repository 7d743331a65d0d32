"""Every check of a contact model fails for a mutant and reports the violation."""

from __future__ import annotations

import pytest
from mutants import MUTANTS, Unmodified, spec_of

from wearsim.plugins import Capabilities, Options
from wearsim.testing import ConformanceError
from wearsim.testing.checks import ConfiguredSpec
from wearsim.testing.contact_fixtures import ContactFixture
from wearsim.testing.kit import CONTACT_MODEL

PAIRS = [(name, model) for name, models in MUTANTS.items() for model in models]


def fixture(model=Unmodified, **changes):
    return ContactFixture(ConfiguredSpec(spec_of(model, **changes)))


def test_base_class_of_the_mutants_conforms():
    base = fixture()
    for check in CONTACT_MODEL.values():
        check(base)


@pytest.mark.parametrize(("name", "model"), PAIRS, ids=[f"{n}-{m.__name__}" for n, m in PAIRS])
def test_violations_are_reported(name, model):
    check = CONTACT_MODEL[name]
    with pytest.raises(ConformanceError) as violation:
        check(fixture(model))
    assert str(violation.value).startswith("contact model 'mutant': ")
    assert str(violation.value).endswith(
        f"Violated requirement: {check.requirement} ({check.specified_in})"
    )


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("spec-is-complete", {"name": "My Model"}),
        ("spec-is-complete", {"summary": " "}),
        ("spec-is-complete", {"references": "a paper"}),
        ("spec-is-complete", {"protocol": 1}),
        ("options-reject-unknown-keys", {"options": type("Loose", (Options,), {
            "model_config": {"extra": "ignore"}, "__module__": __name__})}),
        ("spec-and-model-capabilities-agree", {"capabilities": Capabilities()}),
        ("spec-and-model-capabilities-agree", {"capabilities": Capabilities(friction_field=True,
            **dict.fromkeys(Unmodified.capabilities.names(), True))}),
    ],
)  # fmt: skip
def test_invalid_specs_are_reported(name, changes):
    with pytest.raises(ConformanceError):
        CONTACT_MODEL[name](fixture(**changes))


def test_every_check_has_a_failing_model():
    of_specs = {
        "spec-is-complete",
        "options-reject-unknown-keys",
        "spec-and-model-capabilities-agree",
    }
    assert set(MUTANTS) | of_specs == set(CONTACT_MODEL)


def test_message_holds_the_numbers():
    with pytest.raises(ConformanceError, match=r"is 303, expected 300: off by 1\.00e-02 of 300"):
        CONTACT_MODEL["strips-carry-the-load"](fixture(MUTANTS["strips-carry-the-load"][0]))


def test_ignored_request_is_reported():
    with pytest.raises(
        ConformanceError, match=r"wear_compliance is not claimed, .* silently ignored"
    ):
        CONTACT_MODEL["wear-compliance"](fixture(MUTANTS["wear-compliance"][0]))
