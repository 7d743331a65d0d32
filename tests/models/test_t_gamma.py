"""Wear law by T gamma over A: regimes, and wear tests that pass through them."""

import numpy as np
import pytest
from pydantic import ValidationError

from tests.evolution import built, stepped, worn
from wearsim.evolution.steppers.per_pass import PerPassStepper
from wearsim.models.wear import Regimes, TGamma, TGammaOptions
from wearsim.types import ContactSolution

SPEED = 2.0
MILD = 5.3e-9 / 7850.0  # m^3/J


def contact(index, half_length=1e-4):
    """Return a contact with the dissipation `index` [Pa] per area and rolled distance."""
    index = np.asarray(index, dtype=float)
    strips = np.full_like(index, half_length)
    numbers = dict.fromkeys(
        ("force_x", "force_y", "spin_moment", "approach", "peak_pressure", "adhesion_fraction"), 0.0
    )
    return ContactSolution(
        y=np.arange(len(index), dtype=float),
        half_length=strips,
        line_load=strips,
        dissipation=index * 2.0 * strips * SPEED,
        power=0.0,
        longitudinal_creepage=0.0,
        iterations=0,
        **numbers,
    )


def depths(index, **options):
    law = TGamma(TGammaOptions(**options))
    return law.depth_per_pass("cylinder", contact(index), SPEED)


def test_published_rates_are_reproduced():
    # ug per m rolled and mm^2 of contact, at T gamma over A in N/mm^2
    index = np.array([0.0, 5.0, 10.3, 20.0, 77.0, 87.2])
    rate = np.array([0.0, 5.3 * 5.0, 5.3 * 10.3, 55.0, 55.0, 55.0 + 61.9 * 10.0])
    per_area = depths(index * 1e6) * 7850.0 / 2e-4  # kg/m^3, which is 1e-3 ug/(m mm^2)
    np.testing.assert_allclose(per_area * 1e3, rate, rtol=1e-12)


def test_rate_is_continuous_between_regimes():
    regimes = Regimes()
    for threshold in (regimes.severe / regimes.mild, regimes.catastrophic_from):
        below, above = regimes.rate(threshold * np.array([1.0 - 1e-9, 1.0 + 1e-9]))
        assert above == pytest.approx(below, rel=1e-6)
    assert regimes.severe / regimes.mild == pytest.approx(10.4e6, rel=5e-3)  # as published


def test_wear_is_zero_outside_contact_or_with_factor_zero():
    law = TGamma(TGammaOptions(roller={"factor": 0.0}))
    outside = contact([1e6, 1e6], half_length=0.0)
    assert law.depth_per_pass("cylinder", outside, SPEED).tolist() == [0.0, 0.0]
    assert law.depth_per_pass("roller", contact([1e6, 9e7]), SPEED).tolist() == [0.0, 0.0]


def test_rates_are_read_with_their_units():
    read = Regimes(mild="5.3 ug/J", severe="55 ug/(m mm^2)", catastrophic_from="77.2 N/mm^2")
    assert read.model_dump() == pytest.approx(Regimes().model_dump())
    with pytest.raises(ValidationError, match="wrong dimension"):
        Regimes(mild="5.3 ug")


def test_regimes_out_of_order_are_refused():
    with pytest.raises(ValidationError, match=r"before severe wear .* at least .* 10\.38"):
        Regimes(catastrophic_from="5 N/mm^2")
    with pytest.raises(ValidationError, match=r"such as \"55 ug/\(m mm\^2\)\""):
        Regimes(severe="55 um")


def test_mild_wear_is_archard_wear():
    law = {"wear": {"law": "t-gamma", "roller": {"factor": 0.5}}}
    problem, state = worn(operation__duration="30 min", **law)
    energy = {"k_over_h": f"{MILD!r} 1/Pa"}, {"k_over_h": f"{0.5 * MILD!r} 1/Pa"}
    linear = {"law": "archard-dissipation", "cylinder": energy[0], "roller": energy[1]}
    _, archard = worn(operation__duration="30 min", wear=linear)
    np.testing.assert_allclose(state.cylinder_depth, archard.cylinder_depth, rtol=1e-6, atol=1e-15)
    assert (problem.sum_of_parts(*problem.wear_parts(state.contacts, 1.0))[1] > 0.0).any()


@pytest.mark.parametrize(
    ("creepage", "regime", "passes"),
    [(0.06, "severe", 600), (0.2, "severe", 600), (0.4, "catastrophic", 3000)],
)
def test_implicit_steps_agree_with_per_pass_steps(creepage, regime, passes):
    """Severe wear in the middle of the patch, mild wear at its ends."""
    changes = {
        "wear": {"law": "t-gamma", "roller": {"factor": 0.0}},
        "creepage__longitudinal": creepage,
        "friction__coefficient": 0.5,
        "operation__passes": passes,
    }
    problem, stepper, stop = built(**changes)
    start = stepped(problem, stepper, 1.0)[0]
    index = start.contacts[0].dissipation.max() / (2.0 * start.contacts[0].half_length.max())
    assert (index / problem.kinematics.rolling_speed > 77.2e6) == (regime == "catastrophic")
    implicit, _ = stepped(problem, stepper, stop)
    reference, _ = stepped(problem, PerPassStepper(), stop)
    greatest = reference.cylinder_depth.max()
    difference = np.abs(implicit.cylinder_depth - reference.cylinder_depth).max()
    assert difference < 5e-3 * greatest
    error = abs(implicit.cylinder_depth.max() - greatest)
    assert error < min(implicit.depth_error[0], 2e-3 * greatest)
    assert implicit.depth_error[0] < 1e-2 * greatest
    assert implicit.solves < 0.7 * reference.solves
