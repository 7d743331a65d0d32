"""Control variate of ensembles: the depth for full slip of rigid bodies in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from tests.studies.random_examples import CREEPAGE, FRICTION, LOAD, SLACK, scenario_of
from wearsim.studies.ensemble.realisation import closed_form_depths, control_of
from wearsim.studies.run.draws import Drawer

CROWN = 1.0  # 2 R_crown of the rig [m]
NOTHING: dict[str, np.ndarray] = {}


def rate(scenario, factor=2e-9):
    """Return depth per pass and line load of the rig's means."""
    return factor * scenario.friction.coefficient * scenario.creepage.longitudinal


def test_depth_is_closed_form_of_full_slip():
    scenario = scenario_of(6000)
    found = closed_form_depths(scenario, NOTHING, 3)
    expected = (0.75 * rate(scenario) * 300.0 * 6000 / np.sqrt(CROWN)) ** (2.0 / 3.0)
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert len(found) == 3


@pytest.mark.parametrize("stiffness", [1.0, 690e3, 5e6, 40e6])
def test_spring_unloads_as_in_closed_form(stiffness):
    scenario = scenario_of(6000, load__kind="spring", load__stiffness=f"{stiffness!r} N/m")
    depth = float(closed_form_depths(scenario, NOTHING, 1)[0])
    # the number of passes for that depth, integrated over a groove that unloads the spring
    reached = np.sqrt(stiffness * depth / 300.0)
    passes = (
        4.0
        * np.sqrt(CROWN)
        / (rate(scenario) * stiffness)
        * (np.sqrt(300.0 / stiffness) * np.arctanh(reached) - np.sqrt(depth))
    )
    assert passes == pytest.approx(6000.0, rel=1e-6 if stiffness > 1e3 else 1e-2)
    free = float(closed_form_depths(scenario_of(6000), NOTHING, 1)[0])
    assert depth < free * (1.0 + 1e-9)
    if stiffness == 1.0:
        assert depth == pytest.approx(free, rel=1e-6)


def test_depth_is_divided_between_both_bodies():
    alone = float(closed_form_depths(scenario_of(6000), NOTHING, 1)[0])
    both = scenario_of(6000, wear__roller__k_over_h="2e-9 1/Pa")
    ratio = 25.0 / (20.0 * 3.0)  # of the depths of roller and cylinder
    found = float(closed_form_depths(both, NOTHING, 1)[0])
    assert found == pytest.approx(alone * (1.0 + ratio) ** (2.0 / 3.0) / (1.0 + ratio), rel=1e-12)
    nothing = scenario_of(6000, "0 1/Pa")
    assert closed_form_depths(nothing, NOTHING, 1)[0] == 0.0


def test_drawn_values_enter_per_roller():
    scenario = scenario_of(6000)
    columns = {
        "load.normal_force": np.array([300.0, 150.0]),
        "creepage.yaw": np.array([[0.0, 0.0, 0.0], [0.0, 1e-3, 2e-3]]),
    }
    found = closed_form_depths(scenario, columns, 2)
    slip = np.hypot(1e-3, columns["creepage.yaw"]).mean(axis=1) / 1e-3
    sliding = columns["load.normal_force"] * slip
    np.testing.assert_allclose(found / found[0], (sliding / sliding[0]) ** (2.0 / 3.0), rtol=1e-12)


def test_nonlinear_wear_law_has_no_control_variate():
    scenario = scenario_of(6000, wear={"law": "t-gamma", "cylinder": {}, "roller": {}})
    assert np.isnan(closed_form_depths(scenario, NOTHING, 1)).all()
    assert control_of(Drawer(scenario, "monte-carlo"), 100) is None


def test_mean_is_computed_from_separate_draws():
    scenario = scenario_of(
        6000,
        load__normal_force=LOAD,
        friction__coefficient=FRICTION,
        creepage__longitudinal=CREEPAGE,
        creepage__misalignment={**SLACK, "persistence": "per-roller"},
    )
    drawer = Drawer(scenario, "monte-carlo")
    control = control_of(drawer, 200_000)
    own = closed_form_depths(scenario, drawer.columns(0, 20_000), 20_000)
    error = control["std"] / np.sqrt(20_000)
    assert abs(own.mean() - control["mean"]) < 4.0 * error
    assert own.std() == pytest.approx(control["std"], rel=0.05)
    assert control_of(drawer, 200_000) == control
