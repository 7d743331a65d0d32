"""Points on curves of a cam, its arcs, and the third derivative of its lift."""

from __future__ import annotations

import cmath
import math
from itertools import pairwise

import numpy as np
import pytest

from tests.mechanics.cam.cams import MM, rise_and_return
from wearsim.mechanics.cam import Follower, surface_points
from wearsim.mechanics.cam.outline import angles_by_chord, angles_by_number
from wearsim.mechanics.cam.shapes import Arc, three_arc_cam

TOLERANCE = 1e-6


def ellipse(angles: np.ndarray) -> np.ndarray:
    return np.array([30e-3 * np.cos(angles) + 10e-3j * np.sin(angles)])


def circle(angles: np.ndarray) -> np.ndarray:
    return np.array([20e-3 * np.exp(1j * angles)])


def distances(points, angles: np.ndarray) -> np.ndarray:
    """Return the greatest distance of the curve from each chord [m]."""
    found = []
    for low, high in pairwise(angles):
        (ends,) = points(np.array([low, high]))
        (between,) = points(np.linspace(low, high, 50))
        chord = ends[1] - ends[0]
        found.append(np.abs(((between - ends[0]) * np.conj(chord)).imag).max() / abs(chord))
    return np.array(found)


def test_chords_of_a_circle_have_the_length_of_the_tolerance() -> None:
    found = angles_by_chord(circle, 0.1, 2.0, TOLERANCE)
    assert (found[0], found[-1]) == (0.1, 2.0)
    least = 1.9 / (2.0 * math.acos(1.0 - TOLERANCE / 20e-3))  # by the sagitta
    assert len(found) - 1 == pytest.approx(least, abs=1.0)
    np.testing.assert_allclose(np.diff(found), 1.9 / (len(found) - 1), rtol=1e-6)
    assert distances(circle, found).max() <= TOLERANCE


def test_chords_are_short_where_a_curve_bends() -> None:
    found = angles_by_chord(ellipse, 0.0, math.pi, TOLERANCE)
    away = distances(ellipse, found)
    assert away.max() <= TOLERANCE
    assert away.min() > 0.6 * TOLERANCE
    both = angles_by_chord(lambda one: np.concatenate([ellipse(one), circle(one)]), 0.0, 1.0, 1e-7)
    assert max(distances(ellipse, both).max(), distances(circle, both).max()) <= 1e-7


def test_straight_line_is_one_chord() -> None:
    found = angles_by_chord(lambda angles: np.array([angles * (1e-3 + 2e-3j)]), 0.0, 1.0, TOLERANCE)
    assert found.tolist() == [0.0, 1.0]


def test_points_by_number_are_equally_spaced_over_all_parts() -> None:
    parts = [(circle, 0.0, 1.0), (lambda one: 2.0 * circle(one), 1.0, 1.5)]
    first, second = angles_by_number(parts, 8)  # of lengths 20 mm and 20 mm
    np.testing.assert_allclose(first, [0.0, 0.25, 0.5, 0.75], atol=1e-9)
    np.testing.assert_allclose(second, [1.0, 1.125, 1.25, 1.375], atol=1e-9)


def test_arcs_of_a_cam_touch_each_other() -> None:
    arcs = [one for one in three_arc_cam(20 * MM, 6 * MM, 22 * MM, 60 * MM) if isinstance(one, Arc)]
    assert [one.name for one in arcs] == ["nose", "flank", "base circle", "flank"]
    assert [one.radius for one in arcs] == [6 * MM, 60 * MM, 20 * MM, 60 * MM]
    for one, other in zip(arcs, [*arcs[1:], arcs[0]], strict=True):
        points = [complex(*each.centre) + each.radius * cmath.rect(1.0, one.end)
                  for each in (one, other)]  # fmt: skip
        assert points[0] == pytest.approx(points[1], abs=1e-15)
    with pytest.raises(ValueError, match="touches both"):
        three_arc_cam(20 * MM, 6 * MM, 22 * MM, 19 * MM)
    with pytest.raises(ValueError, match="touches both"):  # the nose is blunter than the flanks
        three_arc_cam(20 * MM, 61 * MM, 40 * MM, 60 * MM)
    with pytest.raises(ValueError, match="beyond"):
        three_arc_cam(20 * MM, 6 * MM, -22 * MM, 60 * MM)


FOLLOWERS = {
    "translating": Follower(20 * MM, 8 * MM, offset=4 * MM),
    "swinging": Follower(
        20 * MM, 8 * MM, kind="swinging", centre_distance=60 * MM, arm_length=50 * MM
    ),
    "swinging towards": Follower(
        20 * MM, 8 * MM, kind="swinging", centre_distance=60 * MM, arm_length=50 * MM, towards=True
    ),
}


@pytest.mark.parametrize("name", FOLLOWERS)
@pytest.mark.parametrize(("depth", "inner"), [(0.0, False), (0.2 * MM, False), (0.2 * MM, True)])
def test_surface_is_the_envelope_of_the_roller(name: str, depth: float, inner: bool) -> None:
    follower, theta = FOLLOWERS[name], np.linspace(0.2, 5.0, 7)
    height = 6 * MM if name == "translating" else 0.1

    def points(angles: np.ndarray) -> np.ndarray:
        waves = [0.5 * (1.0 - np.cos(angles)), 0.5 * np.sin(angles), 0.5 * np.cos(angles)]
        kinematics = follower.kinematics(height * np.stack(waves), inner)
        found = surface_points(follower, kinematics, angles, depth)
        return np.stack([one[0] + 1j * one[1] for one in found])

    centre, contact = points(theta)
    radius = 8 * MM - depth if inner else 8 * MM + depth
    np.testing.assert_allclose(np.abs(centre - contact), radius, rtol=1e-12)
    assert (np.abs(contact) > np.abs(centre)).all() == inner
    if not follower.swings:
        rest = math.sqrt((28 * MM) ** 2 - (4 * MM) ** 2)
        lift = height * 0.5 * (1.0 - np.cos(theta))
        np.testing.assert_allclose(np.abs(centre), np.hypot(rest + lift, 4 * MM), rtol=1e-12)
    else:
        pivots = centre * np.exp(-1j * theta)  # the arm about its pivot, as seen from the frame
        np.testing.assert_allclose(np.abs(pivots - 60 * MM), 50 * MM, rtol=1e-12)
    tangents = (points(theta + 1e-6) - points(theta - 1e-6)) / 2e-6
    for tangent in tangents:
        along = (tangent * np.conj(centre - contact)).real
        np.testing.assert_allclose(along, 0.0, atol=1e-6 * np.abs(tangent).max() * 8 * MM)


def test_jerk_is_the_slope_of_the_acceleration() -> None:
    motion = rise_and_return("cycloidal")
    theta = np.array([1.57081, 1.7, 2.0, 2.6, 3.14157, 5.0, 5.3, 0.4, 0.4 + math.tau])
    expected = (motion.lift(theta + 1e-5)[2] - motion.lift(theta - 1e-5)[2]) / 2e-5
    np.testing.assert_allclose(motion.jerk(theta), expected, rtol=1e-5, atol=1e-9)
    start = np.array([0.5 * math.pi])  # at a boundary that of the following part
    after = (motion.lift(start + 2e-5)[2] - motion.lift(start + 1e-5)[2]) / 1e-5
    np.testing.assert_allclose(motion.jerk(start), after, rtol=1e-3)
