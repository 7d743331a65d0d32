"""Accuracy of every contact model against the exact theory, as documented in docs/models.md."""

from functools import cache

import pytest

from wearsim.errors import ContactError
from wearsim_bench.contact.accuracy import (
    choose_model,
    hard_case_errors,
    random_case_errors,
    worn_errors,
)
from wearsim_bench.exact_solutions import WORN

VARIANTS = ("kik-piotrowski", "ayasse-chollet", "analyn")
#: rms and worst error of the power, and the median L2 error of P_l(y)
DRAWN = {
    ("slender", "strip", "paper"): (4e-4, 1e-3, 3e-3),
    ("slender", "strip", "partial"): (2e-3, 6e-3, 5e-3),
    ("hertz", "strip", "paper"): (4e-4, 1e-3, 3e-3),
    ("hertz", "strip", "partial"): (2e-3, 6e-3, 5e-3),
    ("hertz", "fastrip", "paper"): (2e-3, 3e-3, 2.5e-2),
    ("hertz", "fastrip", "partial"): (5e-3, 1.1e-2, 2.5e-2),
}


@cache
def on_profile(name, profile, **options):
    return worn_errors(choose_model(name, **options), profile)


@pytest.mark.parametrize(("model", "tangential", "kind"), DRAWN)
def test_power_of_random_contacts_matches_exact_theory(model, tangential, kind):
    found = random_case_errors(choose_model(model, tangential=tangential), kind)
    rms, worst, strips = DRAWN[model, tangential, kind]
    assert found.rms < rms
    assert found.worst < worst
    assert found.strips < strips


@pytest.mark.parametrize(("tangential", "rms"), [("strip", 5e-3), ("fastrip", 5e-3)])
def test_power_of_long_hard_cases_matches_exact_theory(tangential, rms):
    assert hard_case_errors(choose_model("hertz", tangential=tangential), 3.0).rms < rms


@pytest.mark.parametrize("profile", WORN)
def test_slender_line_load_matches_exact_theory(profile):
    found = on_profile("slender", profile)
    # the exact pressure is unbounded at the kink of the shallow parabola
    assert found.line_load < (6e-3 if profile == "parabola" else 1e-3)
    assert abs(found.approach) < 1e-4
    assert found.half_length < 5e-3
    assert max(abs(error) for error in found.power.values()) < 5e-3
    assert max(found.dissipation.values()) < 2.5e-2


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("profile", [name for name in WORN if name != "hertz"])
def test_slender_is_more_accurate_than_semi_hertzian(profile, variant):
    slender, other = (
        on_profile("slender", profile),
        on_profile("semi-hertzian", profile, variant=variant),
    )
    assert slender.line_load < 0.1 * other.line_load
    assert slender.half_length < 0.5 * other.half_length
    assert abs(slender.approach) < abs(other.approach)
    for case, error in slender.dissipation.items():
        assert error < 0.5 * other.dissipation[case]


@pytest.mark.parametrize("variant", ["ayasse-chollet", "analyn"])
def test_variants_with_hertzian_stiffness_recover_hertz(variant):
    found = on_profile("semi-hertzian", "hertz", variant=variant)
    assert found.line_load < 1e-3
    assert abs(found.approach) < 1e-3


@pytest.mark.parametrize("name", ["hertz", "hertz-fastsim"])
def test_hertz_models_refuse_a_non_parabolic_gap(name):
    with pytest.raises(ContactError, match="Hertz"):
        on_profile(name, "bump_10um")
