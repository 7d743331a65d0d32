"""Texts on lives and times: as many digits as the intervals support, and units to read."""

import pytest

from wearsim.report.text import rounded_lives, simulated
from wearsim.units import in_engineers_unit


@pytest.mark.parametrize(
    ("lives", "texts"),
    [
        ((1_120_345.0, 1_234_567.0, 1_361_203.0), ["1,120,000", "1,230,000", "1,360,000"]),
        ((1_234_560.0, 1_234_567.0, 1_234_575.0), ["1,234,560", "1,234,570", "1,234,580"]),
        ((1_234_567.0, 1_234_567.0, 1_234_567.0), ["1,234,570"] * 3),
        ((412.3, 427.8, 440.1), ["412", "428", "440"]),
        ((float("-inf"), 1_234_567.0, float("inf")), ["-", "1,234,570", "-"]),
        ((0.0, 0.0, 0.0), ["0"] * 3),
    ],
)
def test_lives_have_the_digits_that_their_range_supports(lives, texts):
    assert rounded_lives(*lives) == texts


def test_long_tests_are_stated_in_hours():
    assert simulated(27_000.0) == "450.0 min"
    assert simulated(44_440.0 * 60.0) == "740.7 h"
    assert in_engineers_unit(44_440.0 * 60.0, "s", 4) == "740.7 h"


def test_torques_are_stated_in_the_unit_of_their_size():
    assert in_engineers_unit(24.0, "N m") == "24 N m"
    assert in_engineers_unit(0.01, "N m") == "10 N mm"
