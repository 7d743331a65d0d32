"""Options that select a tangential theory, and refused options."""

import pytest
from pydantic import ValidationError

from wearsim.errors import ScenarioError
from wearsim.models.contact.strip_model import TangentialOptions, tangential_theory
from wearsim.models.tangential.fastsim import FastripTheory, FastsimTheory
from wearsim.models.tangential.strip_theory import StripTheory
from wearsim.scenario import parse_scenario

RIG = """
schema = 1
[rig]
rollers = 3
[cylinder]
radius = "25 mm"
material = "steel"
[roller]
radius = "20 mm"
crown_radius = "500 mm"
material = "steel"
"""


def test_strip_theory_is_the_default():
    assert isinstance(tangential_theory(TangentialOptions()), StripTheory)


def test_each_name_builds_its_theory_with_its_options():
    fastrip = tangential_theory(TangentialOptions(tangential="fastrip", mx=30))
    assert isinstance(fastrip, FastripTheory)
    assert fastrip.mx == 30
    options = TangentialOptions(tangential="fastsim", mx=20, bound="parabolic", flexibility="one")
    fastsim = tangential_theory(options)
    assert isinstance(fastsim, FastsimTheory)
    assert (fastsim.mx, fastsim.elliptic, fastsim.single) == (20, False, True)
    plain = tangential_theory(TangentialOptions(tangential="fastsim"))
    assert (plain.mx, plain.elliptic, plain.single) == (50, True, False)


@pytest.mark.parametrize(
    ("tangential", "key", "value"),
    [
        ("strip", "mx", 50),
        ("strip", "bound", "elliptic"),
        ("strip", "flexibility", "three"),
        ("fastrip", "bound", "elliptic"),
        ("fastrip", "flexibility", "one"),
    ],
)
def test_unused_option_is_refused(tangential, key, value):
    with pytest.raises(ValidationError) as caught:
        TangentialOptions(tangential=tangential, **{key: value})
    (error,) = caught.value.errors()
    assert error["loc"] == (key,)
    assert f'is not used with tangential = "{tangential}"' in error["msg"]
    assert 'tangential = "fastsim"' in error["msg"]
    if tangential == "strip":  # the default
        with pytest.raises(ValidationError, match="is not used"):
            TangentialOptions(**{key: value})


def test_unknown_theory_is_the_only_mistake_reported():
    with pytest.raises(ValidationError) as caught:
        TangentialOptions(tangential="fastsin", bound="elliptic")
    assert [error["loc"] for error in caught.value.errors()] == [("tangential",)]
    for bad in ({"mx": 1}, {"bound": "flat"}, {"flexibility": "two"}):
        with pytest.raises(ValidationError):
            TangentialOptions(tangential="fastsim", **bad)


@pytest.mark.parametrize("model", ["slender", "hertz"])
def test_scenario_error_names_key_and_remedy_once(model):
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(
            RIG + f'[contact]\nmodel = "{model}"\ntangential = "fastrip"\nbound = "parabolic"\n',
            "rig.toml",
            {}.__getitem__,
            {},
        )
    mistakes = [p for p in caught.value.mistakes if p.key == "bound"]
    assert len(mistakes) == 1
    assert mistakes[0].table == "contact"
    assert 'tangential = "fastsim"' in mistakes[0].expected


def test_every_option_is_described():
    for field in TangentialOptions.model_fields.values():
        assert field.description
