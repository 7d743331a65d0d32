"""Reference cams of `wearsim cam --at --json`, to all printed digits."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from cli_examples import SCENARIOS, Command

OMEGA = 1000.0 * math.tau / 60.0
SWINGING = (SCENARIOS / "cam-swinging.toml").read_text(encoding="utf-8")
ECCENTRIC = (SCENARIOS / "cam-eccentric.toml").read_text(encoding="utf-8")
CYCLOIDAL = (SCENARIOS / "cam-cycloidal.toml").read_text(encoding="utf-8")
TANGENT = (
    ECCENTRIC.replace('base_radius = "20 mm"', 'base_radius = "25 mm"')
    .replace('"eccentric"', '"tangent"')
    .replace('eccentricity = "5 mm"', 'nose_radius = "10 mm"\nnose_distance = "20 mm"')
    .replace('preload = "300 N"', 'preload = "3 kN"')
)
#: column, factor to the unit of the digits, and half a unit of the last digit
LIFT = [("lift_m", 1e3, 5e-7), ("lift_per_rad_m", 1e3, 5e-7), ("lift_per_rad2_m", 1e3, 5e-7)]
ROLLING = [("rolling_speed_m_per_s", 1.0, 5e-7), ("roller_speed_ratio", 1.0, 5e-7)]
PRESSURE_ANGLE = ("pressure_angle_rad", math.degrees(1.0), 5e-7)
LOAD = [("normal_force_N", 1.0, 5e-7), ("peak_pressure_Pa", 1e-6, 5e-4)]


def data(command: Command, text: str, at: str) -> dict:
    """Return the output of `wearsim cam` at angles."""
    Path("reference.toml").write_text(text, encoding="utf-8")
    done = command("cam", "reference.toml", "--at", at, "--json")
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def compare(stations: dict, columns: list, rows: list) -> None:
    """Compare columns of the stations with printed rows."""
    for place, row in enumerate(rows):
        for (name, factor, within), printed in zip(columns, row, strict=True):
            assert factor * stations[name][place] == pytest.approx(printed, abs=within), name


def test_concentric_cam(command: Command) -> None:
    text = (SCENARIOS / "cam-concentric.toml").read_text(encoding="utf-8")
    compare(data(command, text, "70 deg")["stations"], ROLLING, [(2.617994, 1.25)])


def test_eccentric_cam(command: Command) -> None:
    found = data(command, ECCENTRIC, "0 deg,60 deg,180 deg")
    rows = [
        (10.0, 0.0, -5.555556, 0.0, 2.908882, 1.5, 319.538258, 694.681),
        (7.291182, -4.571811, -2.222231, -5.521833, 2.764116, 1.375583, 325.782926, 699.177),
        (0.0, 0.0, 4.444444, 0.0, 2.327106, 1.0, 324.369394, 698.164),
    ]
    compare(found["stations"], [*LIFT, PRESSURE_ANGLE, *ROLLING, *LOAD], rows)
    assert found["stations"]["curvature_per_m"] == pytest.approx([40.0] * 3, rel=1e-9)
    assert found["load_integral_N_m"] == pytest.approx(51.0793039, abs=5e-8)
    assert found["perimeter_m"] == pytest.approx(0.05 * math.pi, rel=1e-9)


def test_tangent_cam(command: Command) -> None:
    start = 360.0 - math.degrees(math.acos((25.0 - 10.0) / 20.0))  # of the flank to the nose
    flank = math.degrees(math.atan(math.sqrt(20.0**2 - 15.0**2) / (25.0 + 20.0)))
    assert flank == pytest.approx(16.381879, abs=5e-7)
    angles = start + 10.0, start + flank - 1e-9, start + flank + 1e-9
    found = data(command, TANGENT, ",".join(f"{angle!r} deg" for angle in angles))
    stations = found["stations"]
    compare(stations, [LIFT[0], PRESSURE_ANGLE, ROLLING[0]], [(0.694198, 10.0, 4.858903)])
    assert stations["curvature_per_m"][0] == pytest.approx(0.0, abs=1e-9)
    columns = [LIFT[2], ("rolling_speed_m_per_s", 1e3 / OMEGA, 5e-7)]
    at_nose = {name: stations[name][1:] for name, *_ in columns}
    compare(at_nose, columns, [(55.011049, 48.888889), (-28.030971, 16.296296)])
    assert 1e3 * found["perimeter_m"] == pytest.approx(161.855118, abs=5e-7)


@pytest.mark.parametrize("rotation", ["away", "towards"])
def test_swinging_arm(command: Command, rotation: str) -> None:
    sign = 1.0 if rotation == "away" else -1.0
    text = SWINGING.replace('rotation = "away"', f'rotation = "{rotation}"')
    found = data(command, text, f"{60.0 * sign} deg")["stations"]
    columns = [
        ("lift_per_rad_rad", sign, 5e-10),
        ("lift_per_rad2_rad", 1.0, 5e-9),
        ("pressure_angle_rad", math.degrees(sign), 5e-7),
        ("rolling_speed_m_per_s", 1e3 / OMEGA, 5e-7),
        ("roller_speed_ratio", 1.0, 5e-7),
    ]
    compare(found, columns, [(0.002658663, -0.06981676, 5.979157, 27.787599, 1.500884)])
    rest = math.acos((90.0**2 + 80.0**2 - 40.0**2) / (2.0 * 90.0 * 80.0))
    position = math.degrees(rest + found["lift_rad"][0])
    assert position == pytest.approx(33.554410, abs=5e-7)


@pytest.mark.parametrize(
    ("law", "angle", "radius", "perimeter", "load"),
    [
        ("cycloidal", 11.774136, 17.569106, 183.451876, 59.8782867),
        ("polynomial-345", 11.059430, 18.615256, 183.393902, 59.6969723),
        ("modified-sine", 10.396203, 19.416907, 183.341052, 59.5680658),
    ],
)
def test_rise_and_return(
    command: Command, law: str, angle: float, radius: float, perimeter: float, load: float
) -> None:
    found = data(command, CYCLOIDAL.replace('"cycloidal"', f'"{law}"'), "135 deg")
    assert math.degrees(found["max_pressure_angle_rad"]) == pytest.approx(angle, abs=5e-7)
    assert 1e3 * found["min_radius_of_curvature_m"] == pytest.approx(radius, abs=5e-7)
    assert 1e3 * found["perimeter_m"] == pytest.approx(perimeter, abs=5e-7)
    assert found["load_integral_N_m"] == pytest.approx(load, abs=5e-8)
