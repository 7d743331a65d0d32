"""Batches of contacts as columns: inputs, solutions, and wear of common bodies."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache
from typing import Any, TypeVar

import numpy as np

from wearsim.types import ContactSolution, Creepage, FloatArray, IntArray, OperatingPoint

T = TypeVar("T")
NO_BODY = -1


@dataclass(frozen=True, eq=False)
class ContactBatch:
    """Contacts to be solved in one call, on the same strips.

    All arrays have the contacts as first axis. An array that is equal for all contacts may have
    stride 0 along it.

    Parameters
    ----------
    gap : ndarray, shape (contacts, strips)
        Gap of the undeformed bodies at x = 0 [m]; its zero is arbitrary.
    longitudinal_curvature : ndarray, shape (contacts,)
        Relative curvature along rolling, 1/R_1 + 1/R_2 [1/m].
    normal_force, rolling_speed : ndarray, shape (contacts,)
        Load N [N] and rolling velocity V [m/s].
    longitudinal, lateral, spin : ndarray, shape (contacts,)
        Longitudinal and lateral creepage, and spin [1/m], as in `Creepage`.
    friction : ndarray, shape (contacts,), (contacts, strips) or (contacts, points, strips)
        Friction coefficient, as in `OperatingPoint`.
    variation : ndarray, shape (contacts, strips), optional
        Variation of the longitudinal creepage, as in `Creepage`.
    bearing_torque : ndarray, shape (contacts,), optional
        Torque of the roller's bearing [N m], as in `OperatingPoint`.
    rolling_radius : ndarray, shape (contacts, strips), optional
        Lever arm of the longitudinal traction [m]; required with a bearing torque.
    friction_carried : bool
        As in `OperatingPoint`.
    shape : tuple of int, optional
        Numbers of stations, contacts and realisations that the contacts run through, the last
        fastest; error messages then name a contact by these indices.
    """

    gap: FloatArray
    longitudinal_curvature: FloatArray
    normal_force: FloatArray
    rolling_speed: FloatArray
    longitudinal: FloatArray
    lateral: FloatArray
    spin: FloatArray
    friction: FloatArray
    variation: FloatArray | None = None
    bearing_torque: FloatArray | None = None
    rolling_radius: FloatArray | None = None
    friction_carried: bool = False
    shape: tuple[int, ...] | None = None

    def __post_init__(self) -> None:
        count, values = len(self.gap), self.__dict__
        for name in _INPUTS:
            array = values[name]
            if array is not None and len(array) != count:
                raise ValueError(
                    f"{name} has {len(array)} values for {count} contacts; expected one each"
                )

    @classmethod
    def of(
        cls, gap: FloatArray, longitudinal_curvature: float, points: Sequence[OperatingPoint]
    ) -> ContactBatch:
        """Return contacts that differ in gap and operating point as a batch.

        Parameters
        ----------
        gap : ndarray, shape (contacts, strips)
            Gap of each contact [m].
        longitudinal_curvature : float
            Relative curvature along rolling [1/m].
        points : sequence of OperatingPoint
            One per contact. All or none give a variation of the creepage, a bearing torque and
            carried friction, and all give their friction in the same shape.

        Raises
        ------
        ValueError
            If the points are not of one kind, or are not as many as the gaps.
        """
        creepages, first = [point.creepage for point in points], points[0]
        if len(points) > 1 and len({_kind(point) for point in points}) > 1:
            raise ValueError(
                "the operating points of a batch differ in the shape of their friction, or in"
                " whether they have a variation of the creepage, a bearing torque or carried"
                " friction; solve them in a batch of each kind"
            )
        forces, speeds, longitudinal, lateral, spins = np.array(
            [
                [point.normal_force for point in points],
                [point.rolling_speed for point in points],
                [creepage.longitudinal for creepage in creepages],
                [creepage.lateral for creepage in creepages],
                [creepage.spin for creepage in creepages],
            ],
            dtype=np.float64,
        )
        return cls(
            gap=gap,
            longitudinal_curvature=np.array([longitudinal_curvature] * len(points), np.float64),
            normal_force=forces,
            rolling_speed=speeds,
            longitudinal=longitudinal,
            lateral=lateral,
            spin=spins,
            friction=np.array([point.friction for point in points], dtype=np.float64),
            variation=_rows([creepage.variation for creepage in creepages]),
            bearing_torque=_rows([point.bearing_torque for point in points]),
            rolling_radius=_rows([point.rolling_radius for point in points]),
            friction_carried=first.friction_carried,
        )

    def __len__(self) -> int:
        return len(self.gap)

    def replaced(self, **others: Any) -> ContactBatch:
        """Return the contacts with arrays of the same length, in a tenth of the time of `replace`.

        The arrays are not checked.
        """
        return _unchecked(ContactBatch, self.__dict__ | others)

    def at(self, numbers: IntArray) -> ContactBatch:
        """Return some of the contacts, by number and in that order."""
        arrays = {name: getattr(self, name) for name in _INPUTS}
        some = {name: array[numbers] for name, array in arrays.items() if array is not None}
        return replace(self, **some, shape=None)

    def point(self, number: int) -> OperatingPoint:
        """Return the operating point of one contact."""
        friction, torque = self.friction[number], self.bearing_torque
        variation, radius = self.variation, self.rolling_radius
        return OperatingPoint(
            normal_force=float(self.normal_force[number]),
            rolling_speed=float(self.rolling_speed[number]),
            creepage=Creepage(
                float(self.longitudinal[number]),
                float(self.lateral[number]),
                float(self.spin[number]),
                None if variation is None else variation[number],
            ),
            friction=float(friction) if self.friction.ndim == 1 else friction,
            bearing_torque=None if torque is None else float(torque[number]),
            rolling_radius=None if radius is None else radius[number],
            friction_carried=self.friction_carried,
        )

    def place(self, number: int) -> tuple[list[int], str]:
        """Return the indices of one contact along `shape`, and their description."""
        shape = self.shape or (len(self),)
        axes = ("station", "contact", "realisation") if self.shape else ("contact",)
        indices = [int(i) for i in np.unravel_index(number, shape)]
        axis_places = zip(axes[-len(shape) :], indices, shape, strict=True)
        return indices, ", ".join(f"{axis} {i}" for axis, i, length in axis_places if length > 1)


def _unchecked(kind: type[T], values: Mapping[str, Any]) -> T:
    """Return an object with given attributes, without the assignments of a frozen dataclass."""
    unchecked = object.__new__(kind)
    unchecked.__dict__.update(values)
    return unchecked


def _kind(point: OperatingPoint) -> tuple[object, ...]:
    """Return the shape of a point's friction and which optional inputs the point has."""
    return (
        np.shape(point.friction),
        point.friction_carried,
        point.creepage.variation is None,
        point.bearing_torque is None,
        point.rolling_radius is None,
    )


