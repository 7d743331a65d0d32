"""Wear of shared bodies in steps of Newton's method, interpreted, against one dense system."""

from __future__ import annotations

import numpy as np
import pytest

from wearsim.mechanics.numerics.lu import whole_panels
from wearsim.mechanics.slender.body_wear import (
    factor_depths,
    fill_responses,
    new_depth_system,
    number_depths,
    solve_depths,
)
from wearsim.mechanics.slender.newton_step import new_newton_state, number_strips

STRIPS = 6
SINGLE = 1e-6  # error of the steps, which are of single precision
# bodies of each contact: those of the first column have the lower numbers
BODIES = {
    "two stations and two rollers": [[0, 2], [1, 2], [0, 3], [1, 3]],
    "one cylinder and three rollers": [[0, 1], [0, 2], [0, 3]],
    "three stations and one roller": [[0, 3], [1, 3], [2, 3]],
    "three stations and two rollers": [[0, 3], [1, 3], [2, 3], [0, 4], [1, 4], [2, 4]],
    "one station and two rollers": [[0, 1], [0, 2], [0, 2]],
    "a contact by itself": [[0, 1], [0, 1], [-1, -1]],
    "a body that wears alone": [[0, 2], [-1, 2], [0, -1], [1, 2]],
    "bodies that two contacts share in a few strips": [[0, 2], [0, 3], [1, 2]],
}


