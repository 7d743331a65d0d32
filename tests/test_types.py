"""Batches of solved contacts, as columns and as sequences."""

from dataclasses import fields

import numpy as np
import pytest

from wearsim.contact_batch import BatchSolution, OperatingPoints, rows_of
from wearsim.types import ContactSolution

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


def batch(shape=(1, 2, 3), first=0):
    """Return a batch of contacts numbered from `first`."""
    return BatchSolution.of(shape, [solution(first + k) for k in range(int(np.prod(shape)))])


def test_batch_is_a_sequence_of_contacts():
    found = batch()
    assert len(found) == 6
    assert numbers(found) == [0, 1, 2, 3, 4, 5]
    assert numbers(found[2:4]) == [2, 3]
    assert found[-1].power == 5.5
    assert isinstance(found[0].power, float)


@pytest.mark.parametrize("name", ["line_load", "power", "y"])
def test_rows_of_a_batch_equal_those_of_its_contacts(name):
    found = batch()
    assert (rows_of(found, name) == rows_of(list(found), name)).all()


def test_selection_and_joining_act_on_the_last_axis():
    found = batch()
    taken = found.at(np.array([2, 0]))
    assert taken.shape == (1, 2, 2)
    assert numbers(taken) == [2, 0, 5, 3]
    joined = found.joined_with(batch(first=10))
    assert joined.shape == (1, 2, 6)
    assert numbers(joined) == [0, 1, 2, 10, 11, 12, 3, 4, 5, 13, 14, 15]
    replaced = found.with_others(np.array([1]), batch((1, 2, 1), first=20))
    assert numbers(replaced) == [0, 20, 2, 3, 21, 5]
    assert all(column.flags.c_contiguous for column in replaced.columns.values())


def test_moving_an_axis_and_back_keeps_the_order():
    found = batch()
    moved = found.with_axis_moved(2, 0)
    assert moved.shape == (3, 1, 2)
    assert numbers(moved) == [0, 3, 1, 4, 2, 5]
    assert moved.columns["line_load"].flags.c_contiguous
    assert numbers(moved.with_axis_moved(0, 2)) == numbers(found)


def test_operating_points_are_selected_by_number():
    column = np.arange(4.0)
    points = OperatingPoints(
        column, column, -column, column, column, 1.0, np.tile(column[:, None], (1, 5))
    )
    chosen = points.at(np.array([3, 1]))
    assert [point.normal_force for point in chosen] == [3.0, 1.0]
    assert chosen[0].creepage.lateral == -3.0
    assert (chosen[1].creepage.variation == 1.0).all()
    assert replace_variation(points).at(np.array([2]))[0].creepage.variation is None


def replace_variation(points):
    """Return the points without a variation of the creepage."""
    return OperatingPoints(
        points.normal_force,
        points.longitudinal,
        points.lateral,
        points.spin,
        points.friction,
        points.rolling_speed,
    )
