"""Errors of other contact models relative to half-spaces."""

import numpy as np
import pytest

import wearsim
from wearsim.errors import Interrupted
from wearsim.scenario import parse_scenario
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.automatic import with_chosen_model
from wearsim.studies.plausibility import plausibility_warnings
from wearsim.studies.run.setup import Setup

AUTO = {"contact.model": "auto"}
ROUND = {"roller.crown_radius": "0.2 mm"}  # b/a of 0.05


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


def test_stated_error_of_the_reference_covers_its_change_on_finer_elements():
    partial = {"creepage.longitudinal": 4e-4, "creepage.tilt": "3 deg", "contact.strips": 41}
    scenario = shipped_scenario("rig-450min", partial)
    reference = wearsim.study_contact(scenario, against="halfspace").reference
    fine = {"contact.model": "halfspace", "contact.mx": 300}
    exact = wearsim.solve_contact(scenario.changed(fine)).dissipation
    error = np.linalg.norm(reference.dissipation - exact) / np.linalg.norm(exact)
    assert 0.2 * reference.own.dissipation < error < reference.own.dissipation < 2e-3


def test_exact_theory_is_chosen_where_no_cheaper_model_suffices():
    study = wearsim.study_contact(shipped_scenario("rig-450min", AUTO | ROUND))
    assert study.model == "halfspace"
    assert any("'auto' has taken 'halfspace" in note for note in study.notes)
    assert not any("contact model" in warning for warning in study.warnings)


def test_elements_become_finer_with_the_tolerance():
    taken = []
    for tolerance in (0.1, 0.02, 0.005):
        small = {"contact.tolerance": tolerance, "creepage.longitudinal": 6e-4}
        scenario = shipped_scenario("rig-450min", AUTO | ROUND | small)
        taken.append(with_chosen_model(scenario, test=False).contact)
    assert [choice.model for choice in taken] == ["halfspace"] * 3
    numbers = [choice.options.mx for choice in taken]
    assert numbers == sorted(numbers)
    assert numbers[0] < numbers[-1]


@pytest.mark.parametrize(
    ("changes", "own"),
    [
        ({"contact.tolerance": 1e-5}, "is estimated as 0"),
        ({"creepage.differential_slip": True}, "cannot be estimated"),
    ],
)
def test_exact_theory_above_the_tolerance_warns(changes, own):
    scenario = shipped_scenario("rig-450min", AUTO | changes)
    once = with_chosen_model(scenario, test=False)
    assert once.contact.options.mx == 200
    assert "exact theory on its finest elements" in once.notes[-1]
    (warning,) = plausibility_warnings(Setup(once))
    assert warning.startswith(f"contact model: the error of P_l(y) by 'halfspace, mx 200' {own}")
    again = parse_scenario(once.text, once.file, once.files.__getitem__)
    assert plausibility_warnings(Setup(again)) == [warning]


def test_estimate_holds_during_a_run():
    short = {"contact.model": "auto", "operation.passes": 3000, "evolution.tolerance": 0.01}
    result = wearsim.run(shipped_scenario("rig-450min", short))
    assert result.described_model.endswith("(auto)")
    assert not any("'auto'" in warning for warning in result.warnings)


def test_resumed_run_keeps_exact_theory_and_its_warning(tmp_path):
    short = {"operation.passes": 300, "evolution.tolerance": 0.002, "contact.strips": 11}
    scenario = shipped_scenario("rig-450min", AUTO | short | {"contact.tolerance": 1e-5})
    whole = wearsim.run(scenario, tmp_path / "whole.h5")
    steps = []
    with pytest.raises(Interrupted):
        wearsim.run(
            *(scenario, tmp_path / "part.h5"),
            stop_requested=lambda: len(steps) > 0 or steps.append(0),
        )
    resumed = wearsim.resume(tmp_path / "part.h5")
    np.testing.assert_array_equal(resumed.profiles, whole.profiles)
    assert resumed.described_model == "halfspace (mx = 200, auto)"
    warned = [text for text in resumed.warnings if "contact model" in text]
    assert warned == [text for text in whole.warnings if "contact model" in text]
    assert len(warned) == 1
