"""Batches of contacts and of their solutions."""

from dataclasses import fields, replace

import numpy as np
import pytest

from wearsim.contact_batch import ContactBatch, ContactBatchSolution
from wearsim.types import ContactSolution, Creepage, OperatingPoint

Y = np.linspace(-1.0, 1.0, 5)


def solution(number):
    """Return a contact solution identified by its number of iterations."""
    strips = np.full(5, float(number))
    scalars = dict.fromkeys((item.name for item in fields(ContactSolution)), number + 0.5)
    return ContactSolution(
        **scalars
        | {"y": Y, "half_length": strips, "line_load": 2.0 * strips, "dissipation": strips}
        | {"iterations": number},
    )


def numbers(contacts):
    """Return the numbers that identify contacts."""
    return [contact.iterations for contact in contacts]


def batch(count=6, first=0):
    """Return a batch of contacts numbered from `first`."""
    return ContactBatchSolution.of([solution(first + k) for k in range(count)])


def test_batch_of_solutions_gives_single_contacts():
    found = batch()
    assert len(found) == 6
    assert numbers(found) == [0, 1, 2, 3, 4, 5]
    assert found[-1].power == 5.5
    assert isinstance(found[0].power, float)
    assert isinstance(found[0].iterations, int)
    assert (found[3].line_load == 6.0).all()
    assert found[0].y is found.y


def test_solutions_are_selected_joined_and_replaced_by_number():
    found = batch()
    assert numbers(found.at(np.array([2, 0, 5]))) == [2, 0, 5]
    joined = found.joined_with(batch(first=10), rows=2)
    assert numbers(joined) == [0, 1, 2, 10, 11, 12, 3, 4, 5, 13, 14, 15]
    replaced = found.with_others(np.array([1, 4]), batch(2, first=20))
    assert numbers(replaced) == [0, 20, 2, 3, 21, 5]
    assert numbers(found) == [0, 1, 2, 3, 4, 5]


def test_contacts_are_selected_by_number():
    column = np.arange(4.0)
    wide = np.tile(column[:, None], (1, 5))
    contacts = ContactBatch(
        wide, column, column, 2.0 * column, column, -column, column, column, wide, shape=(2, 1, 2)
    )
    chosen = contacts.at(np.array([3, 1]))
    assert chosen.normal_force.tolist() == [3.0, 1.0]
    point = chosen.point(0)
    assert (point.rolling_speed, point.creepage.lateral) == (6.0, -3.0)
    assert (chosen.point(1).creepage.variation == 1.0).all()
    assert replace(contacts, variation=None).at(np.array([2])).point(0).creepage.variation is None
    assert contacts.place(3) == ([1, 0, 1], "station 1, realisation 1")
    assert chosen.place(1) == ([1], "contact 1")


def test_points_of_different_kinds_are_no_batch():
    gap, point = np.zeros((2, 5)), OperatingPoint(300.0, 1.0, Creepage(1e-3), 0.1)
    for change in ({"bearing_torque": 0.1}, {"friction": np.ones(5)}, {"friction_carried": True}):
        with pytest.raises(ValueError, match="in a batch of each kind"):
            ContactBatch.of(gap, 90.0, [point, replace(point, **change)])
    with pytest.raises(ValueError, match="longitudinal_curvature has 1 values for 2 contacts"):
        ContactBatch.of(gap, 90.0, [point])
