"""Feedback of wear on the load of a cam, by the spring and the inertia of the follower."""

from __future__ import annotations

import numpy as np
import pytest
from cam_text import cam

import wearsim
from wearsim.errors import ScenarioError
from wearsim.studies.cam.stations import cam_stations, harmonics_of
from wearsim.studies.cam.turn import turn_of


def stations_of(**changes):
    return turn_of(cam("eccentric", load__feedback="inertia", cam__stations=25, **changes))


def test_harmonics_act_through_the_inertia():
    turn = stations_of()
    found = cam_stations(turn)
    angle, cosine = found.angle[:, 0, 0], np.cos(found.pressure_angle[:, 0, 0])
    mass, omega = 0.5, turn.speed
    for order in (1, 3, 8):
        lift = 1e-6 * np.cos(order * angle)
        displacement = -(lift * cosine)[:, None, None]
        force = -found.with_inertia(np.zeros(displacement.shape), displacement)[:, 0, 0]
        assert force == pytest.approx(-mass * (omega * order) ** 2 * lift / cosine, rel=1e-6)
    assert np.abs(found.inertia @ np.cos(12 * angle)).max() < 0.5 * mass * omega**2 * 144.0


def test_number_of_harmonics_is_limited_by_stations_and_stability():
    assert harmonics_of(stations_of(), 25) == 8
    light = harmonics_of(stations_of(), 1000)
    heavy = harmonics_of(stations_of(follower__mass="5 kg", load__preload="3 kN"), 1000)
    assert light == 34
    assert heavy < 50


def test_unstable_feedback_is_refused():
    almost_jumping = {"load__preload": "0.2 N", "load__stiffness": "3.2 N/mm"}
    with pytest.raises(
        ScenarioError, match=r"unstable above harmonic, got .*feedback = \"static\""
    ):
        cam_stations(stations_of(**almost_jumping))


def test_single_turns_refuse_the_feedback_of_inertia():
    scenario = cam("eccentric", load__feedback="inertia", evolution={"stepper": "per-pass"})
    with pytest.raises(ScenarioError, match="follows single turns"):
        wearsim.run(scenario)


def test_inertia_changes_the_load_by_the_curvature_of_the_lift_error():
    # this stepper takes equal steps in the three tests: their differences are below the tolerance
    stepper = {"stepper": "stabilised"}
    changes = {"contact": {"strips": 41}, "cam__stations": 25, "operation__turns": 200_000}
    changes["evolution"] = stepper
    runs = [wearsim.run(cam("eccentric", load__feedback=kind, **changes)) for kind in FEEDBACKS]
    depths = [run.values("station_depth")[-1] for run in runs]
    none, static, inertia = depths
    assert (static < none).all()
    # the spring acts on the whole descent, the inertia on its variation along the angle
    change = inertia / static - 1.0
    assert np.abs(change).max() < 1e-4
    deepest, shallowest = static.argmax(), static.argmin()
    assert change[deepest] > change[shallowest]


FEEDBACKS = ("none", "static", "inertia")


def test_circular_cam_with_a_spring_wears_exponentially():
    """A roller of constant width on a circular cam in full slip: D' = c N/w, N = (F - k D/cos)/cos.

    The case of Dickrell, Dooner and Sawyer, J. Tribology 125 (2003), with our own derivation.
    """
    turns, wear, width, spring = 60_000, 1.1e-9 * 0.1 * 1e-3, 10e-3, 5e5
    scenario = cam(
        "eccentric",
        cam__eccentricity="0.1 mm",
        roller__width="10 mm",
        roller__crown_radius="1000 m",
        follower__mass="0 kg",
        load__stiffness="500 N/mm",
        load__feedback="static",
        wear__cylinder__k_over_h="1.1e-9 1/Pa",
        contact={"strips": 81},
        operation__turns=turns,
    )
    result, turn = wearsim.run(scenario), turn_of(scenario)
    point = turn.at_stations(turn.stations)
    cosine = np.cos(point.kinematics.pressure_angle)
    force = 300.0 + spring * point.kinematics.lift
    worn = 1.0 - np.exp(-wear * spring * turns / (width * cosine**2))
    exact = force * cosine / spring * worn
    profiles = result.values("cylinder_depth_profile")[-1]
    depth = profiles[:, np.abs(result.y) < 3.5e-3].mean(axis=1)
    assert depth == pytest.approx(exact, rel=5e-4)
    assert worn.min() > 0.25
