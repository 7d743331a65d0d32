"""Hard cases of cams: each runs with a conserved volume, or is refused with its name."""

from __future__ import annotations

import numpy as np
import pytest
from cam_text import cam, prescribed

import wearsim
from wearsim.errors import ScenarioError
from wearsim.studies.cam.turn import turn_of

SHORT = {"operation__turns": 300, "contact": {"strips": 41}}


def with_law(law: str, scenario):
    text = scenario.text.replace('"cycloidal",', f'"{law}",')
    return wearsim.Scenario.from_toml(text)


CASES = {
    "one station on a segment": prescribed(cam__stations=1, **SHORT),
    "500 stations": prescribed(cam__stations=250, **{**SHORT, "operation__turns": 2}),
    "jump of the acceleration": with_law("harmonic", prescribed(**SHORT)),
    "jump of the acceleration of a free roller": with_law("harmonic", cam(**SHORT)),
    "jump of the jerk": with_law("modified-trapezoid", prescribed(**SHORT)),
    "nearly a cusp": prescribed(cam__base_radius="5.152253 mm", **SHORT),
    "load close to zero": prescribed(load__preload="75.61 N", **SHORT),
    "load of zero": prescribed(load__preload="75.527312208 N", **SHORT),
    "load close to zero of a free roller": cam(load__preload="76 N", **SHORT),
    "feedback close to the harmonic limit": prescribed(
        load__feedback="inertia", load__preload="78 N", **SHORT
    ),
    "several rollers": prescribed(operation__rollers=3, **SHORT),
    "rollers that differ": prescribed(
        operation__rollers=2, creepage__yaw=["0 mrad", "1 mrad"], **SHORT
    ),
    "differential slip": prescribed(creepage__differential_slip=True, **SHORT),
    "stabilised steps": prescribed(evolution={"stepper": "stabilised"}, **SHORT),
    "a groove": cam("groove", **{**SHORT, "operation__turns": 2}),
}


@pytest.mark.parametrize("name", CASES)
def test_hard_case_is_finite_and_conserves_volume(name):
    scenario = CASES[name]
    result = wearsim.run(scenario)
    energy = 1.1e-11 * result.dissipated_energy[-1]
    assert result.finished
    assert result.depth[-1] > 0.0
    assert np.isfinite(result.values("station_depth")).all()
    assert result.worn_volume[-1] == pytest.approx(energy, rel=1e-12, abs=0.0)
    rollers = result.raw.history["roller_worn_volume"][-1, :, 0] @ result.raw.static["multiplicity"]
    assert rollers == pytest.approx(energy, rel=1e-12, abs=0.0)


def test_cusp_has_a_radius_of_zero():
    study = wearsim.study_cam(CASES["nearly a cusp"])
    assert 0.0 < study.min_radius_of_curvature < 1e-9


@pytest.mark.parametrize("radius", ["0.025 mm", "25 m"])
def test_extreme_ratios_of_the_radii_run(radius):
    scenario = cam("eccentric", roller__radius=radius, **SHORT)
    result = wearsim.run(scenario)
    energy = 1.1e-11 * result.dissipated_energy[-1]
    assert result.worn_volume[-1] == pytest.approx(energy, rel=1e-12, abs=0.0)
    ratio = turn_of(scenario).integral("travel") / (2.0 * np.pi * scenario.roller.radius)
    assert wearsim.study_cam(scenario).winding_number == pytest.approx(ratio)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"roller__radius": "40 mm", "cam__base_radius": "5 mm"}, "undercut"),
        ({"cam__base_radius": "5.152252 mm"}, "undercut"),
        ({"load__preload": "75.3 N"}, "the follower jumps"),
        ({"cam__stations": 0}, r"\[cam\] stations: is neither 'auto' nor a whole number"),
    ],
)
def test_impossible_case_is_refused(changes, words):
    with pytest.raises(ScenarioError, match=words):
        wearsim.run(prescribed(**changes, **SHORT))


def test_skid_through_a_whole_dwell_conserves_volume():
    scenario = cam(roller__inertia="1e-2 kg m^2", **{**SHORT, "operation__turns": 10})
    result = wearsim.run(scenario)
    energy = 1.1e-11 * result.dissipated_energy[-1]
    assert result.worn_volume[-1] == pytest.approx(energy, rel=1e-12, abs=0.0)
    dwell = result.values("station_angle") < np.pi / 2.0
    creepage = np.abs(turn_of(scenario).slip(result.values("station_angle")[dwell]))
    assert (creepage > 0.0).all()


def test_free_rollers_of_a_cam_agree_with_single_solutions():
    study = wearsim.study_cam(cam())
    single = [
        wearsim.study_cam(cam(), [theta]).contacts.longitudinal_creepage[0]
        for theta in study.point.angle[[0, 6, 20]]
    ]
    together = study.contacts.longitudinal_creepage[[0, 6, 20]]
    # a single contact takes the lever arm of every strip, several take its mean
    assert together == pytest.approx(single, rel=1e-3)
