"""Messages of contacts without solution name what the scenario sets and what to change."""

from __future__ import annotations

from pathlib import Path

import pytest
from study_examples import short

import wearsim
from wearsim.errors import CapabilityError, ContactError, ScenarioError
from wearsim.studies.automatic import with_chosen_model
from wearsim.studies.dry_run import dry_run


def free(torque: str, **overrides: object) -> wearsim.Scenario:
    """Return the rig with a free roller."""
    text = short().text.replace(
        "longitudinal = 1e-3", f'drive = "free"\nbearing_torque = "{torque}"'
    )
    dotted = {key.replace("__", "."): value for key, value in overrides.items()}
    return wearsim.Scenario.from_toml(text, dotted)


def automatic(**overrides: object) -> wearsim.Scenario:
    """Return the rig with strips that are chosen automatically."""
    text = short().text.replace('strips = 41\nwidth = "5 mm"', "")
    dotted = {key.replace("__", "."): value for key, value in overrides.items()}
    return wearsim.Scenario.from_toml(text, dotted)


def test_groove_beyond_the_strips_names_the_width_that_is_set() -> None:
    with pytest.raises(ContactError) as failed:
        wearsim.run(short(contact__width="3.6 mm", operation__passes=60_000))
    text = str(failed.value)
    assert text.startswith("after pass ")
    assert "raise contact.width = 3.6 mm, or leave it out, and the strips follow the groove" in text


def test_too_many_strips_name_their_number_and_the_greatest() -> None:
    many = {"roller.crown_radius": "20 mm", "contact.strips": 1900, "contact.width": "0.9 mm"}
    with pytest.raises(ContactError, match=r"lower contact.strips = 1900 to at most \d+") as failed:
        wearsim.solve_contact(short(**many))
    most = int(str(failed.value).rsplit(" ", 1)[1])
    assert wearsim.solve_contact(short(**{**many, "contact.strips": most - 50})).power > 0.0


def most_strips(**overrides: object) -> int:
    """Return the greatest number of strips that the error of 200,000 strips suggests."""
    with pytest.raises(ScenarioError, match=r"\[contact\] strips: .*, got 200000") as refused:
        dry_run(automatic(contact__strips=200_000, **overrides))
    return int(str(refused.value).rsplit(" ", 1)[1])


def test_strips_that_lower_no_error_are_refused_before_any_contact() -> None:
    most = most_strips(contact__model="hertz")  # the cheapest
    assert most == most_strips()
    cheap = {"contact.model": "hertz", "contact.strips": most}
    assert dry_run(automatic(**cheap))["test"]["strips"] == most
    with pytest.raises(ScenarioError, match="more than 1200 strips per half-width"):
        dry_run(automatic(**cheap | {"contact.strips": most + most // 100}))


def test_ensemble_on_too_many_strips_is_refused_before_its_tests(tmp_path: Path) -> None:
    friction = {"distribution": "uniform", "low": 0.1, "high": 0.2}
    many = automatic(contact__strips=200_000, friction__coefficient=friction)
    with pytest.raises(ScenarioError, match="more than 1200 strips per half-width"):
        wearsim.ensemble(many, 3, tmp_path / "tests.h5", scheduler="serial")
    assert not (tmp_path / "tests.h5").exists()


def test_strips_whose_equations_exceed_the_memory_are_refused() -> None:
    most = most_strips(contact__width="500 mm")
    assert 3.99e9 < 8 * most**2 <= 4e9


def test_contact_longer_than_wide_is_named_instead_of_automatic_strips() -> None:
    slim = {"roller.crown_radius": "2 mm", "roller.radius": "200 mm", "cylinder.radius": "300 mm"}
    with pytest.raises(ContactError) as failed:
        wearsim.solve_contact(automatic(**slim))
    text = str(failed.value)
    assert "contact.strips" not in text
    assert "is longer than wide, and 'slender' assumes the opposite" in text


def test_skid_names_torque_friction_and_the_greatest_torque() -> None:
    with pytest.raises(ContactError) as failed:
        wearsim.run(free("700 N mm"))
    text = str(failed.value)
    assert "its torque of 700 N mm exceeds the 600 N mm that friction can transmit" in text
    assert "lower creepage.bearing_torque = 700 N mm to below 600 N mm" in text
    assert "friction.coefficient = 0.1" in text


def test_skid_during_a_run_names_the_pass_and_the_fallen_load() -> None:
    spring = {
        "load.kind": "spring",
        "load.stiffness": "60 N/um",
        "wear.cylinder.k_over_h": "1e-9 1/Pa",
    }
    with pytest.raises(ContactError) as failed:
        wearsim.run(free("500 N mm", **spring))
    text = str(failed.value)
    assert text.startswith("after pass ")
    assert "the load has fallen from 300 N" in text


def test_automatic_choice_says_that_the_exact_theory_takes_no_free_roller() -> None:
    slim = free("100 N mm", **{"roller.crown_radius": "10 mm", "contact.model": "auto"})
    with pytest.raises(CapabilityError) as failed:
        with_chosen_model(slim, test=False)
    text = str(failed.value)
    assert "'halfspace', is not possible" in text or "install 'halfspace'" in text
    assert "creepage.drive = 'free'" in text or "install" in text
    assert "varies across the track" not in text
