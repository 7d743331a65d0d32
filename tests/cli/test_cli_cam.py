"""`wearsim cam`, `wearsim check` and `wearsim new cam`."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest
from cli_examples import SCENARIOS, Command

CAM = str(SCENARIOS / "cam-cycloidal.toml")
KEYS = {
    *("perimeter_m", "load_integral_N_m", "max_pressure_angle_rad", "min_radius_of_curvature_m"),
    *("harmonic_limit", "harmonic_limit_depth_m", "jump_speed_rad_per_s", "winding_number"),
    "stations",
}
COLUMNS = {
    *("angle_rad", "lift_m", "lift_per_rad_m", "lift_per_rad2_m", "pressure_angle_rad"),
    *("curvature_per_m", "rolling_speed_m_per_s", "roller_speed_ratio", "normal_force_N"),
    *("peak_pressure_Pa", "drive_torque_N_m"),
}


def data(command: Command, *arguments: str) -> dict:
    done = command("cam", *arguments, "--json")
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def test_json_has_all_keys_and_the_stations_of_a_run(command: Command) -> None:
    found = data(command, CAM)
    assert set(found) >= KEYS
    stations = found["stations"]
    assert set(stations) >= COLUMNS
    assert {len(column) for column in stations.values()} == {28}
    assert sum(stations["weight_rad"]) == pytest.approx(math.tau)
    assert found["load_integral_N_m"] == pytest.approx(59.8782867, abs=5e-8)


def test_chosen_angles_keep_their_order(command: Command) -> None:
    path = str(SCENARIOS / "cam-eccentric.toml")
    stations = data(command, path, "--at", "180 deg, 0 deg,-60 deg")["stations"]
    assert stations["angle_rad"] == pytest.approx([math.pi, 0.0, -math.pi / 3.0])
    assert stations["normal_force_N"] == pytest.approx(
        [324.369394, 319.538258, 325.782926], abs=5e-7
    )
    assert stations["peak_pressure_Pa"] == pytest.approx([698.164e6, 694.681e6, 699.177e6], abs=5e2)


def test_film_thickness_is_printed_with_a_lubricant(command: Command) -> None:
    command("new", "cam", "film.toml")
    stations = data(command, "film.toml", "--at", "10 deg")["stations"]
    assert 0.1e-6 < stations["film_thickness_m"][0] < 2e-6
    ratio = stations["film_thickness_m"][0] / 0.3e-6
    assert stations["film_ratio"] == pytest.approx([ratio])


def test_arm_has_its_lift_in_radians(command: Command) -> None:
    stations = data(command, str(SCENARIOS / "cam-swinging.toml"), "--at", "60 deg")["stations"]
    assert stations["lift_per_rad_rad"] == pytest.approx([0.002658663], abs=5e-10)
    assert stations["lift_per_rad2_rad"] == pytest.approx([-0.06981676], abs=5e-9)


def test_rounding_of_zeros_is_not_printed(command: Command) -> None:
    shown = command("cam", str(SCENARIOS / "cam-groove.toml")).stdout
    assert "modified-sine" in shown
    assert re.findall(r"e-(?:1[2-9]|2\d)", shown) == []


def test_lives_far_below_the_greatest_are_printed(command: Command) -> None:
    law = (
        '{law = "pressure-life", reference_passes = 2e8, reference_pressure = "800 MPa",'
        ' exponent = 40, endurance_pressure = "300 MPa", source = "made up"}'
    )
    fatigue = ("--set", "fatigue.slope=1.1", "--set", f"fatigue.cylinder={law}")
    path, angles = str(SCENARIOS / "cam-groove.toml"), ("--at", "96 deg,130 deg,136.6 deg")
    pressures = data(command, path, *angles, *fatigue)["stations"]["peak_pressure_Pa"]
    lines = command("cam", path, *angles, *fatigue).stdout.splitlines()
    start = next(number for number, line in enumerate(lines) if "pitting [turns]" in line)
    heads, *rows = lines[start : start + 4]
    place = len(re.split("  +", heads[: heads.index("pitting [turns]")].rstrip()))
    lives = [re.split("  +", row)[place] for row in rows]
    assert lives[:2] == [f"{2e8 * (8e8 / pressure) ** 40:.3e}" for pressure in pressures[:2]]
    assert lives[2] == "-"


def test_table_and_figure(command: Command) -> None:
    done = command("cam", CAM, "--at", "10 deg,135 deg", "-o", "cam.png")
    assert done.exit_code == 0, done.output
    assert "perimeter" in done.stdout
    assert "cycloidal" in done.stdout
    assert Path("cam.png").read_bytes().startswith(b"\x89PNG")
    assert command("cam", CAM, "-o", "cam.png").exit_code == 2


@pytest.mark.parametrize("angles", ["10", "10 mm", "abc", ""])
def test_angles_without_a_unit_of_angle_are_refused(command: Command, angles: str) -> None:
    refused = command("cam", CAM, "--at", angles)
    assert refused.exit_code == 2
    assert "--at" in refused.stderr


def test_cylinder_has_no_cam(command: Command) -> None:
    refused = command("cam", str(SCENARIOS / "rig-450min.toml"))
    assert refused.exit_code == 2
    assert "a table [cam]" in " ".join(refused.stderr.split())


def test_new_cam_is_checked_with_its_stations(command: Command) -> None:
    assert command("new", "cam").exit_code == 0
    checked = command("check", "cam.toml")
    assert checked.exit_code == 0, checked.output
    assert "28 stations" in checked.stdout
    assert checked.stdout.count("cycloidal") >= 26
    stations = json.loads(command("check", "cam.toml", "--json").stdout)["cam"]["stations"]
    assert len(stations["angle_rad"]) == 28


def test_jump_of_the_follower_is_an_error_with_exit_code_2(command: Command) -> None:
    refused = command("check", CAM, "--set", "load.preload=5 N")
    assert refused.exit_code == 2
    assert "the follower jumps" in refused.stderr


def test_check_gives_the_greatest_pressure_of_a_turn_at_its_own_load(command: Command) -> None:
    command("new", "cam", "cam.toml")
    soft = '{youngs_modulus="210 GPa", poisson_ratio=0.3, yield_stress="160 MPa"}'
    checked = command("check", "cam.toml", "--json", "--set", f"cam.material={soft}")
    found = json.loads(checked.stdout)
    patch = found["initial_patch"]
    stations = data(command, "cam.toml", "--set", f"cam.material={soft}")["stations"]
    pressures = stations["peak_pressure_Pa"]
    assert patch["peak_pressure_Pa"] == pytest.approx(max(pressures))
    place = pressures.index(max(pressures))
    assert patch["load_N"] == pytest.approx(stations["normal_force_N"][place])
    assert patch["load_N"] < max(stations["normal_force_N"])
    assert any(text.startswith("cam.material: the peak pressure") for text in found["warnings"])


def test_check_states_the_friction_of_a_bearing(command: Command) -> None:
    friction = ["--set", "creepage.bearing_friction=0.002"]
    friction += [
        "--set",
        "creepage.bearing_diameter=12 mm",
        "--set",
        "creepage.bearing_torque=0 N mm",
    ]
    text = " ".join(command("check", CAM, *friction).stdout.split())
    assert "creepage free, bearing friction 0.002, yaw 1 mrad" in text
    assert "bearing torque" not in text
