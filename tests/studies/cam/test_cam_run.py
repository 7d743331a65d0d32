"""Runs of cams: against the rig, closed forms, energy, single turns and a resumed run."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cam_text import cam, prescribed

import wearsim
from tests.report.drawn import run_figure as cam_run_figure
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.steppers.single_step import explicit_step
from wearsim.mechanics.cam.stations import NUMBERS
from wearsim.studies.cam.turn import turn_of
from wearsim.studies.opening import export_csv
from wearsim.studies.run.assemble import assemble_problem
from wearsim.studies.run.draws import draw
from wearsim.studies.run.result import read_results

SCENARIOS = Path(__file__).parents[3] / "scenarios"
SHORT = {"operation__turns": 20_000, "contact": {"strips": 61}}


def test_concentric_cam_equals_the_cylinder_bit_for_bit():
    rig, worn = (
        wearsim.run(wearsim.load_scenario(SCENARIOS / f"{name}.toml"))
        for name in ("rig-450min", "cam-concentric")
    )
    for name in ("depth", "width", "worn_volume", "dissipated_energy", "time", "peak_pressure"):
        assert np.array_equal(getattr(rig, name), getattr(worn, name)), name
    assert worn.values("turns")[-1] == 450_000
    assert worn.values("lift_error")[-1] == 0.0
    angles = [row.text for row in worn.view.rows() if row.label.startswith("angle")]
    assert angles == ["not determined"] * 4


def test_run_of_a_cam_stops_and_is_extended_by_turns(tmp_path):
    scenario = prescribed(**{**SHORT, "operation__turns": 100}, operation__rollers=2)
    stopped = wearsim.run(scenario, tmp_path / "cam.h5", until="30 turns")
    assert (stopped.values("turns")[-1], stopped.passes[-1]) == (30.0, 60.0)
    longer = wearsim.resume(tmp_path / "cam.h5", until="150 turns")
    assert (longer.values("turns")[-1], longer.finished) == (150.0, True)


def closed_form(force: np.ndarray, turns: float) -> np.ndarray:
    """Return the depth in full slip at a constant load [m]."""
    per_load = 1.1e-11 * 0.1 * 1e-3
    return (0.75 * per_load * force * turns / math.sqrt(2.0 * 0.5)) ** (2.0 / 3.0)


@pytest.fixture(scope="module")
def eccentric():
    return wearsim.run(cam("eccentric", contact={"strips": 161}))


def test_depth_in_full_slip_is_that_of_the_closed_form_at_every_station(eccentric):
    scenario = cam("eccentric")
    turn = turn_of(scenario)
    force = turn.at_stations(turn.stations).normal_force
    exact = closed_form(force, 1.35e6)
    assert exact[0] * 1e6 == pytest.approx(50.21965, abs=5e-6)
    angles = eccentric.values("station_angle")
    opposite = exact[np.abs(angles - math.pi).argmin()]
    assert opposite * 1e6 == pytest.approx(50.72457, abs=5e-6)
    depth = eccentric.values("station_depth")[-1]
    assert depth == pytest.approx(exact, rel=2e-3)


def test_worn_volume_is_the_energy_times_the_wear_factor(eccentric):
    energy = eccentric.dissipated_energy[1:]
    assert eccentric.worn_volume[1:] == pytest.approx(1.1e-11 * energy, rel=1e-12, abs=0.0)


@pytest.mark.parametrize(
    "scenario",
    [prescribed(**SHORT), cam(**{**SHORT, "operation__turns": 3000}), cam("swinging", **SHORT)],
    ids=["prescribed", "free", "swinging"],
)
def test_both_volumes_are_the_energy_times_the_wear_factor(scenario):
    result = wearsim.run(scenario)
    energy = 1.1e-11 * result.dissipated_energy[1:]
    assert result.worn_volume[1:] == pytest.approx(energy, rel=1e-12, abs=0.0)
    assert result.roller_worn_volume[1:] == pytest.approx(energy, rel=1e-12, abs=0.0)
    assert result.raw.history["turns"][-1] == scenario.operation.turns


def test_volume_with_skids_is_the_energy_times_the_wear_factor():
    scenario = cam(roller__inertia="3e-3 kg m^2", **{**SHORT, "operation__turns": 300})
    result = wearsim.run(scenario)
    energy = 1.1e-11 * result.dissipated_energy[1:]
    assert result.worn_volume[1:] == pytest.approx(energy, rel=1e-12, abs=0.0)
    skids = wearsim.study_cam(scenario).skids
    turns = result.raw.history["turns"][-1]
    assert result.dissipated_energy[-1] > turns * sum(skid.energy for skid in skids)


def constant(load="300 N", **changes):
    """Return the eccentric cam under a constant normal force, with equal wear of both bodies."""
    table = {"kind": "constant", "normal_force": load}
    scenario = cam("eccentric", wear__roller__k_over_h="1.1e-11 1/Pa", **changes)
    text = scenario.text
    start, stop = text.index("[load]"), text.index("[friction]")
    lines = "".join(f'{key} = "{value}"\n' for key, value in table.items())
    return wearsim.Scenario.from_toml(f"{text[:start]}[load]\n{lines}\n{text[stop:]}")


def test_depths_of_both_bodies_at_a_constant_load():
    scenario = constant(contact={"strips": 161})
    result = wearsim.run(scenario)
    assert result.depth[-1] * 1e6 == pytest.approx(36.74615, rel=2e-3)
    assert result.roller_depth[-1] * 1e6 == pytest.approx(45.93268, rel=2e-3)
    assert (result.depth + result.roller_depth)[-1] * 1e6 == pytest.approx(82.67883, rel=2e-3)


def test_number_of_stations_is_within_the_tolerance():
    integrals, volumes, depths = [], [], []
    # equal steps, so that errors of the stepper cancel
    changes = {"wear__roller__k_over_h": "0 1/Pa", "evolution": {"step": 500}, **SHORT}
    exact = turn_of(prescribed()).integral("load")
    for number in (*NUMBERS, 49):
        scenario = prescribed(cam__stations=number, **changes)
        turn = turn_of(scenario)
        point = turn.at_stations(turn.stations)
        load = turn.stations.weight @ (point.normal_force * point.kinematics.travel)
        integrals.append(abs(load / exact - 1.0))
        result = wearsim.run(scenario)
        volumes.append(result.worn_volume[-1])
        depths.append(turn.stations.values_at(result.values("station_depth")[-1], 25)[1])
    errors = np.abs(np.array(volumes[:-1]) / volumes[-1] - 1.0)
    between = [np.abs(depth / depths[-1] - 1.0).max() for depth in depths[:-1]]
    assert between[1] < 2.5e-4  # at any angle
    assert between[1] < 0.05 * between[0]
    assert integrals[1] < 1e-6
    assert integrals[1] < 1e-2 * integrals[0]
    assert errors[1] < 2.5e-4  # the number that "auto" chooses
    assert errors[1] < 0.1 * errors[0]


def test_implicit_steps_agree_with_every_turn_one_by_one():
    changes = {
        "operation__turns": 200,
        "contact": {"strips": 61},
        "cam__stations": 3,
        "wear__cylinder__k_over_h": "5e-9 1/Pa",
        "wear__roller__k_over_h": "5e-9 1/Pa",
        "load__stiffness": "500 N/mm",
        "load__preload": "600 N",
        "roller__crown_radius": "100 mm",
    }
    fast = wearsim.run(prescribed(**changes))
    slow = wearsim.run(prescribed(evolution={"stepper": "per-pass"}, **changes))
    depth, truth = (run.values("station_depth")[-1] for run in (fast, slow))
    assert truth.min() > 3e-6
    error = float(fast.depth_error[-1])
    assert np.abs(depth - truth).max() <= error + 1e-3 * truth.max()
    assert slow.worn_volume[-1] == pytest.approx(
        5e-9 * slow.dissipated_energy[-1], rel=1e-9, abs=0.0
    )
    assert slow.roller_worn_volume[-1] == pytest.approx(slow.worn_volume[-1], rel=1e-9, abs=0.0)


def test_spring_feedback_lowers_the_load():
    changes = {"load__stiffness": "500 N/mm", "load__preload": "600 N", **SHORT}
    changes["wear__cylinder__k_over_h"] = "5e-10 1/Pa"
    without = wearsim.run(prescribed(load__feedback="none", **changes))
    static = wearsim.run(prescribed(**changes))
    assert static.depth[-1] < 0.999 * without.depth[-1]
    assert static.normal_force[-1] < without.normal_force[-1]
    assert without.normal_force[-1] == pytest.approx(without.normal_force[0], rel=1e-12)


def test_lift_error_is_the_descent_over_the_cosine(eccentric):
    final = eccentric.final
    depth, alpha = eccentric.values("station_depth")[-1], eccentric.values("pressure_angle")
    curve = eccentric.values("lift_error_curve")[-1]
    assert curve == pytest.approx(-depth / np.cos(alpha), rel=1e-3)
    assert final["lift_error_m"] == pytest.approx(np.ptp(curve), rel=2e-2)
    assert final["station_depth_m"] == pytest.approx(depth)
    theta = np.linspace(0.0, math.pi, 1801)
    point = turn_of(cam("eccentric")).at_angles(theta)
    wear = point.normal_force ** (2.0 / 3.0) / np.cos(point.kinematics.pressure_angle)
    least, most = final["least_wear_angle_rad"], final["greatest_wear_angle_rad"]
    assert math.cos(most) == pytest.approx(math.cos(theta[wear.argmax()]), abs=5e-3)
    assert math.cos(least) == pytest.approx(1.0, abs=1e-3)
    assert final["station_lift_error_from_dwell_m"] == pytest.approx(curve - curve[0])  # no dwell


def test_greatest_depth_lies_between_the_stations(eccentric):
    turn = turn_of(cam("eccentric"))
    theta = np.linspace(0.0, math.pi, 1801)
    place = theta[turn.at_angles(theta).normal_force.argmax()]  # the depth grows with the load
    error = float(eccentric.values("depth_angle_error_by_stations")[-1])
    assert abs(eccentric.final["depth_angle_rad"] - place) < error + math.radians(0.2)
    assert eccentric.depth[-1] > eccentric.values("station_depth")[-1].max() * 1.0002


@pytest.mark.parametrize("stations", [5, 7, 9])
def test_few_stations_have_errors_within_the_stated_ones(stations):
    changes = {"wear__roller__k_over_h": "0 1/Pa", **SHORT}
    few, many = (wearsim.run(prescribed(cam__stations=n, **changes)) for n in (stations, 25))
    for name in ("depth", "lift_error"):
        error = abs(float(few.values(name)[-1] - many.values(name)[-1]))
        stated = few.values(f"{name}_error_by_stations")[-1]
        assert error <= stated + 5e-4 * many.values(name)[-1]
    assert few.depth_error[-1] >= few.values("depth_error_by_stations")[-1]
    assert any("cam.stations decrease it" in text for text in few.warnings)
    assert not any("cam.stations" in text for text in many.warnings)


def test_interrupted_run_of_a_cam_resumes_bit_for_bit(tmp_path):
    scenario, calls = prescribed(**SHORT), []
    whole = wearsim.run(scenario)

    def stop():
        calls.append(None)
        return len(calls) > 8

    with pytest.raises(wearsim.Interrupted):
        wearsim.run(scenario, tmp_path / "part.h5", stop_requested=stop)
    resumed = wearsim.resume(tmp_path / "part.h5")
    stored = read_results(tmp_path / "part.h5")
    assert stored.static["station_angle"].shape == (28,)
    for name, array in stored.history.items():
        assert np.array_equal(array, whole.raw.history[name]), name
    for name, array in stored.records.items():
        assert np.array_equal(array, whole.raw.records[name]), name
    assert resumed.finished


def test_results_of_a_cam_are_exported_and_drawn(tmp_path, eccentric):
    files = export_csv(eccentric, tmp_path / "csv")
    names = {path.name for path in files}
    assert {"history.csv", "worn_cam.csv"} <= names
    header = (tmp_path / "csv" / "worn_cam.csv").read_text().splitlines()[0]
    assert header.startswith("angle [deg],x unworn [mm],y unworn [mm],x worn [mm],y worn [mm]")
    columns = np.loadtxt(tmp_path / "csv" / "worn_cam.csv", delimiter=",", skiprows=1).T
    fresh, worn = columns[1:3], columns[3:5]
    assert np.hypot(fresh[0] - 5.0, fresh[1]) == pytest.approx(25.0, abs=1e-6)
    lost = 25.0 - np.hypot(worn[0] - 5.0, worn[1])
    assert lost.max() == pytest.approx(1e3 * eccentric.depth[-1], rel=2e-5)
    assert lost.min() == pytest.approx(1e3 * eccentric.values("station_depth")[-1].min(), rel=1e-3)
    panels = {axes.get_title(loc="left"): axes for axes in cam_run_figure(eccentric).axes}
    assert {"Worn depth of the cam", "Worn cam", "Lift error against the unworn cam"} <= set(panels)
    depth = panels["Worn depth of the cam"]
    assert (depth.get_xlabel(), depth.get_ylabel()) == ("angle [deg]", "y across the track [mm]")
    assert [text.get_text() for text in depth.texts] == ["eccentric"]
    assert json.dumps(eccentric.final)


def test_equal_stations_are_solved_once():
    scenario = prescribed(**SHORT)
    problem = assemble_problem(draw(scenario))[0]
    cam_ = problem.kinematics.track
    assert (len(cam_.angle), len(cam_.along.angle)) == (13, 28)
    assert cam_.length.sum() == pytest.approx(cam_.along.length.sum(), rel=1e-14)
    assert cam_.time_share.sum() == pytest.approx(1.0, rel=1e-14)
    whole = replace(problem.kinematics, track=cam_.along)
    gap = np.repeat(problem.flat_gap[:1], 28, axis=0)
    states = []
    for one in (problem, replace(problem, kinematics=whole, flat_gap=gap)):
        state = fresh_state(one)
        for _ in range(3):
            state = explicit_step(one, state, np.full(1, 50.0))
        states.append(state)
    merged, every = (state.cylinder_depth[:, 0, 0].max(axis=-1) for state in states)
    assert merged[cam_.places] == pytest.approx(every, rel=1e-9)
    assert states[0].roller_depth == pytest.approx(states[1].roller_depth, rel=1e-9)
    assert states[0].energy == pytest.approx(states[1].energy, rel=1e-12)


@pytest.mark.slow
def test_implicit_steps_agree_with_20_000_single_turns_at_every_station():
    changes = {
        "operation__turns": 20_000,
        "contact": {"strips": 61},
        "cam__stations": 5,
        "wear__cylinder__k_over_h": "3e-10 1/Pa",
        "wear__roller__k_over_h": "3e-10 1/Pa",
        "load__stiffness": "200 N/mm",
        "roller__crown_radius": "200 mm",
    }
    fast = wearsim.run(prescribed(**changes))
    slow = wearsim.run(prescribed(evolution={"stepper": "per-pass"}, **changes))
    depth, truth = (run.values("station_depth")[-1] for run in (fast, slow))
    stated = fast.depth_error[-1] / fast.depth[-1]
    assert np.abs(depth / truth - 1.0).max() < stated
    assert fast.normal_force[-1] == pytest.approx(slow.normal_force[-1], rel=1e-4)


@pytest.mark.parametrize("rate", ["1.1e-11 1/Pa", "0 1/Pa"])
def test_error_of_the_energy_is_that_of_the_volume_where_bodies_wear_in_proportion(rate):
    def run(**changes):
        scenario = wearsim.load_scenario(SCENARIOS / "cam-eccentric.toml").changed(
            {
                "operation.turns": 2911,
                "creepage.longitudinal": 4.326e-4,
                "load.feedback": "static",
                "wear.cylinder.k_over_h": rate,
                **changes,
            }
        )
        return wearsim.run(scenario)

    coarse, fine = run(**{"evolution.tolerance": 1e-2}), run(**{"contact.strips": 161})
    both = coarse.errors["dissipated_energy"][-1] + fine.errors["dissipated_energy"][-1]
    assert abs(coarse.dissipated_energy[-1] - fine.dissipated_energy[-1]) <= both
    if coarse.worn_volume[-1] > 0.0:
        relative = coarse.volume_error[1:] / coarse.worn_volume[1:]
        error = coarse.errors["dissipated_energy"][1:] / coarse.dissipated_energy[1:]
        assert error == pytest.approx(relative, rel=1e-12, abs=0.0)
    else:
        assert coarse.errors["dissipated_energy"][-1] > 0.0
