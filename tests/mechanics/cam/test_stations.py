"""Stations along the angle of a cam, their weights and their choice."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from cams import MM, Motion, rise_and_return, segment, segments_of

from wearsim.mechanics.cam import Panel, Stations, choose_stations, extreme, motion_mistakes
from wearsim.mechanics.cam.stations import NUMBERS, interpolation, lobatto, moved_stations

WHOLE = Panel(0, 0.0, math.tau, dwell=False)


@pytest.mark.parametrize("number", [1, 2, 3, 7, 8, 13, 25, 500])
def test_weights_integrate_and_points_interpolate_polynomials(number):
    points, weights = lobatto(number)
    places = np.array([0.0, 0.123, 0.5, 1.0])
    for degree in range(min(number, 30)):
        assert weights @ points**degree == pytest.approx(1.0 / (degree + 1), rel=1e-13)
        values = interpolation(number, places) @ points**degree
        assert values == pytest.approx(places**degree, rel=1e-12, abs=1e-12)


def test_numbers_of_stations_are_nested():
    for few, many in itertools.pairwise(NUMBERS):
        assert lobatto(many)[0][::2] == pytest.approx(lobatto(few)[0], abs=1e-15)


def test_dwell_has_one_station_and_a_cycloidal_rise_thirteen():
    motion = rise_and_return("cycloidal")

    def lift(panels, theta):
        return 1.0 + motion.lift_in(segments_of(panels), theta)[:1] / MM

    stations = choose_stations(motion.panels, lift, 2.5e-4)
    assert stations.numbers == (1, 13, 1, 13)
    assert stations.weight.sum() == pytest.approx(math.tau, rel=1e-14)
    assert choose_stations(motion.panels, lift, 2.5e-4, 5).numbers == (1, 5, 1, 5)


def test_chosen_stations_represent_a_sharp_peak_within_the_tolerance():
    def peak(panels, theta):
        return np.exp(-(((theta - 1.0) / 0.1) ** 2))[None]

    stations = choose_stations([WHOLE], peak, 1e-4)
    angle, values = stations.values_at(peak([WHOLE], stations.angle)[0], 50)
    assert len(stations.panels) > 1
    assert values == pytest.approx(peak([WHOLE], angle)[0], abs=1e-4)
    integral = stations.weight @ peak([WHOLE], stations.angle)[0]
    assert integral == pytest.approx(0.1 * math.sqrt(math.pi), rel=1e-4)


def test_integral_converges_faster_than_any_power():
    errors = []
    for number in NUMBERS:
        stations = Stations((WHOLE,), (number,))
        errors.append(abs(stations.weight @ np.exp(np.cos(stations.angle)) - 7.954926521012846))
    assert errors[1] < 1e-2 * errors[0]
    assert errors[2] < 1e-4 * errors[1]


def test_extreme_is_found_to_round_off():
    value, angle = extreme([WHOLE], lambda panels, theta: np.sin(3.0 * theta) + 0.1 * theta)
    exact = (math.acos(-0.1 / 3.0) + 2.0 * math.tau) / 3.0
    assert value == pytest.approx(math.sin(3.0 * exact) + 0.1 * exact, rel=1e-14)
    assert angle == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize(
    ("parts", "place", "words"),
    [
        (
            [("dwell", 90.0), ("cycloidal", 90.0, 1.0), ("cycloidal", 170.0, -1.0)],
            2,
            "do not sum to a turn 350 deg 360 deg, with 180 deg for segment 3 (cycloidal)",
        ),
        (
            [("dwell", 180.0), ("cycloidal", 90.0, 2.0), ("cycloidal", 90.0, -1.5)],
            2,
            "return to its start 0.5 after segment 3 (cycloidal)",
        ),
        (
            [("dwell", 180.0), ("polynomial", 90.0, 1.0, {"start": ["1 m/rad"]})],
            0,
            "jumps before segment 2 (polynomial) from 0 to 1 per rad",
        ),
    ],
)
def test_mistakes_of_a_motion_name_the_segment(parts, place, words):
    segments = []
    for law, degrees, *more in parts:
        options = more[1] if len(more) > 1 else {}
        segments.append(segment(law, degrees, more[0] if more else 0.0, **options))
    mistakes = motion_mistakes(segments, "{:.4g}".format)
    found = {number: " ".join(map(str, rest)) for number, *rest in reversed(mistakes)}
    assert words in found[place]


def test_motion_at_a_boundary_is_that_of_the_following_segment():
    motion = rise_and_return("harmonic")
    assert motion.segment_at(
        np.radians([0.0, 90.0, 180.0, 270.0, 360.0, -90.0, -1e-13])
    ).tolist() == [*(0, 1, 2, 3, 0, 3, 0)]
    second = motion.lift(np.radians([90.0, 89.999]))[2]
    assert second[0] > 0.0
    assert second[1] == 0.0
    assert isinstance(motion, Motion)


THREE = (
    Panel(0, 0.0, 1.0, dwell=True),
    Panel(1, 1.0, 2.5, dwell=False),
    Panel(2, 2.5, math.tau, dwell=False),
)


def polynomial(panel: Panel, angle: np.ndarray) -> np.ndarray:
    """Return values and a second column that are polynomials on each panel."""
    one = 1.0 + panel.segment + panel.segment * (angle - 2.0) ** 3
    return np.column_stack([one, panel.segment * angle**2])


def on_stations(stations: Stations) -> np.ndarray:
    each = zip(stations.panels, stations.numbers, stations.first, strict=True)
    return np.concatenate(
        [polynomial(panel, stations.angle[first : first + n]) for panel, n, first in each]
    )


def test_values_at_angles_are_those_of_the_polynomials():
    stations = Stations(THREE, (1, 5, 7))
    assert stations.first.tolist() == [0, 1, 6]
    assert stations.panel.tolist() == [0] + [1] * 5 + [2] * 7
    assert stations.count == 13
    assert [(p.tolist(), s.tolist()) for p, s in stations.groups] == [
        ([0], [[0]]),
        ([1], [[1, 2, 3, 4, 5]]),
        ([2], [[6, 7, 8, 9, 10, 11, 12]]),
    ]
    values = on_stations(stations)
    angles = np.array([0.0, 0.7, 1.0, 1.3, 2.2, 2.5, 4.0, 6.0, math.tau])
    known = np.concatenate(
        [
            polynomial(THREE[k], angles[part])
            for k, part in enumerate((slice(0, 2), slice(2, 5), slice(5, 9)))
        ]
    )
    assert stations.values_at_angles(values, angles) == pytest.approx(known, rel=1e-12)
    few = angles[[1, 6]]
    assert stations.values_at_angles(values, few) == pytest.approx(known[[1, 6]], rel=1e-12)
    at, between = stations.values_at(values, 3)
    assert at == pytest.approx(
        [0.0, 0.5, 1.0, 1.0, 1.75, 2.5, 2.5, 0.5 * (2.5 + math.tau), math.tau]
    )
    assert between[3:6] == pytest.approx(polynomial(THREE[1], at[3:6]))


def test_moved_stations_keep_polynomials_and_equal_panels():
    old = Stations(THREE, (1, 5, 7))
    halves = THREE[2]._replace(stop=4.0), THREE[2]._replace(start=4.0)
    new = Stations((THREE[0], THREE[1], *halves), (1, 4, 5, 6))
    matrix, old_part, new_part = moved_stations(old, new)
    assert matrix.shape == (16, 13)
    assert matrix @ on_stations(old) == pytest.approx(on_stations(new), rel=1e-11, abs=1e-11)
    assert matrix[0].tolist() == [1.0] + [0.0] * 12
    # edges at 0, 1 and 2.5 are common; the first panel is equal
    assert old_part.tolist() == [-1] + [2] * 5 + [3] * 7
    assert new_part.tolist() == [-1] + [2] * 4 + [3] * 11
    same, parts, others = moved_stations(old, old)
    assert (same == np.eye(13)).all()
    assert set(parts) == set(others) == {-1}


def test_choice_halves_panels_and_is_scaled_by_the_whole_turn():
    def quantities(panels, theta):
        return np.stack([np.abs(np.sin(theta - 1.0)), 1e-9 * np.sin(40.0 * theta) + 1.0])

    stations = choose_stations([WHOLE], quantities, 1e-3)
    assert stations.weight.sum() == pytest.approx(math.tau)
    starts = [panel.start for panel in stations.panels]
    assert starts == sorted(starts)
    assert all(n in NUMBERS for n in stations.numbers)
    angle, values = stations.values_at(quantities([WHOLE], stations.angle)[0], 30)
    away = np.abs(values - np.abs(np.sin(angle - 1.0)))
    # the kinks are in panels that were halved six times
    width = min(panel.stop - panel.start for panel in stations.panels)
    assert width == pytest.approx(math.tau / 64.0)
    sizes = np.array([panel.stop - panel.start for panel in stations.panels])
    assert max(np.array(stations.numbers)[sizes < 1.5 * width]) == 25
    smooth = np.abs(np.sin(angle - 1.0)) > math.sin(width)
    assert away[smooth].max() < 1e-3
    # the greatest value, at the end of the turn, is the scale
    grows = [
        choose_stations([WHOLE], lambda _, theta, size=size: size * np.exp(1.5 * theta)[None], 1e-6)
        for size in (1e-4, 1.0, 1e4)
    ]
    whole = {}
    places = np.linspace(0.0, 1.0, 193)
    for count in NUMBERS:
        values = np.exp(1.5 * math.tau * (lobatto(count)[0] - 1.0))
        exact = np.exp(1.5 * math.tau * (places - 1.0))
        whole[count] = np.abs(interpolation(count, places) @ values - exact).max()
    least = next(count for count in NUMBERS if whole[count] <= 1e-6)
    assert [one.numbers for one in grows] == [(least,)] * 3
    many = choose_stations([WHOLE], lambda panels, theta: np.sin(theta)[None], 1e-3)
    assert many.numbers == (13,)


def test_extreme_of_equal_values_is_the_first():
    halves = Panel(0, 0.0, math.pi, dwell=False), Panel(1, math.pi, math.tau, dwell=False)

    def quantity(panels, theta):  # the same value in both, but for its rounding error
        return np.sin(theta) ** 2 * (1.0 + segments_of(panels) * 1e-15)

    value, angle = extreme(halves, quantity)
    assert value == pytest.approx(1.0, rel=1e-14)
    assert angle == pytest.approx(0.5 * math.pi, abs=1e-6)


def test_extreme_skips_values_that_are_not_defined():
    def quantity(panels, theta):
        return np.where(theta > 3.0, np.nan, theta)

    value, angle = extreme([WHOLE], quantity)
    assert value == angle
    assert value == pytest.approx(3.0, abs=1e-9)
