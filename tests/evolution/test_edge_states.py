"""States that begin and cease to resolve the edges of contacts within a strip."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.evolution import built, stepped
from tests.evolution.test_step_loads import THREE, Line, with_loads
from wearsim.evolution.contacts import fresh_state
from wearsim.evolution.quantities import Varying
from wearsim.evolution.steppers import edges
from wearsim.evolution.steppers.implicit import ImplicitStepper, implicit_step, with_rates
from wearsim.mechanics.numerics.edge_strips import SETTLED
from wearsim.mechanics.numerics.piecewise_linear import Paths

THERMAL = {"load__thermal": {"gain": "50 N/W", "time_constant": "2 s"}}
SPRING = {"load__kind": "spring", "load__stiffness": "20 kN/mm"}
ELASTIC = 1e-6  # m


def of(problem, value):
    """Return an array over stations, contacts, realisations and strips, filled with a value."""
    return np.full((*problem.shape, problem.grid.strips), value)


def with_contacts(problem, state, worn=0.0, adhesion=0.0, loads=1.0):
    """Return a state with grooves in all bodies, and with other contacts.

    Parameters
    ----------
    problem, state
    worn, adhesion, loads : ndarray, broadcast to (stations, contacts, realisations)
        Worn descent over the elastic approach of every contact, part that adheres, and load over
        the one that it carries.
    """
    shape = problem.shape
    worn, adhesion, loads = (np.broadcast_to(one, shape) for one in (worn, adhesion, loads))
    rollers = np.broadcast_to(worn[:1], (1, *shape[1:])) * ELASTIC
    cylinder = np.zeros_like(state.cylinder_depth)
    roller = rollers[..., None] * np.ones(problem.grid.strips)
    least = problem.gap(cylinder, roller).min(axis=-1)
    contacts = replace(
        state.contacts,
        approach=(least + ELASTIC).ravel(),
        adhesion_fraction=adhesion.ravel(),
        line_load=state.contacts.line_load * loads.reshape(-1, 1),
    )
    return state.replaced(cylinder_depth=cylinder, roller_depth=roller, contacts=contacts)


@pytest.fixture(scope="module")
def three():
    """Problem of seven tests with three rollers, and their start."""
    problem = built(**THREE)[0].at(np.zeros(7, dtype=np.int64))
    return problem, fresh_state(problem)


def test_edges_are_resolved_under_constant_loads_on_crowned_bodies(three):
    problem, state = three[0].at(np.array([0])), three[1].at(np.array([0]))
    contacts = state.contacts
    assert edges.resolves_edges(problem, contacts)
    assert not edges.resolves_edges(problem, replace(contacts, separation=None))
    assert not edges.resolves_edges(with_loads(problem, Line()), contacts)
    path = Paths.through(np.array([0.0, 1.0]), np.array([0.1, 0.2]))
    varying = replace(problem, varying=(Varying("friction", (0,), path),))
    assert not edges.resolves_edges(varying, contacts)
    assert not edges.resolves_edges(replace(problem, crowned=False), contacts)
    thermal, _, _ = built(**THREE, **THERMAL)
    assert not edges.resolves_edges(thermal, contacts)
    nodes = replace(problem, roller=np.array([0, 0, 1, 2]), weight=np.array([0.5, 0.5, 1.0, 1.0]))
    assert nodes.has_nodes
    assert not edges.resolves_edges(nodes, contacts)
    cam, _, _ = built("cam-cycloidal", contact__strips=41)
    assert edges.resolves_edges(cam, contacts)
    assert edges.resolves_edges(replace(cam, terms=thermal.terms), contacts)
    two = replace(cam, roller=np.array([0, 1]), inputs=cam.inputs.at(np.array([0, 0])))
    kinematics = replace(cam.kinematics, multiplicity=np.ones(2))
    two = replace(two, kinematics=kinematics, weight=np.ones(2))
    two = replace(two, flat_gap=two.flat_gap.repeat(2, axis=1))
    assert not two.has_nodes
    assert not edges.resolves_edges(replace(two, from_apex=two.from_apex.repeat(2, 0)), contacts)


def test_tests_without_edges_have_fields_that_are_no_numbers(three):
    problem, state = three
    begun = with_rates(problem, state)
    found = edges.without_edges(problem, begun)
    for name in edges.FIELDS:
        np.testing.assert_array_equal(getattr(found, name), of(problem, np.nan))
    assert edges.unresolved(found).all()
    assert found.past_sums.shape == (6, 1 + 3 + 1, 7)
    assert np.isnan(found.past_sums[:, :-1]).all()
    np.testing.assert_array_equal(found.past_sums[:, -1], begun.past_sums[:, -1])
    again = edges.without_edges(problem, found)
    np.testing.assert_array_equal(again.past_sums, found.past_sums)
    assert begun.separation is None
    some = np.isin(np.arange(7), [1, 4])
    part = np.where(some[:, None], 0.5, found.part)
    np.testing.assert_array_equal(edges.unresolved(found.replaced(part=part)), ~some)


def test_whole_strips_are_those_with_load(three):
    problem, state = three
    small = replace(state.contacts, line_load=1e-6 * state.contacts.line_load)  # below 1 N/m
    begun = with_rates(problem, state).replaced(contacts=small)
    found = edges.with_whole_strips(problem, begun)
    loaded = state.contacts.line_load.reshape(*problem.shape, -1) > 0.0
    assert 0 < np.count_nonzero(loaded) < loaded.size
    assert found.separation is None
    np.testing.assert_array_equal(found.part, np.where(loaded, 1.0, 0.0))
    np.testing.assert_array_equal(found.whole_steps, np.where(loaded, SETTLED, 0.0))
    bodies = begun.past_wear.sum(axis=-1)
    np.testing.assert_array_equal(found.past_sums[:, :-1], bodies)
    np.testing.assert_array_equal(found.past_sums[:, -1:], begun.past_sums)


def test_groove_is_deep_and_slips(three):
    problem, state = three
    worn = np.full(problem.shape, 2.0 * edges.GROOVE)
    worn[0, :, 0] = 0.0
    worn[0, 1, 1], worn[0, 2, 2] = 1.001 * edges.GROOVE, 0.999 * edges.GROOVE
    adhesion = np.zeros(problem.shape)
    adhesion[0, 0, 3], adhesion[0, 2, 4] = 1.001 * edges.MOST_ADHESION, 0.999 * edges.MOST_ADHESION
    found = edges.have_groove(problem, with_contacts(problem, state, worn, adhesion))
    assert found.tolist() == [False, True, False, False, True, True, True]


def test_groove_of_a_cam_is_deep_on_average():
    problem, _, _ = built("cam-cycloidal", contact__strips=41)
    state, stations = fresh_state(problem), problem.shape[0]
    for depth, deep in ((1.001, True), (0.999, False)):
        changed = with_contacts(problem, state, depth * edges.GROOVE)
        contacts = changed.contacts
        elastic = contacts.approach + ELASTIC * np.linspace(-0.5, 0.5, stations)
        changed = changed.replaced(contacts=replace(contacts, approach=elastic))
        assert edges.have_groove(problem, changed).tolist() == [deep]


def begun_states(problem, state, resolved):
    """Return a state of order 3 in which some of the tests resolve edges, and a separation."""
    state = with_rates(problem, state).replaced(order=np.full(len(resolved), 3))
    wear = np.arange(state.past_wear.size, dtype=np.float64).reshape(state.past_wear.shape)
    state = edges.without_edges(problem, state.replaced(past_wear=wear))
    column, sums = resolved[:, None], state.past_sums.copy()
    sums[:, :-1] = np.where(resolved, 7.0, sums[:, :-1])
    fields = {n: np.where(column, 0.25, getattr(state, n)) for n in edges.FIELDS}
    separation = np.where(state.contacts.line_load > 0.0, -1.0, 3e-7)
    contacts = replace(state.contacts, separation=separation)
    return state.replaced(**fields, past_sums=sums, contacts=contacts)


def test_tests_begin_in_grooves_and_cease_where_contacts_adhere(three):
    problem, state = three
    resolved = np.array([True, True, False, False, False, False, True])
    worn = np.array([0.0, 9.0, 9.0, 9.0, 0.0, 9.0, 9.0])
    adhesion = np.array([0.0, 1.001, 0.0, 1.001, 0.0, 0.0, 0.0]) * edges.CEASING_ADHESION
    adhesion[0] = 0.999 * edges.CEASING_ADHESION
    start = begun_states(problem, state, resolved)
    start = with_contacts(problem, start, worn, adhesion, loads=1e-6)  # below 1 N/m
    unknown = start.contacts.separation.reshape(*problem.shape, -1).copy()
    unknown[0, 1, 5, 3] = np.nan  # a model that returns no separation of one contact
    shape = start.contacts.separation.shape
    contacts = replace(start.contacts, separation=unknown.reshape(shape))
    start = start.replaced(contacts=contacts)
    found = edges.at_start_of_step(problem, start)
    kept, ceased, begins = [0, 6], [1], [2]
    still = [3, 4, 5]  # as wholes: it adheres, has no groove, or has no separation
    loaded = start.contacts.line_load.reshape(*problem.shape, -1) > 0.0
    for name, inside, outside in zip(
        edges.FIELDS, (0.0, 1.0, SETTLED), (unknown, 0.0, 0.0), strict=True
    ):
        fields = getattr(found, name)
        assert (fields[:, :, kept] == 0.25).all()
        assert np.isnan(fields[:, :, ceased + still]).all()
        expected = np.where(loaded, inside, outside)
        np.testing.assert_array_equal(fields[:, :, begins], expected[:, :, begins])
    np.testing.assert_array_equal(found.order, [3, 1, 3, 3, 3, 3, 3])
    sums, before = found.past_sums, start.past_sums
    np.testing.assert_array_equal(sums[:, :-1, 2], start.past_wear.sum(axis=-1)[:, :, 2])
    others = [*kept, *still]
    np.testing.assert_array_equal(sums[:, :, others], before[:, :, others])
    np.testing.assert_array_equal(sums[:, -1], before[:, -1])
    assert np.isnan(before[:, :-1, 2]).all()
    unknown = replace(start.contacts, separation=np.full(shape, np.nan))
    start = start.replaced(contacts=unknown).at(np.array(still))
    assert edges.at_start_of_step(problem.at(np.array(still)), start) is start


def test_edges_are_kept_without_a_change_and_left_on_other_forms(three):
    problem, state = three
    plain = with_rates(problem, state)
    assert edges.at_start_of_step(problem, plain) is plain
    resolved = np.arange(7) % 2 == 0
    start = begun_states(problem, state, resolved)
    assert edges.at_start_of_step(problem, start) is start
    found = edges.at_start_of_step(replace(problem, crowned=False), start)
    assert [getattr(found, name) for name in edges.FIELDS] == [None] * 3
    np.testing.assert_array_equal(found.past_sums, start.past_sums[:, -1:])
    np.testing.assert_array_equal(found.order, np.ones(7))


def test_tests_cease_where_a_spring_has_lost_its_load():
    problem = built(**THREE, **SPRING)[0].at(np.zeros(3, dtype=np.int64))
    offset = np.array([[20.0], [0.0], [-30.0]])
    problem = replace(problem, inputs=problem.inputs.with_values({"normal_force_offset": offset}))
    state = fresh_state(problem)
    part = np.ones(problem.shape)
    part[0, 2, 1], part[0, 0, 2] = 0.999 * edges.LEAST_LOAD, 1.001 * edges.LEAST_LOAD
    start = begun_states(problem, state, np.ones(3, dtype=np.bool_))
    found = edges.at_start_of_step(problem, with_contacts(problem, start, loads=part))
    assert edges.unresolved(found).tolist() == [False, True, False]
    assert found.order.tolist() == [3, 1, 3]


@pytest.mark.parametrize("name", ["cam-cycloidal", "rig-450min"])
def test_tests_without_a_spring_or_on_a_cam_do_not_cease_by_their_loads(name):
    problem, _, _ = built(name, contact__strips=41)
    start = begun_states(problem, fresh_state(problem), np.ones(1, dtype=np.bool_))
    light = with_contacts(problem, start, loads=0.5 * edges.LEAST_LOAD)
    assert edges.at_start_of_step(problem, light) is light


def test_start_of_a_test_has_the_fields_that_its_stepper_needs(three):
    problem, state = three[0].at(np.array([0])), three[1].at(np.array([0]))
    plain = ImplicitStepper(1e-3).started(problem, state)
    assert edges.unresolved(plain).all()
    assert ImplicitStepper(1e-3).started(problem, plain) is plain
    for stepper in (ImplicitStepper(1e-3, by_doubling=True), ImplicitStepper(1e-3, 10.0)):
        assert stepper.started(problem, state).part is None
    varying = ImplicitStepper(1e-3).started(with_loads(problem, Line()), state)
    assert varying.separation is None
    assert set(np.unique(varying.part)) == {0.0, 1.0}
    nodes = replace(
        problem,
        roller=np.array([0, 1, 2, 2]),
        weight=np.array([1.0, 1.0, 0.5, 0.5]),
        inputs=problem.inputs.at(np.array([0, 1, 2, 2])),
    )
    many = with_loads(nodes, Line())
    assert ImplicitStepper(1e-3).started(many, fresh_state(many)).part is None


def test_long_step_of_a_cam_keeps_its_edges():
    # its edges pass strips that they were not predicted to reach
    problem, stepper, stop = built("cam-cycloidal", contact__strips=41, evolution__tolerance=1e-2)
    state, _ = stepped(problem, stepper, 0.1 * stop)
    assert np.isfinite(state.part).all()
    first = state.replaced(order=np.ones(1, dtype=np.int64))
    end = implicit_step(problem, first, np.array([0.2 * stop]))
    assert np.isfinite(end.part).all()
    reached = (end.part > 0.0) & (state.part <= 0.0)
    assert np.count_nonzero(reached) > 2 * problem.contacts_each
