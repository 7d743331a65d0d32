"""Kinematics and loads of reference cams, to all printed digits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from cams import MM, OMEGA, ROLLER, rise_and_return, segments_of

from wearsim.mechanics.cam import (
    Arc,
    Follower,
    choose_stations,
    eccentric_cam,
    extreme,
    shape_motion,
    tangent_cam,
    three_arc_cam,
)
from wearsim.mechanics.hertz.ellipse import hertz

PRELOAD, STIFFNESS, MASS = 300.0, 5000.0, 0.5
STEEL = 200e9 / (2.0 * (1.0 - 0.3**2))


def force_of(follower, found):
    effort = PRELOAD + STIFFNESS * found.lift + MASS * OMEGA**2 * found.lift_per_rad2
    return follower.normal_force(found, effort)


def kinematics_in(follower, motion):
    return lambda panels, theta: follower.kinematics(motion.lift_in(segments_of(panels), theta))


def integral(follower, motion, quantity):
    at = kinematics_in(follower, motion)
    stations = choose_stations(motion.panels, lambda p, x: quantity(at(p, x))[None], 1e-10)
    panels = zip(stations.panels, stations.numbers, stations.first, strict=True)
    return sum(
        (stations.weight[i : i + n] * quantity(at([p], stations.angle[None, i : i + n]))).sum()
        for p, n, i in panels
    )


def test_concentric_cam():
    follower = Follower(25.0 * MM, ROLLER)
    found = follower.kinematics(np.zeros(3))
    assert OMEGA * found.travel == pytest.approx(2.617994, abs=5e-7)
    assert found.spin == pytest.approx(1.25, rel=1e-15)
    assert found.relative_curvature == pytest.approx(90.0, rel=1e-14)


ECCENTRIC = [
    (0, 10.0, 0.0, -5.555556, 0.0, 2.908882, 1.5, 319.538258, 694.681),
    (60, 7.291182, -4.571811, -2.222231, -5.521833, 2.764116, 1.375583, 325.782926, 699.177),
    (180, 0.0, 0.0, 4.444444, 0.0, 2.327106, 1.0, 324.369394, 698.164),
]


@pytest.mark.parametrize("row", ECCENTRIC)
def test_eccentric_cam(row):
    follower = Follower(20.0 * MM, ROLLER)
    motion = shape_motion(eccentric_cam(20.0 * MM, 5.0 * MM), follower)
    found = follower.kinematics(motion.lift(np.radians([row[0]])))
    normal = force_of(follower, found)
    peak = hertz(0.5 * found.relative_curvature[0], 1.0, normal[0], STEEL).peak_pressure
    lift = np.stack([found.lift, found.lift_per_rad, found.lift_per_rad2])[:, 0] / MM
    assert lift == pytest.approx(row[1:4], abs=5e-7)
    assert 1.0 / found.curvature[0] == pytest.approx(25.0 * MM, rel=1e-12)
    got = np.degrees(found.pressure_angle[0]), OMEGA * found.travel[0], found.spin[0], normal[0]
    assert got == pytest.approx(row[4:8], abs=5e-7)
    assert peak / 1e6 == pytest.approx(row[8], abs=5e-4)


def test_integrals_of_the_eccentric_cam():
    follower = Follower(20.0 * MM, ROLLER)
    motion = shape_motion(eccentric_cam(20.0 * MM, 5.0 * MM), follower)
    load = integral(follower, motion, lambda k: force_of(follower, k) * k.travel)
    assert load == pytest.approx(51.0793039, abs=5e-8)
    assert integral(follower, motion, lambda k: k.travel) == pytest.approx(0.05 * math.pi)

    def torque(k):
        return force_of(follower, k) * np.cos(k.pressure_angle) * k.lift_per_rad

    assert abs(integral(follower, motion, torque)) < 1e-9


def test_tangent_cam():
    follower = Follower(25.0 * MM, ROLLER)
    motion = shape_motion(tangent_cam(25.0 * MM, 10.0 * MM, 20.0 * MM), follower)
    assert [part.name for part in motion.segments] == [
        *("nose", "flank", "base circle", "flank", "nose")
    ]
    assert motion.segments[2].dwell
    flank = motion.segments[3]
    found = follower.kinematics(motion.lift_in(3, motion.starts[3:4] + math.radians(10.0)))
    assert found.lift[0] / MM == pytest.approx(0.694198, abs=5e-7)
    assert found.curvature[0] == pytest.approx(0.0, abs=1e-10)
    assert found.pressure_angle[0] == pytest.approx(math.radians(10.0))
    assert OMEGA * found.travel[0] == pytest.approx(4.858903, abs=5e-7)
    assert math.degrees(flank.angle) == pytest.approx(16.381879, abs=5e-7)
    for segment, second, travel in ((3, 55.011049, 48.888889), (4, -28.030971, 16.296296)):
        found = follower.kinematics(motion.lift_in(segment, motion.starts[4:5]))
        assert found.lift_per_rad2[0] / MM == pytest.approx(second, abs=5e-7)
        assert found.travel[0] / MM == pytest.approx(travel, abs=5e-7)
    perimeter = integral(follower, motion, lambda k: k.travel)
    assert perimeter / MM == pytest.approx(161.855118, abs=5e-7)


def test_involute_cam_has_no_pressure_angle():
    follower = Follower(20.0 * MM, ROLLER, offset=6.0 * MM)
    found = follower.kinematics(np.array([6.0 * MM * math.pi / 6.0, 6.0 * MM, 0.0]))
    assert found.pressure_angle == 0.0
    assert 1.0 / found.pitch_curvature / MM == pytest.approx(42.689033, abs=5e-7)
    assert OMEGA * found.travel == pytest.approx(2.375990, abs=5e-7)
    assert found.spin == pytest.approx(1.134452, abs=5e-7)


@pytest.mark.parametrize("towards", [False, True], ids=["away", "towards"])
def test_swinging_arm_on_the_eccentric_cam(towards):
    follower = Follower(
        20.0 * MM,
        ROLLER,
        "swinging",
        centre_distance=90.0 * MM,
        arm_length=80.0 * MM,
        towards=towards,
    )
    motion = shape_motion(eccentric_cam(20.0 * MM, 5.0 * MM), follower)
    theta = np.radians([-60.0 if towards else 60.0])
    found = follower.kinematics(motion.lift(theta))
    sign = -1.0 if towards else 1.0
    assert math.degrees(follower.rest + found.lift[0]) == pytest.approx(33.554410, abs=5e-7)
    assert sign * found.lift_per_rad[0] == pytest.approx(0.002658663, abs=5e-10)
    assert found.lift_per_rad2[0] == pytest.approx(-0.06981676, abs=5e-9)
    assert sign * math.degrees(found.pressure_angle[0]) == pytest.approx(5.979157, abs=5e-7)
    assert found.travel[0] / MM == pytest.approx(27.787599, abs=5e-7)
    assert found.spin[0] == pytest.approx(1.500884, abs=5e-7)
    assert found.spin[0] - sign * found.lift_per_rad[0] == pytest.approx(1.498225, abs=5e-7)
    assert 1.0 / found.pitch_curvature[0] == pytest.approx(45.0 * MM)


LAWS = [
    ("cycloidal", 11.774136, 17.569106, 183.451876, 59.8782867),
    ("polynomial-345", 11.059430, 18.615256, 183.393902, 59.6969723),
    ("modified-sine", 10.396203, 19.416907, 183.341052, 59.5680658),
]


@pytest.mark.parametrize(("law", "angle", "radius", "perimeter", "load"), LAWS)
def test_dwell_rise_dwell_return(law, angle, radius, perimeter, load):
    follower, motion = Follower(25.0 * MM, ROLLER), rise_and_return(law)
    at = kinematics_in(follower, motion)
    steepest, _ = extreme(motion.panels, lambda p, x: np.abs(at(p, x).pressure_angle))
    sharpest, _ = extreme(motion.panels, lambda p, x: at(p, x).curvature)
    assert math.degrees(steepest) == pytest.approx(angle, abs=5e-7)
    assert 1.0 / sharpest / MM == pytest.approx(radius, abs=5e-7)
    length = integral(follower, motion, lambda k: k.travel)
    assert length / MM == pytest.approx(perimeter, abs=5e-7)
    found = integral(follower, motion, lambda k: force_of(follower, k) * k.travel)
    assert found == pytest.approx(load, abs=5e-8)


def three_arcs():
    return three_arc_cam(25.0 * MM, 8.0 * MM, 24.0 * MM, 80.0 * MM)


@pytest.mark.parametrize("profile", [three_arcs(), tangent_cam(25.0 * MM, 10.0 * MM, 20.0 * MM)])
@pytest.mark.parametrize(
    "follower",
    [
        Follower(25.0 * MM, ROLLER, offset=7.0 * MM),
        *(
            Follower(
                25.0 * MM,
                ROLLER,
                "swinging",
                centre_distance=90.0 * MM,
                arm_length=80.0 * MM,
                towards=towards,
            )
            for towards in (False, True)
        ),
    ],
    ids=["offset", "away", "towards"],
)
def test_motion_on_arcs_and_lines_is_continuous_and_has_their_curvature(profile, follower):
    motion = shape_motion(profile, follower)
    radii = {part.name: part.radius for part in profile if isinstance(part, Arc)}
    for number, part in enumerate(motion.segments):
        theta = np.linspace(*motion.starts[number : number + 2], 41)
        found = follower.kinematics(motion.lift_in(number, theta))
        expected = 1.0 / radii[part.name] if part.name in radii else 0.0
        assert found.curvature == pytest.approx(expected, rel=1e-9, abs=1e-8)
        after = (number + 1) % len(motion.segments)
        start = motion.lift_in(after, motion.starts[after : after + 1])[:2, 0]
        assert motion.lift_in(number, theta)[:2, -1] == pytest.approx(start, abs=1e-12)
