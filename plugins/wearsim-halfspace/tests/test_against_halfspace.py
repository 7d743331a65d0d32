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


def test_exact_theory_is_chosen_where_no_cheaper_model_suffices():
    round_contact = {"contact.model": "auto", "roller.crown_radius": "0.2 mm"}
    study = wearsim.study_contact(shipped_scenario("rig-450min", round_contact))
    assert study.model == "halfspace"
    assert any("'auto' has taken 'halfspace" in note for note in study.notes)


def test_estimate_holds_during_a_run():
    short = {"contact.model": "auto", "operation.passes": 3000, "evolution.tolerance": 0.01}
    result = wearsim.run(shipped_scenario("rig-450min", short))
    assert result.described_model.endswith("(auto)")
    assert not any("'auto'" in warning for warning in result.warnings)
