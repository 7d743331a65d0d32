"""Width of a contact from the line load on strips."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from wearsim.mechanics.hertz.elasticity import combine
from wearsim.mechanics.hertz.ellipse import hertz
from wearsim_bench.contact.accuracy import MATERIALS
from wearsim_bench.contact.cases import contact_width
from wearsim_bench.exact_solutions import WORN, worn_profile

PATCH = hertz(22.5, 0.5, 300.0, combine(*MATERIALS).contact_modulus)
STRIPS, SPACING = 61, 1.4e-4
SHIFTS = st.floats(-0.5, 0.5)


def centres(shift):
    return (np.arange(STRIPS) - 0.5 * (STRIPS - 1) + shift) * SPACING


@given(SHIFTS)
def test_midpoint_line_loads_give_the_width_of_an_ellipse(shift):
    width = contact_width(PATCH.line_load(centres(shift)), SPACING)
    assert width == pytest.approx(2.0 * PATCH.b, rel=1e-9)


@given(SHIFTS)
def test_mean_line_loads_give_the_width_of_an_ellipse(shift):
    y = centres(shift)
    edges = np.append(y - 0.5 * SPACING, y[-1] + 0.5 * SPACING)
    means = np.diff(PATCH.load_below(edges)) / SPACING
    # the mean over a strip differs from the midpoint value by 1/24 of the second difference
    assert contact_width(means, SPACING) == pytest.approx(2.0 * PATCH.b, rel=1e-3)


@pytest.mark.parametrize("name", WORN)
def test_width_of_exact_solutions_is_resolved(name):
    exact = worn_profile(name)
    spacing = exact["y"][1] - exact["y"][0]
    coarse = exact["q"].reshape(-1, 2).mean(axis=1)
    width = contact_width(exact["q"], spacing)
    assert contact_width(coarse, 2.0 * spacing) == pytest.approx(width, rel=2e-4)


def test_width_of_the_exact_ellipse_is_that_of_hertz():
    exact = worn_profile("hertz")
    width = contact_width(exact["q"], exact["y"][1] - exact["y"][0])
    assert width == pytest.approx(2.0 * PATCH.b, rel=1e-4)


@pytest.mark.parametrize("name", WORN)
@given(shift=SHIFTS)
def test_line_load_with_a_kink_is_not_a_parabola(name, shift):
    exact = worn_profile(name)
    rows = np.interp(centres(shift), exact["y"], exact["q"], left=0.0, right=0.0)
    expected = contact_width(exact["q"], exact["y"][1] - exact["y"][0])
    # each edge is accurate to about half a strip
    assert contact_width(rows, SPACING) == pytest.approx(expected, abs=1.1 * SPACING)


@pytest.mark.parametrize("line_load", [[1.0], [1.0, 1.0], [2.0, 1.0, 2.0, 1.0]])
def test_width_of_few_strips_is_bounded_by_the_strips(line_load):
    width = contact_width(np.array([0.0, *line_load, 0.0]), SPACING)
    lower = (len(line_load) - 1) * SPACING
    assert lower < width <= len(line_load) * SPACING + SPACING
