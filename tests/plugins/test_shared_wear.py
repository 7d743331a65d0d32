"""Wear of shared bodies, and its reduction to the smallest number of bodies."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from wearsim.plugins import SharedWear


def reduced(wear):
    """Return the equivalent wear of one set of contacts."""
    ((_, own, members, shared),) = wear.groups
    return own[0], members, shared[0]


def opened(own, members, shared, line_load):
    """Return the gap that the reduced wear opens, written out pair by pair."""
    gap = own * line_load
    for k in range(len(members)):
        for side in (0, 1):
            body = members[k, side]
            if body < 0:
                continue
            for other in range(len(members)):
                for side2 in (0, 1):
                    if members[other, side2] == body:
                        gap[k] += shared[other, side2] * line_load[other]
    return gap


@settings(max_examples=80, deadline=None)
@given(st.integers(1, 6), st.integers(1, 3), st.integers(1, 4), st.integers(0, 10**6))
def test_reduced_wear_opens_the_same_gaps(contacts, stations, rollers, seed):
    random = np.random.default_rng(seed)
    bodies = np.stack(
        [random.integers(0, stations, contacts), random.integers(0, rollers, contacts)], axis=1
    )
    compliance = random.random((contacts, 2, 5)) * random.integers(0, 2, (1, 2, 1))
    wear, line_load = SharedWear(bodies, compliance), random.random((contacts, 5))
    own, members, shared = reduced(wear)
    expected = wear.opening(line_load)
    assert opened(own, members, shared, line_load) == pytest.approx(expected, rel=1e-12)
    numbers = np.unique(members[members >= 0])
    assert (numbers == np.arange(len(numbers))).all()


def test_body_of_one_contact_is_not_shared():
    three = SharedWear(np.array([[0, 0], [0, 1], [0, 2]]), np.ones((3, 2, 4)))
    own, members, _ = reduced(three)
    assert (own == 1.0).all()
    assert members.tolist() == [[0, -1], [0, -1], [0, -1]]


def test_cylinder_and_roller_of_the_same_contacts_merge():
    own, members, shared = reduced(SharedWear(np.zeros((4, 2), dtype=int), np.ones((4, 2, 3))))
    assert not own.any()
    assert (members[:, 0] == 0).all()
    assert (shared[:, 0] == 2.0).all()


def test_groups_equal_the_reduction_of_single_sets():
    random = np.random.default_rng(0)
    bodies = np.array([[0, 0], [0, 0], [0, 1]])
    wears = np.array([[1, 1], [1, 0], [0, 1], [0, 0], [1, 1], [0, 1]])[:, None, :, None]
    many = SharedWear(bodies, wears * random.random((6, 3, 2, 5)))
    line_load = random.random((6, 3, 5))
    opening, seen = many.opening(line_load), []
    for numbers, own, members, shared in many.groups:
        for place, number in enumerate(numbers.tolist()):
            single = many.at(number)
            expected = reduced(single)
            assert (own[place] == expected[0]).all()
            assert (members == expected[1]).all()
            assert (shared[place] == expected[2]).all()
            assert (opening[number] == single.opening(line_load[number])).all()
            seen.append(number)
    assert sorted(seen) == list(range(6))
