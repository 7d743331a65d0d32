"""Friction fields in Monte Carlo studies of one contact."""

from __future__ import annotations

import re

import numpy as np
import pytest
from dissipation_examples import contact, field, positive

from wearsim.errors import CapabilityError, ScenarioError
from wearsim.studies.contact.batch import Realisations
from wearsim.studies.contact.single import solve_contact
from wearsim.studies.dissipation.monte_carlo import dissipation
from wearsim.studies.opening import open_dissipation


@pytest.mark.parametrize("frame", ["contact", "cylinder"])
@pytest.mark.parametrize("kind", ["white", "gaussian-field"])
def test_friction_field_is_independent_of_batches(frame, kind):
    options = {} if kind == "white" else {"correlation_length": "200 um"}
    scenario = contact(
        friction__coefficient=field(kind, frame=frame, **options), contact__my=50, contact__mx=20
    )
    contacts = Realisations(scenario, 6)
    whole = contacts.solve(0, 6).power
    single = [contacts.solve(k, 1).power.item() for k in (5, 2, 0)]
    assert single == [whole[5], whole[2], whole[0]]
    assert len(set(whole.tolist())) == 6


def test_friction_field_requires_supporting_model():
    scenario = contact(friction__coefficient=field("white"), contact={"model": "slender"})
    with pytest.raises(CapabilityError, match=r"contact\.model = 'hertz-fastsim'"):
        dissipation(scenario, 2)


def test_friction_field_requires_prescribed_creepage():
    creepage = {"drive": "free", "bearing_torque": "0.3 N*m"}
    scenario = contact(friction__coefficient=field("white"), creepage=creepage)
    with pytest.raises(CapabilityError, match=r"creepage\.drive = 'creepage'"):
        dissipation(scenario, 2)


def test_unresolved_friction_field_is_refused():
    fine = field("gaussian-field", correlation_length="20 um")
    with pytest.raises(ScenarioError) as caught:
        dissipation(contact(friction__coefficient=fine), 2)
    message = str(caught.value)
    assert (
        "[friction] coefficient: the grid does not resolve a correlation length of 20 um" in message
    )
    assert re.search(r"expected contact\.mx = \d+ and contact\.my = \d+", message)


@pytest.mark.parametrize("points", [5, 10])
def test_two_points_per_correlation_length_are_required(points):
    coarse = {"load__normal_force": "300 N", "contact__mx": points, "contact__my": 201}
    longest = solve_contact(contact(**coarse)).half_length.max()
    limit = 2.0 * (2.0 * longest / points)

    def start(length):
        fine = field("gaussian-field", correlation_length=f"{length * 1e6} um")
        return Realisations(contact(friction__coefficient=fine, **coarse), 1)

    assert start(1.0001 * limit).friction_points == points
    with pytest.raises(ScenarioError, match="um along rolling"):
        start(0.9999 * limit)


def test_white_friction_states_its_grid_in_a_note(tmp_path):
    scenario = contact(friction__coefficient=field("white"))
    dissipation(scenario, 3, tmp_path / "a.h5")
    result = open_dissipation(tmp_path / "a.h5")
    strips = len(result.y)
    width = result.raw.strip_width * 1e6
    assert result.raw.friction_grid == f"16 points along each of {strips} strips of {width:.4g} um"
    assert any("white friction has no continuum limit" in text for text in result.notes)


def test_field_of_tiny_spread_is_uniform_friction():
    changes = {"contact__my": 50, "contact__mx": 50}
    wide = field("gaussian-field", 1e-9, correlation_length="150 um")
    near = dissipation(contact(friction__coefficient=wide, **changes), 20).power
    marched = dissipation(contact(contact__closed_form="never", **changes), 20).power
    np.testing.assert_allclose(near, marched, rtol=1e-6)


def test_white_friction_lowers_power_on_finer_grids():
    # 300 N, uniform in the strip: 0.0739 W; the paper's noise on 25 and 50 cells: 0.0689, 0.0653 W
    base = {"load__normal_force": positive("300 N", "1e-6 N"), "contact__kalker": "line-limit"}
    white = field("white", 0.02)
    for cells, expected in ((25, 0.0689), (50, 0.0653)):
        scenario = contact(friction__coefficient=white, contact__my=50, contact__mx=cells, **base)
        assert dissipation(scenario, 12).power.mean() == pytest.approx(expected, rel=0.02)


def test_field_fixed_to_a_body_keeps_its_marginal_mean():
    # in full slip the power is linear in the friction of each particle
    base = {"creepage__longitudinal": 2e-2, "load__normal_force": positive("300 N", "1e-6 N")}
    carried = field("gaussian-field", 0.01, frame="cylinder", correlation_length="150 um")
    scenario = contact(friction__coefficient=carried, contact__my=50, **base)
    power = dissipation(scenario, 60).summaries["power"]
    uniform = dissipation(contact(contact__my=50, **base), 1).power[0]
    assert 0.0 < power.std < 0.1 * uniform
    assert power.mean == pytest.approx(uniform, abs=4 * power.mean_error)