def _rows(values: Sequence[float | FloatArray | None]) -> FloatArray | None:
    """Return the values of all contacts as an array, or None if they have none."""
    return None if values[0] is None else np.array(values, dtype=np.float64)


_INPUTS = tuple(
    item.name for item in fields(ContactBatch) if item.name not in {"friction_carried", "shape"}
)


@dataclass(frozen=True, eq=False)
class ContactBatchSolution:
    """Solutions of a batch of contacts: the fields of `ContactSolution` as arrays over contacts.

    Parameters
    ----------
    y : ndarray, shape (strips,)
        Axial position of the strips [m], the same for all contacts.
    half_length, line_load, dissipation : ndarray, shape (contacts, strips)
        As in `ContactSolution`.
    force_x, force_y, spin_moment, approach, peak_pressure : ndarray, shape (contacts,)
        As in `ContactSolution`.
    adhesion_fraction, power, longitudinal_creepage : ndarray, shape (contacts,)
        As in `ContactSolution`.
    iterations : ndarray of int, shape (contacts,)
        As in `ContactSolution`.
    separation : ndarray, shape (contacts, strips), optional
        Distance between the deformed surfaces in strips without load, 0 in the others [m]. With a
        model that returns it, implicit steps resolve the edge of a contact within a strip.
    """

    y: FloatArray
    half_length: FloatArray
    line_load: FloatArray
    dissipation: FloatArray
    force_x: FloatArray
    force_y: FloatArray
    spin_moment: FloatArray
    approach: FloatArray
    peak_pressure: FloatArray
    adhesion_fraction: FloatArray
    power: FloatArray
    longitudinal_creepage: FloatArray
    iterations: IntArray
    separation: FloatArray | None = None

    @classmethod
    def of_columns(cls, values: Mapping[str, Any]) -> ContactBatchSolution:
        """Return solutions with all fields given, in a fifth of the time of the constructor."""
        return _unchecked(cls, values)

    @classmethod
    def of(cls, solutions: Sequence[ContactSolution]) -> ContactBatchSolution:
        """Return single solutions on the same strips as a batch."""
        if len(solutions) == 1:  # in a third of the time, without copies
            values = vars(solutions[0])
            return cls(values["y"], *(np.asarray(values[name])[None] for name in _OUTPUTS))
        columns = {n: np.array([getattr(solution, n) for solution in solutions]) for n in _OUTPUTS}
        return cls(y=solutions[0].y, **columns)

    def __len__(self) -> int:
        return len(self.power)

    def __getitem__(self, number: int) -> ContactSolution:
        """Return the solution of one contact."""
        columns = [getattr(self, name) for name in _OUTPUTS]
        values = [c[number] if c.ndim > 1 else c.item(number) for c in columns]
        return ContactSolution(self.y, *values)

    def __iter__(self) -> Iterator[ContactSolution]:
        return (self[number] for number in range(len(self)))

    def at(self, numbers: IntArray) -> ContactBatchSolution:
        """Return some of the solutions, by number and in that order."""
        apart = None if self.separation is None else self.separation[numbers]
        columns = {name: getattr(self, name)[numbers] for name in _OUTPUTS}
        return ContactBatchSolution(self.y, **columns, separation=apart)

    def with_others(self, numbers: IntArray, others: ContactBatchSolution) -> ContactBatchSolution:
        """Return these solutions with others at some numbers."""
        both = self.separation is not None and others.separation is not None
        names = (*_OUTPUTS, "separation") if both else _OUTPUTS
        copied = np.empty_like if numbers.size == len(self) else np.copy
        columns = {name: copied(getattr(self, name)) for name in names}
        for name, column in columns.items():
            column[numbers] = getattr(others, name)
        return ContactBatchSolution(self.y, **columns)

    def joined_with(self, *others: ContactBatchSolution, rows: int) -> ContactBatchSolution:
        """Return these solutions joined with others row by row, all divided into equal `rows`."""
        joined, fields = {}, [part.__dict__ for part in (self, *others)]
        apart = [values["separation"] is not None for values in fields]
        for name in (*_OUTPUTS, "separation") if all(apart) else _OUTPUTS:
            columns = [values[name] for values in fields]
            if rows > 1:
                columns = [column.reshape(rows, -1, *column.shape[1:]) for column in columns]
            whole = np.concatenate(columns, axis=int(rows > 1))
            joined[name] = whole.reshape(-1, *whole.shape[2:]) if rows > 1 else whole
        return ContactBatchSolution(self.y, **joined)


