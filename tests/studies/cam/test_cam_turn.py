"""Turn of a cam before wear: loads, refusals, flanks of a groove, and skids."""

from __future__ import annotations

import math

import numpy as np
import pytest
from cam_text import cam, prescribed

import wearsim
from wearsim.errors import ScenarioError
from wearsim.scenario import Scenario
from wearsim.studies.cam.checks import cam_warnings, skids_of
from wearsim.studies.cam.stations import cam_stations
from wearsim.studies.cam.study import study_cam
from wearsim.studies.cam.turn import CamTurn, turn_of


def test_stations_and_integrals_of_the_cycloidal_cam():
    turn = turn_of(cam())
    assert turn.stations.numbers == (1, 13, 1, 13)
    assert turn.integral("load") == pytest.approx(59.8782867, abs=5e-8)
    assert turn.integral("travel") == pytest.approx(183.451876e-3, abs=5e-10)
    point = turn.at_stations(turn.stations)
    found = turn.stations.weight @ (point.normal_force * point.kinematics.travel)
    assert found == pytest.approx(59.8782867, rel=2e-7)
    torque = turn.stations.weight @ point.drive_torque
    assert abs(torque) < 1e-6 * np.abs(point.drive_torque).max()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"load__preload": "5 N"},
            r"\[load\] preload: the follower jumps, since .*, got .* segment [24] \(cycl",
        ),
        (
            {"cam__base_radius": "5 mm"},
            r"\[cam\] base_radius: the cam is undercut: .* roller, got .* segment 2",
        ),
        ({"creepage__bearing_torque": "1 N m"}, r"\[roller\] inertia: the roller rolls nowhere"),
        (
            {"creepage__bearing_torque": "1 N m", "roller__inertia": "0 kg m^2"},
            r"\[creepage\] bearing_torque: exceeds .* the roller stops at 156.9 deg, expected",
        ),
    ],
)
def test_what_cannot_run_is_refused_with_the_angle(changes, words):
    with pytest.raises(ScenarioError, match=words):
        CamTurn(cam(**changes)).checked()


def test_jump_speed_is_the_speed_at_which_the_load_vanishes():
    jump = study_cam(cam(), np.zeros(1)).jump_speed
    for factor, jumps in ((0.999, False), (1.001, True)):
        turn = CamTurn(cam(operation__speed=f"{factor * jump!r} rad/s"))
        assert (turn.normal_range[0] < 0.0) == jumps


def test_steep_and_sharp_cams_give_warnings():
    turn = CamTurn(cam(follower__offset="-30 mm"))
    warnings = " ".join(cam_warnings(turn))
    assert "the pressure angle reaches" in warnings
    assert "more than 30 deg" in warnings
    assert "less than twice the roller's 20 mm" in warnings


def test_external_force_presses_on_the_outer_flank(tmp_path):
    rows = [f"{a}, {10.0 + 10.0 * math.sin(math.radians(a))!r}" for a in range(0, 360, 10)]
    (tmp_path / "force.csv").write_text("\n".join(["angle [deg], force [N]", *rows]))
    text, preload = cam().text, 'preload = "300 N"'
    plain, pushed = (
        Scenario.from_toml(text.replace(preload, f"{preload}{more}"), folder=tmp_path)
        for more in ("", '\nexternal = "force.csv"')
    )
    theta = np.radians([45.0, 133.0])
    more = CamTurn(pushed).at_angles(theta)
    less = CamTurn(plain).at_angles(theta)
    extra = (more.normal_force - less.normal_force) * np.cos(less.kinematics.pressure_angle)
    assert extra == pytest.approx(10.0 + 10.0 * np.sin(theta), rel=1e-4)
    assert not any(panel.dwell for panel in CamTurn(pushed).panels)


def heavy(inertia: str = "3e-3 kg m^2"):
    return CamTurn(cam(roller__inertia=inertia))


def test_light_roller_does_not_skid():
    assert CamTurn(cam()).arcs == []


def test_skid_balances_the_momentum_of_the_roller():
    turn = heavy()
    inertia, torque = 3e-3, 10e-3
    friction, radius, speed = 0.1, 20e-3, turn.speed
    for arc in turn.arcs:
        theta = np.linspace(arc.theta[0], arc.theta[-1], 2001)
        panel = turn.panels[arc.panel]
        point, slip = turn.at([panel], theta[None]), arc.slip_at(theta)
        actual = point.kinematics.spin[0] - slip
        force = np.sign(slip) * friction * point.normal_force[0]
        acceleration = np.trapezoid(force * radius - torque, theta) / speed
        change = inertia * speed * (actual[-1] - actual[0])
        scale = inertia * speed * 0.2
        assert change == pytest.approx(acceleration, abs=2e-4 * scale)


