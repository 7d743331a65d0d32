"""Bias of the wear of a step within which the load varies."""

import numpy as np
import pytest

from tests.evolution import built
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.error_estimates import MOST_ADHERING, variation_bias
from wearsim.evolution.steppers.single_step import carried_loads, energy_per_pass

#: of the rollers in their slack; that of the scenario makes all of a contact slip
SMALL_YAW = {
    "creepage__misalignment": {
        "distribution": "disc",
        "radius": "0.02 mrad",
        "persistence": "per-roller",
    }
}


def varying_load(**changes):
    """Return problem, fresh state, arguments of one long step, and half the relative variance."""
    problem, _, stop = built("rig-ensemble", **changes)
    state, (load,) = fresh_state(problem), problem.varying
    deviation = load.paths.deviation(np.zeros(1), problem.time(np.full(1, stop)))[0]
    relative = deviation / np.abs(carried_loads(problem, state.contacts)).max()
    return problem, state, (np.zeros(1), np.full(1, stop)), 0.5 * relative**2


@pytest.mark.parametrize("creepage", [4e-3, 7e-4, 5.3e-4], ids=["slip", "partial slip", "half"])
def test_bias_of_a_small_variance_is_below_the_bound_and_is_neglected(creepage):
    problem, state, step, half = varying_load(creepage__longitudinal=creepage, **SMALL_YAW)
    assert state.contacts.adhesion_fraction.max() < MOST_ADHERING
    depths, energy, varies = variation_bias(problem, state, *step)
    of_step = energy_per_pass(problem, state.contacts) * step[1]
    assert varies
    assert 0.0 < np.abs(energy) < half * of_step
    assert np.abs(depths[0]).max() > 0.0
    kept, same_energy, _ = variation_bias(problem, state, *step, negligible=0.99 * half)
    np.testing.assert_array_equal(same_energy, energy)
    np.testing.assert_array_equal(kept[0], depths[0])
    none, no_energy, varies = variation_bias(problem, state, *step, negligible=1.01 * half)
    assert varies  # safety factors of varying loads still apply
    assert not (none[0].any())
    assert not (none[1].any())
    assert not (no_energy.any())


@pytest.mark.parametrize(
    "changes",
    [{"creepage__longitudinal": 2e-4, **SMALL_YAW}, {"wear": {"law": "t-gamma"}}],
    ids=["adhesion", "wear by a power of the power"],
)
def test_bias_is_not_neglected_where_wear_may_depend_strongly_on_the_load(changes):
    problem, state, step, half = varying_load(**changes)
    expected = variation_bias(problem, state, *step)
    found = variation_bias(problem, state, *step, negligible=10.0 * half)
    np.testing.assert_array_equal(found[1], expected[1])
    np.testing.assert_array_equal(found[0][0], expected[0][0])
    assert np.abs(expected[1]) > 0.0
