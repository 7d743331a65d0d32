"""Points, errors and motions of cams against circles, polynomials and numerical derivatives."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from cams import MM, random_follower, rise_and_return, segment
from numpy.polynomial import chebyshev

from wearsim.mechanics.cam import (
    Follower,
    Motion,
    Panel,
    Stations,
    greatest,
    integral_error,
    motion_mistakes,
    shape_motion,
    tangent_cam,
)
from wearsim.mechanics.cam.outline import angles_by_chord, angles_by_number
from wearsim.mechanics.cam.stations import lobatto


def circle(radius: float):
    return lambda theta: radius * np.exp(1j * np.asarray(theta))[None]


def sagitta(points, angles: np.ndarray) -> np.ndarray:
    """Return the greatest distance of the first curve from each chord, from many points."""
    found = []
    for low, high in itertools.pairwise(angles):
        curve = points(np.linspace(low, high, 101))[0]
        chord = curve[-1] - curve[0]
        found.append(np.abs(((curve - curve[0]) * chord.conjugate()).imag).max() / abs(chord))
    return np.array(found)


@pytest.mark.parametrize(("radius", "tolerance"), [(30.0, 1e-3), (5.0, 0.02)])
def test_chords_of_a_circle_are_as_few_as_the_tolerance_permits(
    radius: float, tolerance: float
) -> None:
    start, stop = 0.4, 3.1
    found = angles_by_chord(circle(radius), start, stop, tolerance)
    assert (found[0], found[-1]) == (start, stop)
    assert sagitta(circle(radius), found).max() <= tolerance
    least = math.ceil((stop - start) / (2.0 * math.acos(1.0 - tolerance / radius)))
    assert least <= len(found) - 1 <= least + 2
    assert np.diff(found) == pytest.approx(np.full(len(found) - 1, np.diff(found).mean()), rel=1e-3)
    # of two curves the one that needs more chords decides
    both = angles_by_chord(
        lambda theta: np.vstack([circle(0.1 * radius)(theta), circle(radius)(theta)]),
        *(start, stop, tolerance),
    )
    assert both == pytest.approx(found)


def test_chords_of_an_ellipse_are_about_equally_far_from_it() -> None:
    def ellipse(theta):
        return (30.0 * np.cos(theta) + 3.0j * np.sin(theta))[None]

    found = angles_by_chord(ellipse, 0.0, math.pi, 1e-3)
    away = sagitta(ellipse, found)
    assert away.max() <= 1e-3
    assert away.min() > 4e-4
    line = angles_by_chord(lambda theta: np.asarray(theta)[None] * (1.0 + 2.0j), 0.0, 2.0, 1e-6)
    assert line.tolist() == [0.0, 2.0]


def test_points_by_number_are_equally_spaced_along_all_parts() -> None:
    # arcs of the lengths 3 and 2
    parts = [(circle(3.0), 0.0, 1.0), (circle(0.5), 1.0, 5.0)]
    first, second = angles_by_number(parts, 9)
    along = 5.0 * np.arange(9) / 9.0
    assert first == pytest.approx(along[:6] / 3.0, abs=1e-5)
    assert second == pytest.approx(1.0 + (along[6:] - 3.0) / 0.5, abs=1e-5)


PANELS = Panel(0, 0.7, 1.7, False), Panel(1, 1.7, 2.0, True), Panel(2, 2.0, 4.5, False)


def test_error_of_an_integral_is_that_of_its_last_coefficients() -> None:
    stations = Stations(PANELS, (5, 1, 2))
    places = 2.0 * lobatto(5)[0] - 1.0
    first = chebyshev.chebval(places, [1.0, 0.5, -0.2, 0.3, -0.7])
    values = np.concatenate([first, [9.0], [0.4, -2.0]])
    # n - 2 is 3; two stations say nothing of what is between them, and a dwell has no error
    known = 1.0 * (0.3 + 0.7) / 9.0 + 2.5 * 2.0
    assert integral_error(stations, values) == pytest.approx(known)
    both = integral_error(stations, np.column_stack([values, 2.0 * values]))
    assert both == pytest.approx([known, 2.0 * known])
    still = Stations((PANELS[1],) * 2, (1, 1))
    assert integral_error(still, np.ones((2, 3))).tolist() == [0.0] * 3


def test_greatest_value_is_that_of_the_polynomial() -> None:
    stations = Stations(PANELS, (7, 1, 9))
    peaks = []
    for shift in (0.0, 3.0):
        polynomials = [[0.0, 1.0, -2.0, 0.1], [0.3 + shift, -0.2, -1.0, 0.2]]
        values = [
            chebyshev.chebval(2.0 * lobatto(n)[0] - 1.0, c)
            for n, c in zip((7, 9), polynomials, strict=True)
        ]
        found = greatest(stations, np.concatenate([values[0], [0.1], values[1]]))
        best = []
        for panel, coefficients in zip((PANELS[0], PANELS[2]), polynomials, strict=True):
            x = np.linspace(-1.0, 1.0, 200_001)
            curve = chebyshev.chebval(x, coefficients)
            angle = panel.start + 0.5 * (x[curve.argmax()] + 1.0) * (panel.stop - panel.start)
            best.append((curve.max(), angle))
        value, angle = max(best)
        assert found.value == pytest.approx(value, abs=1e-9)
        assert found.angle == pytest.approx(angle, abs=1e-4)
        assert found.error == pytest.approx(0.0, abs=1e-12)
        small = greatest(stations, 1e-9 * np.concatenate([values[0], [0.1], values[1]]))
        assert (small.value, small.angle) == pytest.approx((1e-9 * value, angle), abs=1e-4)
        assert small.value == pytest.approx(1e-9 * value, rel=1e-6, abs=0.0)
        peaks.append(float(found.angle))
    assert peaks[0] < PANELS[1].start
    assert peaks[1] > PANELS[1].stop


@pytest.mark.parametrize("kind", ["translating", "swinging"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_rest_is_where_the_roller_touches_the_base_circle(kind: str, seed: int) -> None:
    follower = random_follower(np.random.default_rng(seed), kind)
    if kind == "translating":
        centre = complex(follower.offset, follower.rest)
        assert follower.lever == 1.0
    else:
        pivot = follower.centre_distance
        centre = pivot - follower.arm_length * np.exp(1j * follower.rest)
        assert follower.lever == follower.arm_length
    assert abs(centre) == pytest.approx(follower.base_radius + follower.roller_radius)
    kinematics = follower.kinematics(np.zeros((3, 1)))
    force = follower.normal_force(kinematics, np.array([12.0]))
    both = follower.kinematics(np.zeros(3), np.array([False, True]))
    assert {np.shape(value) for value in vars(both).values()} == {(2,)}
    known = 12.0 / follower.lever / math.cos(kinematics.pressure_angle[0])
    assert force == pytest.approx([known])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"offset": 30.0 * MM}, "an offset of 30 mm does not reach the pitch circle"),
        (
            {"kind": "swinging", "centre_distance": 90.0 * MM, "arm_length": 60.0 * MM},
            "an arm of 60 mm at 90 mm does not reach the pitch circle, whose radius is 30 mm",
        ),
        (
            {"kind": "swinging", "centre_distance": 10.0 * MM, "arm_length": 20.0 * MM},
            "an arm of 20 mm at 10 mm does not reach",
        ),
    ],
)
def test_follower_that_does_not_reach_the_cam_is_refused(options: dict, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        Follower(20.0 * MM, 10.0 * MM, **options)


def test_jerk_is_the_third_derivative_on_each_side_of_a_boundary() -> None:
    motion = rise_and_return("cycloidal")
    rise, angle = 8.0 * MM, 0.5 * math.pi
    theta = np.array([0.3, 0.5 * math.pi, 0.5 * math.pi + 0.4, math.pi - 1e-4, math.pi, 5.0, -1.0])

    def jerk(along: float) -> float:  # of rise (x - sin(2 pi x)/(2 pi)), x = along/angle
        return rise * (math.tau / angle) ** 2 / angle * math.cos(math.tau * along / angle)

    known = [0.0, jerk(0.0), jerk(0.4), jerk(angle - 1e-4), 0.0]
    known += [-jerk(5.0 - 1.5 * math.pi), -jerk(math.tau - 1.0 - 1.5 * math.pi)]
    assert motion.jerk(theta) == pytest.approx(known, rel=1e-4, abs=1e-6)
    assert motion.bases == pytest.approx([0.0, 0.0, rise, rise, 0.0], abs=1e-12)
    raised = Motion(motion.segments, 5.0 * MM)
    assert raised.lift(np.array([0.1, 3.5]))[0] == pytest.approx([5.0 * MM, 13.0 * MM])
    assert motion.segment_label(1) == "segment 2 (cycloidal)"


def test_panels_end_at_the_breaks_of_a_motion_law() -> None:
    part = segment("cycloidal", 360.0, 1.0 * MM)
    motion = Motion((replace(part, breaks=(1.0, 2.5)),))
    found = [[panel.start, panel.stop] for panel in motion.panels]
    assert np.array(found) == pytest.approx(np.array([[0.0, 1.0], [1.0, 2.5], [2.5, math.tau]]))


@pytest.mark.parametrize(("base", "nose", "distance"), [(20.0, 5.0, 10.0), (5.0, 20.0, 15.0)])
def test_nose_without_a_common_tangent_is_refused(
    base: float, nose: float, distance: float
) -> None:
    with pytest.raises(ValueError, match="the nose is within the base circle"):
        tangent_cam(base, nose, distance)
    with pytest.raises(ValueError, match="the nose is within the base circle"):
        tangent_cam(distance + nose, nose, distance)


SLIDER = Follower(25.0 * MM, 20.0 * MM, offset=7.0 * MM)
ARM = Follower(25.0 * MM, 20.0 * MM, "swinging", centre_distance=90.0 * MM, arm_length=50.0 * MM)
TANGENT = tangent_cam(25.0 * MM, 10.0 * MM, 20.0 * MM)


@pytest.mark.parametrize(
    ("profile", "follower", "words"),
    [
        (TANGENT[1:2] * 2 + TANGENT[2:], SLIDER, "two straight parts of a cam meet at a corner"),
        (TANGENT[::-1], SLIDER, "do not follow one another"),
        (TANGENT[::-1], ARM, "do not follow one another"),
        (tangent_cam(25.0 * MM, 10.0 * MM, 0.2), ARM, "the arm does not reach the cam"),
    ],
)
def test_profile_that_a_follower_cannot_follow_is_refused(profile, follower, words) -> None:
    with pytest.raises(ValueError, match=words):
        shape_motion(profile, follower)


@pytest.mark.parametrize("follower", [SLIDER, ARM, replace(ARM, towards=True)])
def test_nose_points_along_the_motion_at_the_start_of_a_turn(follower: Follower) -> None:
    motion = shape_motion(TANGENT, follower)
    assert [part.name for part in motion.segments] == [
        *("nose", "flank", "base circle", "flank", "nose")
    ]
    assert motion.starts[-1] == math.tau
    # the roller touches the nose at its centre's distance of 30 mm from (20 mm, 0)
    position = follower.rest + motion.lift(np.zeros(1))[0, 0]
    if follower.swings:  # seen from the axis, the pivot is on x
        centre = 90.0 * MM - 50.0 * MM * np.exp(-1j * position)
        assert abs(centre - 20.0 * MM) == pytest.approx(30.0 * MM)
    else:
        assert abs(complex(7.0 * MM, position) - 20.0j * MM) == pytest.approx(30.0 * MM)


@pytest.mark.parametrize("law", ["cycloidal", "harmonic"])
def test_motion_that_returns_has_no_mistakes(law: str) -> None:
    assert motion_mistakes(rise_and_return(law).segments, str) == []
