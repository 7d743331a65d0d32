"""Lifts and surfaces of cams that were measured with noise, and their files."""

from __future__ import annotations

import math
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.scenario.test_cam_tables import CYCLOIDAL, SWINGING, points, read, with_file
from wearsim.errors import ScenarioError
from wearsim.mechanics.cam import surface_points
from wearsim.mechanics.cam.smoothing import estimated_noise, smoothed
from wearsim.models.motion import LiftSpline
from wearsim.scenario import Scenario
from wearsim.studies.cam.checks import noise_warnings
from wearsim.studies.cam.study import study_cam
from wearsim.studies.cam.turn import turn_of

DEGREES = np.arange(0.0, 360.0)
FINE = np.linspace(0.0, math.tau, 2000, endpoint=False)


@cache
def exact(text: str = CYCLOIDAL) -> Scenario:
    return read(text)


def lift_rows(noise: float, seed: int = 0, degrees: np.ndarray = DEGREES) -> np.ndarray:
    """Return angles [deg] and lifts [mm] of the cycloidal cam with noise [mm]."""
    lift = 1e3 * exact().cam.motion.lift(np.radians(degrees))[0]
    noisy = lift + noise * np.random.default_rng(seed).standard_normal(len(lift))
    return np.stack([degrees, noisy], axis=1)


def measured(
    folder: Path, rows: np.ndarray, way: str = "lift", head: str = "angle [deg], lift [mm]"
) -> Scenario:
    (folder / "points.csv").write_text(points(head, rows))
    return read(with_file(way), folder)


def error_of_acceleration(scenario: Scenario) -> float:
    """Return the rms error of the acceleration over a turn, over its peak."""
    true = exact().cam.motion.lift(FINE)[2]
    away = scenario.cam.motion.lift(FINE)[2] - true
    return float(np.sqrt((away**2).mean()) / np.abs(true).max())


SEEDS = [*range(10), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(10, 20))]


@pytest.mark.parametrize("seed", SEEDS)
def test_acceleration_of_a_noisy_lift_is_within_2_percent(tmp_path, seed):
    found = measured(tmp_path, lift_rows(2e-3, seed))
    assert error_of_acceleration(found) < 0.02
    assert turn_of(found).stations.count < 150
    assert found.cam.measured.noise == pytest.approx(2e-6, rel=0.15)
    stated = found.cam.measured.error / found.cam.measured.peak
    assert 0.5 < stated / error_of_acceleration(found) < 2.0


def test_warning_states_noise_and_its_effect_on_acceleration_and_force(tmp_path):
    found = measured(tmp_path, lift_rows(2e-3))
    (text,) = noise_warnings(turn_of(found))
    own, unit_force = found.cam.measured, 0.5 * found.operation.speed**2
    assert f"scatter by {1e6 * own.noise:.2g} um" in text
    assert f"points.csv: its noise of {1e6 * own.noise:.2g} um is smoothed" in found.notes[0]
    assert f"{1e3 * own.error:.2g} mm/rad^2 and the force by {unit_force * own.error:.2g} N" in text
    # a spline through every point is as bad as the warning says
    through = LiftSpline(*closed(lift_rows(2e-3)), closed=True)
    away = through(FINE)[2] - exact().cam.motion.lift(FINE)[2]
    assert own.scatter == pytest.approx(float(np.sqrt((away**2).mean())), rel=0.5)


