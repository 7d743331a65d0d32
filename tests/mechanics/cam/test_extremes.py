"""Greatest value between the stations of a cam, its angle, and the errors of interpolation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.polynomial import Chebyshev

from wearsim.mechanics.cam import Panel, Stations, greatest, greatest_value, integral_error

HALVES = Panel(0, 0.0, 2.5, dwell=False), Panel(1, 2.5, 2.0 * math.pi, dwell=False)


def stations(number: int) -> Stations:
    return Stations(HALVES, (number, number))


def bump(theta: np.ndarray, place: float, width: float) -> np.ndarray:
    return 1.0 + np.exp(-(((theta - place) / width) ** 2))


@pytest.mark.parametrize("place", [0.7, 1.3, 3.9, 5.4])
@pytest.mark.parametrize("number", [5, 6, 7, 9, 13, 16])
def test_stated_errors_cover_those_of_the_interpolation(number, place):
    angles = stations(number).angle
    width = 1.2
    found = greatest(stations(number), bump(angles, place, width))
    error = abs(float(found.value) - 2.0)
    assert error <= found.error <= max(60.0 * error, 0.2)
    assert abs(found.angle - place) <= found.angle_error + 1e-4


def test_greatest_value_is_exact_with_many_stations():
    places = np.array([0.4, 1.1, 2.9, 5.2])
    values = bump(stations(25).angle[:, None], places, 0.8)
    found = greatest(stations(25), values)
    np.testing.assert_allclose(found.value, 2.0, rtol=2e-5)
    np.testing.assert_allclose(found.angle, places, atol=1e-3)
    assert (found.error < 1e-3).all()


def test_values_do_not_depend_on_others():
    values = bump(stations(9).angle[:, None], np.linspace(0.3, 5.0, 7), 0.9)
    together = greatest(stations(9), values)
    for number in range(7):
        alone = greatest(stations(9), values[:, [number]])
        for one, other in zip(alone, together, strict=True):
            assert one[0] == other[number]


def test_first_of_equal_values_is_returned():
    whole = Stations((Panel(0, 0.0, 2.0 * math.pi, dwell=False),), (13,))
    found = greatest(whole, np.sin(whole.angle) ** 2)
    assert found.angle == pytest.approx(0.5 * math.pi, abs=1e-3)
    assert found.angle_error < 0.1  # equal values are no error


def test_angle_is_unknown_where_another_maximum_is_as_great_within_the_error():
    angles = stations(7).angle
    values = bump(angles, 1.0, 0.5) + bump(angles, 5.0, 0.5) * (1.0 + 1e-6)
    found = greatest(stations(7), values)
    assert found.angle_error > 2.0 * math.pi - 4.1


def test_dwell_has_no_error_and_a_rise_with_one_station_is_unknown():
    panels = Panel(0, 0.0, 3.0, dwell=True), Panel(1, 3.0, 2.0 * math.pi, dwell=False)
    flat = greatest(Stations(panels, (1, 5)), np.ones(6))
    assert (flat.value, flat.error) == (1.0, 0.0)
    assert flat.angle_error == math.pi  # no angle has a greater value than another
    unknown = greatest(Stations(panels, (1, 1)), np.array([-1.0, 3.0]))
    assert unknown.error == 3.0
    assert unknown.angle_error == pytest.approx(0.5 * (2.0 * math.pi - 3.0))


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(("excess", "twin"), [(1e-10, True), (1e-7, False)])
def test_equal_panels_are_twins(scale: float, excess: float, twin: bool):
    half = Panel(0, 0.0, math.pi, dwell=False), Panel(1, math.pi, 2.0 * math.pi, dwell=False)
    values = bump(stations(6).angle[:6], 1.0, 0.8)
    found = greatest(Stations(half, (6, 6)), scale * np.append(values, values * (1.0 + excess)))
    assert (found.angle < math.pi) == twin
    assert (found.angle_error > 0.99 * math.pi) == (not twin)


def test_angle_of_a_dwell_is_uncertain_where_the_rise_beside_it_may_be_greater():
    panels = Panel(0, 0.0, 3.0, dwell=True), Panel(1, 3.0, 2.0 * math.pi, dwell=False)
    rise = np.array([2.0, 1.9, 1.2, 1.1])
    found = greatest(Stations(panels, (1, 4)), np.append(2.0, rise))
    assert found.angle_error > 1.0


@pytest.mark.parametrize("place", [0.7, 3.9])
@pytest.mark.parametrize("number", [3, 4, 5, 7, 9, 13])
def test_stated_error_of_an_integral_covers_the_true_one(number, place):
    exact = stations(60)
    integral = exact.weight @ bump(exact.angle, place, 1.2)
    few = stations(number)
    values = bump(few.angle, place, 1.2)
    error = abs(few.weight @ values - integral)
    assert error <= integral_error(few, values) <= max(300.0 * error, 2.0)


def of_panel(panel: Panel, curve: Chebyshev) -> tuple[float, float, float, float]:
    """Return greatest value, angle and both errors on a panel, x = -cos(phi) from -1 to 1."""
    width, number = panel.stop - panel.start, curve.degree() + 1
    slope = curve.deriv()
    roots = slope.roots()
    inside = roots[(np.abs(roots.imag) < 1e-9) & (np.abs(roots.real) < 1.0)].real
    ends = np.concatenate([[-1.0, 1.0], inside])
    x = ends[curve(ends).argmax()]
    value, phi, error = curve(x), math.acos(-x), np.abs(curve.coef[-2:]).sum()
    # the vertex lies where the curve is within twice the error
    count = 4 * (number - 1)
    samples = -np.cos(np.pi * np.arange(count + 1) / count)
    place = int(curve(samples).argmax())
    beside = samples[min(place + 1, count)] - samples[max(place - 1, 0)]
    apart = 0.5 * width * np.abs(samples - x)[curve(samples) >= value - 2.0 * error]
    moved = np.minimum(apart, math.tau - apart).max(initial=0.0) + 0.5 * width * beside
    # a slope of number times the error moves it by this over the second derivative
    bend = -(slope.deriv()(x) * (1.0 - x * x) - slope(x) * x)
    turned = number * error / bend
    by_slope = 0.5 * width * turned * max(abs(math.sin(phi)), 0.5 * turned)
    return value, panel.start + 0.5 * width * (1.0 + x), error, min(moved, by_slope, math.pi)


@pytest.mark.parametrize("seed", range(12))
def test_errors_are_those_of_the_last_coefficients_of_all_panels(seed: int) -> None:
    generator = np.random.default_rng(seed)
    panels = Panel(0, 0.4, 1.9, False), Panel(1, 1.9, 2.4, True), Panel(2, 2.4, 6.1, False)
    numbers, size = (6, 1, 8), (1.0, 0.02, 0.3)[seed % 3]
    curves = []
    for number in (6, 8):
        coefficients = generator.normal(size=number) / (1.0 + np.arange(number)) ** 2
        coefficients[-2:] *= size  # the last ones, which are the errors
        curves.append(Chebyshev(coefficients))
    level = max(curve.linspace(99)[1].max() for curve in curves) - 0.1 * generator.uniform()
    stations = Stations(panels, numbers)
    ends = [-np.cos(np.pi * np.arange(n) / (n - 1)) for n in (6, 8)]
    values = np.concatenate([curves[0](ends[0]), [level], curves[1](ends[1])])
    each = [
        of_panel(panels[0], curves[0]),
        (level, 2.15, 0.0, 0.0),
        of_panel(panels[2], curves[1]),
    ]
    largest, angle, own, own_angle = max(each)
    bound, away = own, own_angle
    for value, at, error, angle_error in each:
        if value < largest and value + error >= largest - own:
            bound = max(bound, value + error - largest)
            distance = min(abs(at - angle), math.tau - abs(at - angle))
            away = max(away, distance + angle_error)
    found = greatest(stations, values)
    assert (found.value, found.angle) == pytest.approx((largest, angle), abs=1e-6)
    assert found.error == pytest.approx(bound, abs=1e-9)
    assert found.angle_error == pytest.approx(min(away, math.pi), rel=1e-3)
    both = greatest_value(stations, np.column_stack([values, -values]))
    assert both[0] == found.value
    assert both[1] == greatest(stations, -values).value
