"""Values with the digits that their errors leave, and the error of the passes at a limit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import wearsim
from wearsim.report.text import with_error
from wearsim.studies.run.run import run

RIG = Path(__file__).parents[2] / "scenarios" / "rig-450min.toml"


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (262.34e6, 4.1e6, "262 ± 4.1 MPa"),
        (262.34e6, 41e6, "260 ± 41 MPa"),
        (262.34e6, 410e6, "300 ± 410 MPa"),
        (50.0, 4.1e6, "0 ± 4.1 MPa"),
        (-50.0, 4.1e6, "0 ± 4.1 MPa"),
        (262.34e6, 1.0, "262.3 ± 1.0e-06 MPa"),
        (262.34e6, 1e-4, "262.3 MPa"),
        (262.34e6, np.nan, "262.3 MPa"),
        (262.34e6, None, "262.3 MPa"),
    ],
)
def test_value_has_the_digits_that_its_error_leaves(value, error, text):
    assert with_error(np.array([value]), error, "MPa") == text


def test_different_rollers_have_the_greatest_error():
    assert with_error(np.array([260e6, 281e6]), 12e6, "MPa") == "260 / 281 ± 12 MPa"


@pytest.fixture(scope="module")
def limited():
    return run(wearsim.load_scenario(RIG), until="depth 20 um")


def test_passes_at_a_limit_have_the_error_of_the_limited_quantity(limited):
    fine = {"contact.strips": 401, "evolution.tolerance": 1e-5}
    scenario = wearsim.load_scenario(RIG, overrides=fine)
    true = run(scenario, until="depth 20 um").passes[-1]
    error = limited.passes_error
    assert abs(limited.passes[-1] - true) <= error <= 5e-3 * true
    assert error == pytest.approx(1.5 * limited.depth_error[-1] / 20e-6 * true, rel=0.05)
    assert f" ± {round(error, -1):.0f} of" in limited.view.standing()
    assert limited.view.data()["passes_error"] == error


def test_table_states_the_error_of_every_quantity(limited):
    rows = {row.label: row.text for row in limited.view.rows()}
    for name in ("width", "worn volume", "dissipated energy", "peak pressure", "worn descent"):
        assert " ± " in rows[name], name
    assert rows["normal force"] == "300.0 N"  # it is given