def closed(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return angles [rad] and lifts [m] with the first point repeated at the end."""
    lift = 1e-3 * rows[:, 1]
    return np.append(np.radians(rows[:, 0]), math.tau), np.append(lift, lift[0])


def with_tolerance(text: str) -> str:
    return with_file("lift").replace('points.csv"', f'points.csv"\nlift_tolerance = "{text}"')


def test_lift_tolerance_is_the_noise_and_zero_follows_every_point(tmp_path):
    rows = lift_rows(2e-3)
    (tmp_path / "points.csv").write_text(points("angle [deg], lift [mm]", rows))
    found = read(with_tolerance("2 um"), tmp_path)
    assert error_of_acceleration(found) < 0.02
    assert len(noise_warnings(turn_of(found))) == 1
    coarse = read(with_tolerance("20 um"), tmp_path)
    assert "lift_tolerance is 20 um" in noise_warnings(turn_of(coarse))[1]
    with pytest.raises(ScenarioError, match="the slope of the lift jumps"):
        read(with_tolerance("0 um"), tmp_path)
    with pytest.raises(ScenarioError, match=r"lift_tolerance: wrong dimension"):
        read(with_tolerance("2 N"), tmp_path)


@pytest.mark.parametrize("quantum", [1e-3, 1e-4])
def test_rounded_lift_is_smoothed(tmp_path, quantum):
    rows = lift_rows(0.0)
    rows[:, 1] = np.round(rows[:, 1] / quantum) * quantum
    found = measured(tmp_path, rows)
    assert error_of_acceleration(found) < 0.01
    assert turn_of(found).stations.count < 250
    assert found.cam.measured.noise < 0.5e-3 * quantum


def test_exact_lift_is_followed_through_every_point(tmp_path):
    found = measured(tmp_path, lift_rows(0.0))
    assert found.cam.measured is None
    assert noise_warnings(turn_of(found)) == []
    at_points = found.cam.motion.lift(np.radians(DEGREES))[0]
    assert at_points == pytest.approx(1e-3 * lift_rows(0.0)[:, 1], abs=1e-12)


def test_noise_is_estimated_at_any_spacing():
    generator = np.random.default_rng(3)
    angle = np.sort(generator.uniform(0.0, math.tau, 400))
    values = np.sin(3.0 * angle) + 1e-3 * generator.standard_normal(400)
    assert estimated_noise(angle, values) == pytest.approx(1e-3, rel=0.2)
    assert estimated_noise(angle, np.sin(angle)) < 1e-8
    found = smoothed(angle, values)
    assert found.noise == pytest.approx(1e-3, rel=0.1)
    assert found.dwells == ()
    away = found(FINE)[2] + 9.0 * np.sin(3.0 * FINE)
    assert float(np.sqrt((away**2).mean())) < 2.0 * found.second_error < 0.2


def test_corner_of_a_noisy_lift_is_refused(tmp_path):
    triangle = 5.0 - np.abs(DEGREES - 180.0) / 36.0
    noisy = triangle + 2e-3 * np.random.default_rng(0).standard_normal(360)
    with pytest.raises(ScenarioError, match="slope of the lift jumps, got a corner at 180"):
        measured(tmp_path, np.stack([DEGREES, noisy], axis=1))


def test_lift_at_uneven_angles_is_smoothed(tmp_path):
    degrees = np.sort(np.random.default_rng(2).uniform(0.0, 360.0, 500))
    found = measured(tmp_path, lift_rows(2e-3, degrees=degrees))
    assert found.cam.measured.noise == pytest.approx(2e-6, rel=0.15)
    true = exact().cam.motion.lift(FINE + math.radians(degrees[0]))[2]  # 0 is the first angle
    away = found.cam.motion.lift(FINE)[2] - true
    assert float(np.sqrt((away**2).mean())) < 0.02 * np.abs(true).max()


def test_few_points_are_followed(tmp_path):
    found = measured(tmp_path, lift_rows(2e-3, degrees=np.arange(0.0, 360.0, 10.0)))
    assert found.cam.measured is None


def test_ends_of_a_noisy_turn_may_differ_by_the_noise(tmp_path):
    rows = lift_rows(2e-3, degrees=np.arange(0.0, 361.0))
    assert error_of_acceleration(measured(tmp_path, rows)) < 0.02
    rows[-1, 1] += 0.1
    with pytest.raises(ScenarioError, match=r"does not close: .*, got .* mm and .* mm, expect"):
        measured(tmp_path, rows)


@pytest.mark.parametrize("degrees", [np.arange(0.0, 360.0, 0.5), np.arange(0.0, 360.0, 2.0)])
def test_dwells_of_a_noisy_lift_are_segments(tmp_path, degrees):
    found = measured(tmp_path, lift_rows(2e-3, degrees=degrees)).cam.motion
    dwells = [part for part in found.segments if part.dwell]
    starts = [found.starts[number] for number, part in enumerate(found.segments) if part.dwell]
    for part, start in zip(dwells, starts, strict=True):
        middle = math.degrees(start + 0.5 * part.angle)
        assert 0.0 < middle < 90.0 or 180.0 < middle < 270.0
    total = math.degrees(sum(part.angle for part in dwells))
    assert 140.0 < total < 181.0


def surface_rows(noise: float, seed: int, offset: float = 0.0) -> tuple[np.ndarray, Scenario]:
    """Return polar angles [deg] and radii [mm] of the cycloidal cam, and its scenario."""
    text = CYCLOIDAL.replace('mass = "0.5 kg"', f'mass = "0.5 kg"\noffset = "{offset} mm"')
    scenario = read(text)
    turn = turn_of(scenario)
    point = turn.at_angles(np.linspace(0.0, math.tau, 7200, endpoint=False))
    _, (x, y) = surface_points(turn.cam.follower, point.kinematics, point.angle)
    polar, radius = np.mod(np.arctan2(y, x), math.tau), np.hypot(x, y)
    order = np.argsort(polar)
    at = np.interp(np.radians(DEGREES), polar[order], radius[order], period=math.tau)
    noisy = 1e3 * at + noise * np.random.default_rng(seed).standard_normal(360)
    return np.stack([DEGREES, noisy], axis=1), scenario


@pytest.mark.parametrize("offset", [0.0, 4.0])
def test_noisy_surface_is_smoothed_with_its_dwells(tmp_path, offset):
    rows, scenario = surface_rows(2e-3, 0, offset)
    (tmp_path / "points.csv").write_text(points("angle [deg], radius [mm]", rows))
    more = f'mass = "0.5 kg"\noffset = "{offset} mm"'
    found = read(with_file("profile").replace('mass = "0.5 kg"', more), tmp_path)
    true = scenario.cam.motion.lift(FINE)
    assert found.cam.motion.lift(FINE)[0] == pytest.approx(true[0], abs=4e-6)
    away = found.cam.motion.lift(FINE)[2] - true[2]
    error = float(np.sqrt((away**2).mean()))
    assert error < 0.03 * np.abs(true[2]).max()
    assert 0.5 < found.cam.measured.error / error < 2.0
    assert sum(part.dwell for part in found.cam.motion.segments) >= 2
    assert turn_of(found).stations.count < 200


def test_x_and_y_of_a_noisy_surface_are_those_of_its_radius(tmp_path):
    rows, _ = surface_rows(2e-3, 0)
    polar = np.radians(rows[:, 0])
    around = np.stack([rows[:, 1] * np.cos(polar), rows[:, 1] * np.sin(polar)], axis=1)
    one = measured(tmp_path, around, "profile", "x [mm], y [mm]").cam.motion
    other = measured(tmp_path, rows, "profile", "angle [deg], radius [mm]").cam.motion
    assert one.lift(FINE)[0] == pytest.approx(other.lift(FINE)[0], abs=1e-9)


HEADS = [
    ("Winkel [°]; Hub [mm]", ""),
    ("Drehwinkel (°);Hub (mm)", ""),
    ("Nockenwinkel {deg}; Hub {mm}", ""),
    ("Winkel in Grad;Hub in mm", ""),
    ("Winkel <°>;Rollenhub <mm>", ""),
    ("Kanal 1;Kanal 2;Kanal 3", 'columns = ["Kanal 1", "Kanal 2"]\nunits = ["deg", "mm"]'),
    ("phi [°];s1 [mm]", 'columns = ["phi", "s1"]'),
    ("Winkel;Hub\n°;mm", ""),
]


@pytest.mark.parametrize(("head", "keys"), HEADS)
def test_headers_of_instruments_are_read(tmp_path, head, keys):
    rows = lift_rows(0.0)
    cells = [[f"{value:.9f}".replace(".", ",") for value in row] for row in rows.tolist()]
    more = ["0"] if "Kanal 3" in head else []
    text = "\n".join([head, *(";".join([*row, *more]) for row in cells)])
    (tmp_path / "points.csv").write_text(text, encoding="latin-1")
    toml = with_file("lift").replace('points.csv"', f'points.csv"\n{keys}')
    found = read(toml, tmp_path).cam.motion
    true = exact().cam.motion.lift(FINE)[0]
    assert found.lift(FINE)[0] == pytest.approx(true, abs=1e-7)


@pytest.mark.parametrize("unit", ["deg", "rad", "mm"])
def test_lift_of_an_arm_is_in_degrees_radians_or_along_its_arc(tmp_path, unit):
    shape = read(SWINGING).cam
    lift = shape.motion.lift(np.radians(DEGREES))[0]
    scale = {"deg": math.degrees(1.0), "rad": 1.0, "mm": 80.0}[unit]
    rows = np.stack([DEGREES, lift * scale], axis=1)
    (tmp_path / "points.csv").write_text(points(f"angle [deg], lift [{unit}]", rows))
    text = SWINGING.replace('shape = "eccentric"', 'lift = "points.csv"')
    text = "\n".join(line for line in text.splitlines() if not line.startswith("eccentricity"))
    found = read(text, tmp_path).cam.motion
    assert found.lift(FINE)[0] == pytest.approx(shape.motion.lift(FINE)[0], abs=1e-9)


def test_residuals_of_a_noisy_arm_are_angles(tmp_path):
    lift = read(SWINGING).cam.motion.lift(np.radians(DEGREES))[0]
    noisy = lift + 2e-5 * np.random.default_rng(3).standard_normal(len(lift))
    rows = np.stack([DEGREES, np.degrees(noisy)], axis=1)
    (tmp_path / "points.csv").write_text(points("angle [deg], lift [deg]", rows))
    text = SWINGING.replace('shape = "eccentric"', 'lift = "points.csv"')
    text = "\n".join(line for line in text.splitlines() if not line.startswith("eccentricity"))
    shown = {row.label: row.text for row in study_cam(read(text, tmp_path)).view.rows()}
    assert re.search(r"noise 0\.0[12]\d+ mrad", shown["residuals of the lift"])


def test_message_names_the_columns_that_were_found(tmp_path):
    with pytest.raises(ScenarioError) as caught:
        measured(tmp_path, lift_rows(0.0), "lift", "Kanal 1 [deg], Kanal 2 [mm]")
    for part in ("column 'lift' is missing", "Kanal 1 [deg], Kanal 2 [mm]", "columns = ["):
        assert part in str(caught.value)
    with pytest.raises(ScenarioError) as caught:
        measured(tmp_path, lift_rows(0.0), "profile", "Kanal 1 [deg], Kanal 2 [mm]")
    for part in ("neither the columns angle and radius", "kanal 1, kanal 2", "columns = ["):
        assert part in str(caught.value)


def test_columns_without_a_table_have_no_meaning():
    text = CYCLOIDAL.replace("motion = [", 'columns = ["a", "b"]\nmotion = [', 1)
    with pytest.raises(ScenarioError, match="columns: has no meaning without lift or profile"):
        read(text)
