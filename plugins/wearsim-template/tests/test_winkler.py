"""Requirements on contact model, axial profile, study and its table; the modulus of the README."""

import numpy as np
import pytest
from wearsim_template import FORM, KIND, SPEC, TABLE
from wearsim_template.study import Approach

from wearsim.testing import (
    STEEL,
    axial_profile_tests,
    contact_model_tests,
    study_kind_tests,
    table_tests,
)
from wearsim.types import Creepage, Grid, OperatingPoint

test_winkler = contact_model_tests(SPEC)
test_softer_winkler = contact_model_tests(SPEC, {"foundation_modulus": "500 GPa/mm"})

test_winkler_quartic = axial_profile_tests(FORM, {"length": "10 mm"})


def small_study():
    """Return the approach of a crowned roller under three forces."""
    grid = Grid.spanning(-3e-3, 3e-3, 41)
    model = SPEC.factory(SPEC.options(), grid, (STEEL, STEEL))
    table = TABLE.options(greatest_force="300 N", forces=3)
    return Approach(model, table.values, 5.0 * grid.y**2, 90.0)


test_winkler_approach = study_kind_tests(KIND, small_study)
test_winkler_approach_table = table_tests(TABLE, {"greatest_force": "400 N"})


def test_strip_of_the_half_length_has_its_hertzian_load():
    a, curvature = 0.1e-3, 90.0
    options, grid = SPEC.options(half_length="0.1 mm"), Grid.spanning(-3e-3, 3e-3, 3)
    model = SPEC.factory(options, grid, (STEEL, STEEL))
    hertz = np.pi / 4.0 * STEEL.youngs_modulus / (2.0 * (1.0 - 0.3**2)) * curvature * a**2
    point = OperatingPoint(hertz * 2e-3, 1.0, Creepage(1e-3), 0.1)  # a single strip of 2 mm
    solution = model.solve_one(np.array([1.0, 0.0, 1.0]), curvature, point)
    assert solution.half_length[1] == pytest.approx(a, rel=1e-9)
    assert solution.line_load[1] == pytest.approx(hertz, rel=1e-9)