def test_energy_of_skids_is_that_of_the_stations():
    turn = heavy()
    stations = cam_stations(turn).along
    point = turn.at_stations(turn.stations)
    power = (
        0.1 * point.normal_force * stations.rolling_speed.ravel() * np.abs(stations.skid.ravel())
    )
    energy = np.nansum(power * turn.stations.weight) / turn.speed
    assert sum(skid.energy for skid in skids_of(turn)) == pytest.approx(energy, rel=1e-12)
    exact = 0.0
    for arc in turn.arcs:
        theta = np.linspace(arc.theta[0], arc.theta[-1], 4001)
        fine = turn.at([turn.panels[arc.panel]], theta[None])
        lost = 0.1 * fine.normal_force[0] * 20e-3 * np.abs(arc.slip_at(theta))
        exact += np.trapezoid(lost, theta)
    assert energy == pytest.approx(exact, rel=1e-3)


def test_heavier_roller_skids_through_a_whole_dwell():
    turn = heavy("1e-2 kg m^2")
    dwell = turn.panels[0]
    theta = np.linspace(dwell.start, dwell.stop, 50)
    assert np.isfinite(turn.slip(theta, np.full(50, 0.7))).all()
    assert any("skids from" in text for text in cam_warnings(turn, skids_of(turn)))


def groove(preload="10 N"):
    return cam(
        follower__contact="groove",
        follower__clearance="0.05 mm",
        load__preload=preload,
        load__stiffness="0 N/mm",
    )


def test_groove_changes_its_flank_where_the_load_vanishes():
    turn = CamTurn(groove()).checked()
    edges = [panel.start for panel in turn.panels]
    ends = np.array([(panel.start, panel.stop) for panel in turn.panels]).T
    within = turn.at(turn.panels, np.linspace(*ends, 11, axis=1)[:, 1:-1])
    assert (within.normal_force > 0.0).all()
    assert all(len(np.unique(inner)) == 1 for inner in within.inner)
    flanks = within.inner[:, 0].tolist()
    assert True in flanks
    assert False in flanks
    assert len(edges) > 4
    inner = turn.at([turn.panels[flanks.index(True)]], np.array([[2.6]])).kinematics
    assert inner.spin[0, 0] < 0.0


def test_change_of_flank_is_a_jump_of_the_spin_and_a_skid():
    turn = CamTurn(groove())
    skids = skids_of(turn)
    assert skids
    assert all(skid.energy > 0.0 for skid in skids)


def test_friction_of_the_bearing_grows_with_the_load():
    rubbing = {"drive": "free", "bearing_friction": 0.01, "bearing_diameter": "15 mm"}
    scenario = cam(creepage=rubbing, roller__inertia="1e-9 kg m^2")
    study = wearsim.study_cam(scenario, [0.0, 1.8, 2.4])
    torque = 0.5 * 0.01 * 15e-3 * study.point.normal_force
    assert study.turn.drag(study.point) == pytest.approx(torque)
    assert torque.max() > 1.2 * torque.min()
    assert -study.contacts.force_x * scenario.roller.radius == pytest.approx(torque, rel=1e-3)


def test_slip_of_prescribed_creepage_is_that_of_the_scenario():
    assert CamTurn(prescribed()).arcs == []


def test_study_of_one_contact_takes_the_first_station_and_dissipation_is_refused():
    study = wearsim.study_contact(prescribed())
    assert "contact of the cam at 45 deg; wearsim cam solves all stations" in study.notes
    assert study.point.normal_force == pytest.approx(300.0)
    with pytest.raises(ScenarioError, match=r"\[cam\]: has many contacts"):
        wearsim.dissipation(prescribed(), 3)


def test_winding_number_and_sweeps():
    study = study_cam(cam("concentric"))
    assert study.winding_number == pytest.approx(1.25)
    assert study.winding_ratio == (5, 4)
    assert study.sweeps == pytest.approx(1.25 * 1e-3 * 450_000)
    assert study.min_radius_of_curvature == pytest.approx(25e-3)
    assert study.harmonic_limit is None


def test_harmonic_limit_is_that_at_the_depth_limit():
    whole, half = (study_cam(cam("eccentric", limit={"depth": d})) for d in ("50 um", "25 um"))
    assert whole.harmonic_limit == study_cam(cam("eccentric")).harmonic_limit
    assert half.harmonic_limit > 1.4 * whole.harmonic_limit


def test_harmonic_limit_of_the_cycloidal_cam():
    turn = turn_of(cam())
    least, omega = turn.normal_range[0], turn.speed
    expected = math.sqrt((least / 50e-6 + 5000.0) / (0.5 * omega**2))
    assert study_cam(cam()).harmonic_limit == pytest.approx(expected)