_OUTPUTS = tuple(
    item.name for item in fields(ContactBatchSolution) if item.name not in {"y", "separation"}
)


@dataclass(frozen=True)
class SharedWear:
    """Wear compliance of several contacts on the bodies that they have in common.

    Each contact touches two bodies, and the wear of a body opens the gaps of all contacts that
    touch it. The gap of contact k is

        gap[k] + sum over its bodies b of sum_l compliance[l, side of b] * line_load[l],

    where the inner sum is over the contacts l that touch b.

    Parameters
    ----------
    bodies : ndarray of int, shape (contacts, 2)
        Number of the cylinder's station and number of the roller of each contact; the columns are
        numbered independently.
    compliance : ndarray, shape (contacts, 2, strips)
        Depth that a contact wears off each of its bodies per unit of line load [m/(N/m)]. A
        leading axis may count independent sets of such contacts, which follow one another in a
        `ContactBatch`.
    """

    bodies: IntArray
    compliance: FloatArray

    def at(self, numbers: int | IntArray) -> SharedWear:
        """Return the wear of one set of contacts, or of several sets."""
        return SharedWear(self.bodies, self.compliance[numbers])

    @property
    def total(self) -> FloatArray:
        """Increase of each contact's gap by its wear per unit of line load, (contacts, strips)."""
        return np.asarray(self.compliance.sum(axis=-2))

    def opening(self, line_load: FloatArray) -> FloatArray:
        """Return the gap that line loads, (contacts, strips), open at each contact [m]."""
        if len(self.bodies) == 1:
            return np.asarray((self.compliance * line_load[..., None, :]).sum(axis=-2))
        gap = np.zeros_like(line_load)
        for side in (0, 1):
            worn = self.compliance[..., side, :] * line_load
            if not np.count_nonzero(worn):
                continue
            numbers: list[int] = self.bodies[:, side].tolist()
            depth: dict[int, FloatArray] = {}
            for contact, number in enumerate(numbers):
                of_contact = worn[..., contact, :]
                depth[number] = depth[number] + of_contact if number in depth else of_contact
            for contact, number in enumerate(numbers):
                gap[..., contact, :] += depth[number]
        return gap

    @cached_property
    def groups(self) -> list[tuple[IntArray, FloatArray, IntArray, FloatArray]]:
        """Equivalent wear with the smallest number of shared bodies, by the bodies that wear.

        A body touched by one contact only becomes a compliance of that contact; a cylinder and a
        roller touched by the same contacts become one body; a body that does not wear is dropped.

        Returns
        -------
        list of (numbers, own, members, shared)
            Numbers of the sets of a group; compliance of separate contacts, (sets, contacts,
            strips); numbers of the shared bodies of each contact, counted over both columns, or
            -1, (contacts, 2); and its wear of them, (sets, contacts, 2, strips).
        """
        bodies, contacts = self.bodies.tobytes(), len(self.bodies)
        wear = self.compliance.reshape(-1, *self.compliance.shape[-3:])
        if contacts == 1:
            alone = np.full((1, 2), NO_BODY)
            return [(np.arange(len(wear)), wear.sum(axis=2), alone, np.zeros_like(wear))]
        if _merged(bodies, contacts):
            both = wear.sum(axis=2)
            wear = np.stack([both, np.zeros_like(both)], axis=2)
        # counted for a single set, since any() takes ten times as long on short arrays
        if len(wear) == 1:
            kinds = [(not np.count_nonzero(wear[:, :, 0]), not np.count_nonzero(wear[:, :, 1]))]
        else:
            idle = np.logical_not(wear.any(axis=(1, 3)))
            kinds = [(left, right) for left, right in idle.tolist()]
        groups = []
        for kind in sorted(set(kinds)):
            numbers = np.array([number for number, other in enumerate(kinds) if other == kind])
            part = wear if len(numbers) == len(wear) else wear[numbers]
            members = _membership(bodies, contacts, kind)
            separate, shared = np.zeros((len(part), contacts, part.shape[-1])), part.copy()
            for side in (0, 1):
                alone = members[:, side] == NO_BODY
                if not kind[side] and np.count_nonzero(alone):  # an idle body's wear is zero
                    separate[:, alone] += part[:, alone, side]
                    shared[:, alone, side] = 0.0
            groups.append((numbers, separate, members, shared))
        return groups


