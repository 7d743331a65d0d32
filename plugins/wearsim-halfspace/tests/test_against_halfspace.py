"""Errors of other contact models relative to half-spaces."""

import wearsim
from wearsim.scenario.examples import shipped_scenario


def test_error_of_a_model_exceeds_that_of_the_reference():
    scenario = shipped_scenario(
        "rig-450min", {"contact.model": "hertz-fastsim", "contact.my": 24, "contact.mx": 24}
    )
    study = wearsim.study_contact(scenario, against="halfspace")
    assert 0.1 < study.errors.dissipation < 0.15
    assert study.reference.own.dissipation < 0.02
    slender = wearsim.study_contact(
        shipped_scenario("rig-450min", {"contact.strips": 33}), against="halfspace"
    )
    assert slender.errors.dissipation < 0.01
    assert abs(slender.errors.power) < 0.003
    assert abs(slender.errors.peak_pressure) < 0.003
