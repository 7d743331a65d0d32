"""Files of cams with a wrong unit in their header, and with rounded angles."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from tests.scenario.test_cam_tables import CYCLOIDAL, SWINGING, points, read, with_file
from wearsim.errors import ScenarioError
from wearsim.mechanics.cam import surface_points
from wearsim.scenario import Scenario
from wearsim.studies.cam.turn import turn_of

DEGREES = np.arange(0.0, 360.0)
BASE = read(CYCLOIDAL).cam.base_radius


def lifts() -> np.ndarray:
    """Return angles [deg] and lifts [mm] of the cycloidal cam."""
    return np.stack([DEGREES, 1e3 * read(CYCLOIDAL).cam.motion.lift(np.radians(DEGREES))[0]], 1)


def measured(folder: Path, head: str, rows: np.ndarray, way: str = "lift") -> Scenario:
    (folder / "points.csv").write_text(points(head, rows))
    return read(with_file(way), folder)


@pytest.mark.parametrize(
    ("unit", "factor", "right"),
    [("m", 1.0, "mm"), ("mm", 1e3, "um"), ("um", 1e6, "a smaller unit"), ("cm", 1e2, "a smaller")],
)
def test_lift_in_a_unit_that_is_too_large_is_refused(tmp_path, unit, factor, right):
    with pytest.raises(ScenarioError) as caught:
        measured(tmp_path, f"angle [deg], lift [{unit}]", lifts() * [1.0, factor])
    text = str(caught.value)
    assert (
        "[cam] lift: points.csv: column 'lift' is too large for the base circle: its unit" in text
    )
    assert f"got up to 8000 mm with base_radius = {1e3 * BASE:g} mm, expected {right}" in text
    assert f", not {unit}" in text


@pytest.mark.parametrize(("unit", "factor", "right"), [("mm", 1e-3, "m"), ("um", 1.0, "mm")])
def test_lift_in_a_unit_that_is_too_small_is_noted(tmp_path, unit, factor, right):
    found = measured(tmp_path, f"angle [deg], lift [{unit}]", lifts() * [1.0, factor])
    text = f"up to 0.008 mm with base_radius = {1e3 * BASE:g} mm: unless the cam is almost round"
    (note,) = [note for note in found.notes if "base circle" in note]
    assert f"points.csv: column 'lift' is small for the base circle, {text}" in note
    assert note.endswith(f"its unit is {right}, not {unit}")


def test_unit_of_the_scenario_is_named_where_the_file_has_none(tmp_path):
    (tmp_path / "points.csv").write_text(points("angle, lift", lifts()))
    text = with_file("lift").replace('points.csv"', 'points.csv"\nunits = ["deg", "m"]')
    with pytest.raises(ScenarioError, match=r"column 'lift' is too large .* mm as unit, not m"):
        read(text, tmp_path)


@pytest.mark.parametrize("ratio", [1e-2, 1.0, 5.0])
def test_lifts_of_usual_size_have_no_note(tmp_path, ratio):
    rows = lifts() * [1.0, 1e3 * ratio * BASE / 8.0]
    assert measured(tmp_path, "angle [deg], lift [mm]", rows).notes == ()


def test_radii_in_the_column_of_lifts_are_noted(tmp_path):
    found = measured(tmp_path, "angle [deg], lift [mm]", lifts() + np.array([0.0, 1e3 * BASE]))
    assert f"column 'lift' is nowhere below {1e3 * BASE:g} mm: lifts are counted" in found.notes[0]


def test_constant_lift_is_noted(tmp_path):
    found = measured(tmp_path, "angle [deg], lift [mm]", lifts() * [1.0, 0.0])
    assert "column 'lift' is the same at all angles: the follower does not move" in found.notes[0]


def surface(way: str, factor: float) -> tuple[str, np.ndarray]:
    """Return the header and the points of the surface of the cycloidal cam, times a factor."""
    turn = turn_of(read(CYCLOIDAL))
    point = turn.at_angles(np.linspace(0.0, math.tau, 720, endpoint=False))
    _, (x, y) = surface_points(turn.cam.follower, point.kinematics, point.angle)
    if way == "x":
        return "x [{0}], y [{0}]", factor * np.stack([x, y], axis=1)
    polar = np.mod(np.arctan2(y, x), math.tau)
    order = np.argsort(polar)
    degrees, radius = np.degrees(polar[order]), np.hypot(x, y)[order]
    return "angle [deg], radius [{0}]", np.stack([degrees, factor * radius], axis=1)


@pytest.mark.parametrize("way", ["x", "radius"])
@pytest.mark.parametrize(
    ("unit", "factor", "size", "right"), [("m", 1e3, "large", "mm"), ("mm", 1.0, "small", "m")]
)
def test_surface_in_another_unit_is_refused(tmp_path, way, unit, factor, size, right):
    head, rows = surface(way, factor)
    text = f"points.csv: column '{way}' is too {size} for the base circle: .* {right} as unit, not"
    with pytest.raises(ScenarioError, match=text):
        measured(tmp_path, head.format(unit), rows, "profile")


@pytest.mark.parametrize(
    ("head", "convert", "text"),
    [
        ("deg", np.radians, "the angles do not span a turn; their unit is probably rad, not deg"),
        ("rad", lambda v: v, "the angles do not span a turn; their unit is probably deg, not rad"),
    ],
)
@pytest.mark.parametrize("closed", [False, True])
def test_angles_in_another_unit_are_named(tmp_path, head, convert, text, closed):
    rows = lifts()
    rows = np.vstack([rows, [360.0, rows[0, 1]]]) if closed else rows
    rows[:, 0] = convert(rows[:, 0])
    with pytest.raises(ScenarioError, match=text):
        measured(tmp_path, f"angle [{head}], lift [mm]", rows)


def test_swing_of_an_arm_in_another_unit_is_refused(tmp_path):
    swing = read(SWINGING).cam.motion.lift(np.radians(DEGREES))[0]
    rows = np.stack([DEGREES, np.degrees(swing)], axis=1)
    (tmp_path / "points.csv").write_text(points("angle [deg], lift [rad]", rows))
    text = SWINGING.replace('shape = "eccentric"', 'lift = "points.csv"')
    text = "\n".join(line for line in text.splitlines() if not line.startswith("eccentricity"))
    with pytest.raises(ScenarioError, match=r"column 'lift' is too large for an arm: .* not rad"):
        read(text, tmp_path)


@pytest.mark.parametrize("digits", [2, 3, 4, 6])
@pytest.mark.parametrize("start", [0, 120])
def test_last_row_at_a_rounded_angle_closes_the_turn(tmp_path, digits, start):
    lift = np.roll(lifts()[:, 1], -start)  # begins within a dwell, or as the follower rises
    angle = np.round(np.radians(np.append(DEGREES, 360.0)), digits)
    rows = np.stack([angle, np.append(lift, lift[0])], axis=1)
    found = measured(tmp_path, "angle [rad], lift [mm]", rows).cam.motion
    fastest = np.abs(read(CYCLOIDAL).cam.motion.lift(np.radians(DEGREES))[1]).max()
    away = found.lift(np.radians(DEGREES))[0] - 1e-3 * lift
    assert np.abs(away).max() <= fastest * 0.5 * 10.0**-digits


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda rows: rows[:180], r"the angles do not span a turn, got 0 to 179 deg, expected"),
        (
            lambda rows: np.vstack([rows, rows[-1]]),
            r"line 362: column 'angle' must increase, got 359, expected more than 359",
        ),
        (lambda rows: np.vstack([rows, [360.0, 0.1]]), r"does not close: .* got 0 and 0\.1 mm"),
        (lambda rows: np.vstack([rows, [360.1, 0.1]]), r"does not close: .* got 0 and 0\.1 mm"),
    ],
    ids=["half", "repeated", "open", "open and rounded"],
)
def test_tables_that_are_no_turn_are_one_mistake(tmp_path, change, text):
    with pytest.raises(ScenarioError, match=text) as caught:
        measured(tmp_path, "angle [deg], lift [mm]", change(lifts()))
    assert len(caught.value.mistakes) == 1


def test_headers_without_units_are_expected_in_usual_ones(tmp_path):
    with pytest.raises(ScenarioError) as caught:
        measured(tmp_path, "angle, lift", lifts())
    for column in ("angle [deg]", "lift [mm]"):
        assert f"has no unit, got {column.split()[0]}, expected {column}" in str(caught.value)


def test_rise_in_another_unit_is_named():
    text = CYCLOIDAL.replace('rise = "8 mm"', 'rise = "8 m"').replace('"-8 mm"', '"-8 m"')
    with pytest.raises(ScenarioError) as caught:
        read(text)
    assert "[cam] motion: lifts the follower far beyond the base circle: the unit of a rise" in str(
        caught.value
    )
    assert f"up to 8000 mm with base_radius = {1e3 * BASE:g} mm" in str(caught.value)