class Contacts:
    """Contacts that overlap in some of their strips, with their separate steps.

    The Jacobians are those of separate contacts, by rows.
    """

    def __init__(self, bodies: list[list[int]]) -> None:
        rng = np.random.default_rng(len(bodies))
        self.bodies, self.count = np.array(bodies), len(bodies)
        self.loaded = rng.random((self.count, STRIPS)) < 0.75
        self.loaded[:, 2] = True
        self.line_load = np.where(self.loaded, 1.0 + rng.random(self.loaded.shape), 0.0)
        self.shared = 0.5 * rng.random((self.count, 2, STRIPS))
        self.own = rng.random((self.count, STRIPS))
        self.state = new_newton_state(self.count, STRIPS)
        self.step, self.jacobian = [], []
        for k in range(self.count):
            number_strips(k, self.line_load, 1, self.state)
            size = int(self.state.size[k])
            self.jacobian.append(rng.random((size, size)) + 2.0 * np.eye(size))
            self.step.append(rng.standard_normal(size))
        self.unit_load = [np.linalg.solve(one, np.ones(len(one))) for one in self.jacobian]
        self.approach = rng.standard_normal(self.count)

    def system(self):
        """Return the system of the bodies' depths, and the softness of the contacts."""
        state, softness = self.state, np.full((self.count, STRIPS), -1.0)
        system = new_depth_system(self.bodies, STRIPS)
        for array in (system.block, system.across, system.outer, system.depth, system.softness):
            array[:] = np.nan  # of another step
        for array in (system.outer_depth, system.approach_slope, system.gap, system.change):
            array[:] = np.nan
        state.fresh[:] = False
        number_depths(self.bodies, self.own, self.shared, state, system, softness)
        for k in range(self.count):
            size = int(state.size[k])
            state.matrix[k, :size, :size] = self.jacobian[k].T  # by columns
            state.step[k, :size] = self.step[k]
            assert fill_responses(k, state, system)
        return system, softness

    def touches(self, body: int) -> np.ndarray:
        """Return how many contacts touch each strip of a body."""
        by_contact = [(pair == body).any() * loaded for pair, loaded in self.each()]
        return np.sum(by_contact, axis=0)

    def each(self):
        return zip(self.bodies, self.loaded, strict=True)

    def response(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the decrease of the loads, and the approach, per gap at constant load."""
        inverse, unit_load = np.linalg.inv(self.jacobian[k]), self.unit_load[k]
        slope = inverse.sum(axis=0) / unit_load.sum()
        return inverse - np.outer(unit_load, slope), slope

    def coupled(self) -> tuple[list[np.ndarray], np.ndarray]:
        """Return steps and approaches with the wear of the shared bodies, by one dense system."""
        places = [np.flatnonzero(loaded) for loaded in self.loaded]
        offsets = np.cumsum([0, *map(len, places)])
        opening = np.zeros((offsets[-1], offsets[-1]))  # gap of each row per load of each other
        for k in range(self.count):
            for side in range(2):
                body = self.bodies[k, side]
                if body < 0:
                    continue
                for other in range(self.count):
                    for of_other in np.flatnonzero(self.bodies[other] == body):
                        for row, i in enumerate(places[k]):
                            for column, j in enumerate(places[other]):
                                if i == j and self.touches(body)[i] > 1:
                                    where = offsets[k] + row, offsets[other] + column
                                    opening[where] += self.shared[other, of_other, i]
        response = np.zeros_like(opening)
        for k in range(self.count):
            part = slice(offsets[k], offsets[k + 1])
            response[part, part] = self.response(k)[0]
        steps = np.concatenate(self.step)
        steps = np.linalg.solve(np.eye(len(steps)) + response @ opening, steps)
        gaps = np.split(opening @ steps, offsets[1:-1])
        approach = [self.response(k)[1] @ gap for k, gap in enumerate(gaps)]
        return np.split(steps, offsets[1:-1]), self.approach + approach


@pytest.fixture(params=BODIES)
def contacts(request: pytest.FixtureRequest) -> Contacts:
    return Contacts(BODIES[request.param])


def test_response_to_a_gap_keeps_the_load(contacts: Contacts) -> None:
    system, _ = contacts.system()
    for k in range(contacts.count):
        size, (expected, slope) = int(contacts.state.size[k]), contacts.response(k)
        found = contacts.state.matrix[k, :size, :size].T
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=SINGLE)
        np.testing.assert_allclose(found.sum(axis=0), 0.0, atol=SINGLE)
        np.testing.assert_allclose(system.approach_slope[k, :size], slope, atol=SINGLE)


def test_strips_of_one_contact_are_no_unknowns(contacts: Contacts) -> None:
    system, softness = contacts.system()
    assert contacts.state.fresh.all()
    assert system.total[0] + system.size.sum() == sum(
        (contacts.touches(body) > 1).sum() for body in range(contacts.bodies.max() + 1)
    )
    for body in range(contacts.bodies.max() + 1):
        shared = contacts.touches(body) > 1
        assert ((system.number[body] >= 0) == shared).all()
    for k, (pair, loaded) in enumerate(contacts.each()):
        expected = contacts.own[k].copy()
        for side, body in enumerate(pair):
            if body >= 0:
                alone = contacts.touches(body) == 1
                expected += np.where(alone, contacts.shared[k, side], 0.0)
        np.testing.assert_allclose(softness[k, loaded], expected[loaded], rtol=1e-14)
    contacts.state.fresh[:] = False
    arguments = contacts.bodies, contacts.own, contacts.shared, contacts.state
    number_depths(*arguments, system, softness)
    assert not contacts.state.fresh.any()


def test_coupled_step_is_that_of_one_dense_system(contacts: Contacts) -> None:
    system, _ = contacts.system()
    assert factor_depths(contacts.shared, contacts.state, system)
    approach, (steps, expected) = contacts.approach.copy(), contacts.coupled()
    solve_depths(contacts.shared, contacts.state, system, approach)
    for k, step in enumerate(steps):
        error = 10.0 * SINGLE * np.abs(step).max()
        np.testing.assert_allclose(contacts.state.step[k, : len(step)], step, rtol=0.0, atol=error)
    np.testing.assert_allclose(approach, expected, rtol=0.0, atol=10.0 * SINGLE)


@pytest.mark.parametrize("side", [0, 1])
def test_system_without_a_solution_is_not_factored(side: int) -> None:
    contacts = Contacts(BODIES["two stations and two rollers"])
    system, _ = contacts.system()
    contacts.shared[:, side] = np.nan
    assert not factor_depths(contacts.shared, contacts.state, system)


def test_less_numerous_bodies_remain_in_the_outer_system() -> None:
    for bodies, touched in ((BODIES["one cylinder and three rollers"], 1),
                            (BODIES["three stations and one roller"], 0)):  # fmt: skip
        system = new_depth_system(np.array(bodies), STRIPS)
        assert system.touched[:, 0].tolist() == [pair[touched] for pair in bodies]
        assert system.touched[:, 1].tolist() == [pair[1 - touched] for pair in bodies]
        size = whole_panels(STRIPS)
        assert system.outer.shape == (size, size)
