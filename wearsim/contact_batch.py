"""Operating points and solutions of a batch of contacts, stored as columns."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, overload

import numpy as np
import numpy.typing as npt

from wearsim.types import ContactSolution, Creepage, FloatArray, IntArray, OperatingPoint


@dataclass(frozen=True)
class OperatingPoints(Sequence[OperatingPoint]):
    """Operating points without bearing torque, as columns; a sequence of `OperatingPoint`.

    Parameters
    ----------
    normal_force, longitudinal, lateral, spin : ndarray, shape (contacts,)
        Load [N], longitudinal and lateral creepage, and spin [1/m].
    friction : ndarray, shape (contacts,), (contacts, strips) or (contacts, points, strips)
        Friction coefficient, as in `OperatingPoint`.
    rolling_speed : float
        Rolling velocity V [m/s].
    variation : ndarray, shape (contacts, strips), optional
        Variation of the longitudinal creepage, as in `Creepage`.
    friction_carried : bool
        As in `OperatingPoint`.
    """

    normal_force: FloatArray
    longitudinal: FloatArray
    lateral: FloatArray
    spin: FloatArray
    friction: FloatArray
    rolling_speed: float
    variation: FloatArray | None = None
    friction_carried: bool = False

    def __post_init__(self) -> None:
        count = len(self.normal_force)
        for name in _POINT_COLUMNS:
            column = getattr(self, name)
            if column is not None and len(column) != count:
                raise ValueError(
                    f"{name} has {len(column)} values for {count} contacts; expected one each"
                )

    @classmethod
    def of(cls, points: Sequence[OperatingPoint]) -> OperatingPoints | None:
        """Return `points` as columns, or None if they differ in `OperatingPoint.kind`."""
        if isinstance(points, cls):
            return points
        if (
            not points
            or points[0].bearing_torque is not None
            or (len(points) > 1 and len({point.kind for point in points}) > 1)
        ):
            return None
        creepages = [point.creepage for point in points]
        varies = creepages[0].variation is not None
        return cls(
            normal_force=np.array([point.normal_force for point in points], dtype=np.float64),
            longitudinal=np.array([creepage.longitudinal for creepage in creepages]),
            lateral=np.array([creepage.lateral for creepage in creepages]),
            spin=np.array([creepage.spin for creepage in creepages]),
            friction=np.array([point.friction for point in points]),
            rolling_speed=points[0].rolling_speed,
            variation=np.array([item.variation for item in creepages]) if varies else None,
            friction_carried=points[0].friction_carried,
        )

    def __len__(self) -> int:
        return len(self.normal_force)

    def at(self, numbers: IntArray | slice) -> OperatingPoints:
        """Return some of the points, by number and in that order."""
        columns = {name: getattr(self, name) for name in _POINT_COLUMNS}
        return replace(self, **{n: c[numbers] for n, c in columns.items() if c is not None})

    @overload
    def __getitem__(self, index: int) -> OperatingPoint: ...

    @overload
    def __getitem__(self, index: slice) -> OperatingPoints: ...

    def __getitem__(self, index: int | slice) -> OperatingPoint | OperatingPoints:
        if isinstance(index, slice):
            return self.at(index)
        friction = self.friction[index]
        return OperatingPoint(
            normal_force=float(self.normal_force[index]),
            rolling_speed=self.rolling_speed,
            creepage=Creepage(
                float(self.longitudinal[index]),
                float(self.lateral[index]),
                float(self.spin[index]),
                None if self.variation is None else self.variation[index],
            ),
            friction=float(friction) if self.friction.ndim == 1 else friction,
            friction_carried=self.friction_carried,
        )


_POINT_COLUMNS = ("normal_force", "longitudinal", "lateral", "spin", "friction", "variation")


@dataclass(frozen=True, eq=False)
class BatchSolution(Sequence[ContactSolution]):
    """Solutions of a batch of contacts, as columns; a sequence of `ContactSolution`.

    The sequence runs through the leading axes with the last axis fastest.

    Parameters
    ----------
    shape : tuple of int
        Leading axes: (station, roller, realisation).
    y : ndarray, shape (strips,)
        Axial position of the strips [m], the same for all contacts.
    columns : mapping of str to ndarray
        The other fields of `ContactSolution`, leading axes first.
    """

    shape: tuple[int, ...]
    y: FloatArray
    columns: Mapping[str, npt.NDArray[Any]]

    @classmethod
    def of(cls, shape: tuple[int, ...], solutions: Sequence[ContactSolution]) -> BatchSolution:
        """Return a sequence of solutions as a batch, last axis fastest."""
        rows = {name: rows_of(solutions, name) for name in _COLUMNS}
        columns = {name: values.reshape(shape + values.shape[1:]) for name, values in rows.items()}
        return cls(shape, solutions[0].y, columns)

    def stack(self, name: str) -> npt.NDArray[Any]:
        """Return the field `name` of every contact as one array with the leading axes first."""
        if name == "y":
            return np.broadcast_to(self.y, self.shape + self.y.shape)
        return self.columns[name]

    @cached_property
    def solutions(self) -> tuple[ContactSolution, ...]:
        """The solutions of the contacts, last axis fastest."""
        # numbers of contacts as lists, to give plain Python numbers
        flat = [
            column.ravel().tolist()
            if column.ndim == len(self.shape)
            else column.reshape(-1, len(self.y))
            for column in (self.columns[name] for name in _COLUMNS)
        ]
        return tuple(
            ContactSolution(self.y, **dict(zip(_COLUMNS, values, strict=True)))
            for values in zip(*flat, strict=True)
        )

    def __len__(self) -> int:
        return math.prod(self.shape)

    @overload
    def __getitem__(self, index: int) -> ContactSolution: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[ContactSolution, ...]: ...

    def __getitem__(self, index: int | slice) -> ContactSolution | tuple[ContactSolution, ...]:
        return self.solutions[index]

    def at(self, numbers: IntArray) -> BatchSolution:
        """Return the contacts at some indices of the last leading axis, in that order."""
        last = len(self.shape) - 1
        columns = {name: c.take(numbers, axis=last) for name, c in self.columns.items()}
        return BatchSolution((*self.shape[:-1], len(numbers)), self.y, columns)

    def with_axis_moved(self, source: int, target: int) -> BatchSolution:
        """Return the contacts with a leading axis moved to another position."""
        axes = len(self.shape)
        order = list(range(axes))
        order.insert(target, order.pop(source))
        columns = {
            name: np.ascontiguousarray(c.transpose(*order, *range(axes, c.ndim)))
            for name, c in self.columns.items()
        }
        return BatchSolution(tuple(self.shape[axis] for axis in order), self.y, columns)

    def joined_with(self, *others: BatchSolution) -> BatchSolution:
        """Return these contacts followed by others along the last leading axis."""
        last, parts = len(self.shape) - 1, (self, *others)
        columns = {
            name: np.concatenate([part.columns[name] for part in parts], axis=last)
            for name in self.columns
        }
        count = sum(part.shape[-1] for part in parts)
        return BatchSolution((*self.shape[:-1], count), self.y, columns)

    def with_others(self, numbers: IntArray, others: BatchSolution) -> BatchSolution:
        """Return these contacts with others at some indices of the last leading axis."""
        order = np.arange(self.shape[-1])
        order[numbers] = len(order) + np.arange(len(numbers))
        return self.joined_with(others).at(order)


_COLUMNS = tuple(item.name for item in fields(ContactSolution) if item.name != "y")


def rows_of(contacts: Sequence[ContactSolution], name: str) -> npt.NDArray[Any]:
    """Return the field `name` of all contacts, first axis contact."""
    if isinstance(contacts, BatchSolution):
        values = contacts.stack(name)
        return values.reshape(-1, *values.shape[len(contacts.shape) :])
    return np.array([getattr(contact, name) for contact in contacts])
