"""Numbers of figures and tables: units, patch edges and measured profiles."""

import math

import numpy as np
import pytest

from wearsim.report.text import brief, by_roller, count, lapse, shown
from wearsim.studies.contact.outline import patch_edges


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (48.104e-6, "um", "48.10 um"),
        (680.22e6, "MPa", "680.2 MPa"),
        (27000.0, "min", "450.0 min"),
        (0.0, "N", "0 N"),
        (-28.224, "N", "-28.22 N"),
        (9999.6, "J", "10000 J"),
        (0.32541, "%", "32.54 %"),
        (1e-3, "1", "0.001000"),
        (1e-9, "um", "0.001000 um"),
        (3e-12, "um", "3.000e-06 um"),
        (None, "um", "-"),
        (math.nan, "um", "-"),
    ],
)
def test_values_are_shown_in_engineering_units(value: float | None, unit: str, text: str) -> None:
    assert shown(value, unit) == text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.05, "0.05 s"), (3.21, "3.2 s"), (9.97, "10 s"), (59.7, "1 min 0 s"), (7500.0, "2 h 5 min")],
)
def test_wall_times_have_a_suitable_unit(seconds: float, text: str) -> None:
    assert lapse(seconds) == text


def test_thousands_of_passes_are_separated() -> None:
    assert count(1.35e6) == "1,350,000"


@pytest.mark.parametrize("strips", [24, 51, 101])
def test_edges_of_an_ellipse_are_within_a_fifth_of_a_strip(strips: int) -> None:
    y = np.linspace(-2.0, 2.0, strips)
    a = 0.1 * np.sqrt(np.maximum(0.0, 1.0 - ((y - 0.3) / 1.4) ** 2))
    edges = patch_edges(y, a)
    assert edges == pytest.approx((-1.1, 1.7), abs=0.2 * (y[1] - y[0]))


def test_no_contact_has_no_edges() -> None:
    assert patch_edges(np.linspace(0.0, 1.0, 5), np.zeros(5)) is None


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(2.5e-6, "2.5 us"), (0.0312, "31.2 ms"), (1.5, "1.5 s"), (84.0, "84 s"), (np.nan, "-")],
)
def test_short_times_have_a_suitable_unit(seconds, text):
    assert brief(seconds) == text


@pytest.mark.parametrize(
    ("values", "unit", "text"),
    [
        ([0.25, 0.5], "1", "0.2500 / 0.5000"),
        ([0.25, 0.25], "1", "0.2500"),
        ([2.5e-4, 5e-4], "um", "250.0 / 500.0 um"),
        ([2.5e-4, 2.5e-4], "um", "250.0 um"),
        ([np.nan, 5e-4], "um", "- / 500.0 um"),
    ],
)
def test_values_of_rollers_have_one_unit_and_plain_numbers_none(values, unit, text):
    assert by_roller(values, unit) == text