@lru_cache(maxsize=64)
def _merged(bodies: bytes, contacts: int) -> bool:
    """Return whether both columns of `bodies` group the contacts identically."""
    pairs = np.frombuffer(bodies, dtype=np.int64).reshape(contacts, 2)
    count = len(np.unique(pairs, axis=0))
    return all(len(np.unique(pairs[:, side])) == count for side in (0, 1))


@lru_cache(maxsize=64)
def _membership(bodies: bytes, contacts: int, idle: tuple[bool, bool]) -> IntArray:
    """Return the numbers of the shared bodies of each contact, counted from 0 without gaps.

    Parameters
    ----------
    bodies : bytes
        The array `bodies` of a `SharedWear`.
    contacts : int
        Its length.
    idle : tuple of bool
        Whether the bodies of each column do not wear.
    """
    members = np.frombuffer(bodies, dtype=np.int64).reshape(contacts, 2).copy()
    if _merged(bodies, contacts):
        members[:, 1] = NO_BODY
    for side in (0, 1):
        numbers, place, count = np.unique(members[:, side], return_inverse=True, return_counts=True)
        members[(count == 1)[place] | (numbers[place] == NO_BODY), side] = NO_BODY
    members[:, 1] += (members[:, 0].max() + 1) * (members[:, 1] != NO_BODY)
    members[:, list(idle)] = NO_BODY
    shared = members != NO_BODY
    members[shared] = np.unique(members[shared], return_inverse=True)[1]
    return members
