"""The words every room shares: materials, grids, operating points and contact solutions, in SI."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, TypeAlias, overload

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]
IntArray: TypeAlias = npt.NDArray[np.int64]
BoolArray: TypeAlias = npt.NDArray[np.bool_]
Number: TypeAlias = float | FloatArray
"""One number for all realisations, or one for each, shape (realisations,)."""


@dataclass(frozen=True)
class Material:
    """An isotropic elastic body.

    Parameters
    ----------
    youngs_modulus : float
        Young's modulus [Pa].
    poisson_ratio : float
        Poisson's ratio, 0 to 0.5.
    hardness : float, optional
        Indentation hardness [Pa], for wear laws that need it.
    """

    youngs_modulus: float
    poisson_ratio: float
    hardness: float | None = None


@dataclass(frozen=True)
class Grid:
    """Strips of equal width across the track; `y` holds their centres.

    Parameters
    ----------
    y : ndarray, shape (strips,)
        Axial position of each strip's centre [m], rising, equally spaced.
    spacing : float
        Width of a strip [m].
    """

    y: FloatArray
    spacing: float

    @classmethod
    def spanning(cls, start: float, stop: float, strips: int) -> Grid:
        """Cut the interval from `start` to `stop` [m] into `strips` equal strips."""
        spacing = (stop - start) / strips
        centre = 0.5 * (start + stop)
        # counted from the middle, so that a symmetric interval gives a grid symmetric to the bit
        offsets = np.arange(strips, dtype=np.float64) - 0.5 * (strips - 1)
        return cls(y=centre + offsets * spacing, spacing=spacing)

    @property
    def strips(self) -> int:
        """Number of strips."""
        return len(self.y)


@dataclass(frozen=True)
class Profile:
    """A measured or computed surface height across the track.

    Parameters
    ----------
    y : ndarray, shape (points,)
        Axial position [m], rising.
    height : ndarray, shape (points,)
        Height of the surface above its nominal shape [m]; worn material is negative.
    """

    y: FloatArray
    height: FloatArray


@dataclass(frozen=True)
class Creepage:
    """Rigid slip of body 1 (the cylinder) on body 2 (the roller), per unit of rolling velocity.

    The local longitudinal creepage of a strip is ``longitudinal + g(y) - <g>``, where ``<g>`` is
    the mean of g weighted by the line load, so that `longitudinal` is always the mean creepage of
    the contact. g is `variation` where it is given and ``-spin * y`` otherwise; either way `spin`
    times x is the lateral part that varies along rolling.

    Parameters
    ----------
    longitudinal : float
        Mean longitudinal creepage xi.
    lateral : float
        Lateral creepage eta.
    spin : float
        Spin phi [1/m].
    variation : ndarray, shape (strips,), optional
        Variation g of the longitudinal creepage across the strips, spin's part included.
    """

    longitudinal: float
    lateral: float = 0.0
    spin: float = 0.0
    variation: FloatArray | None = None


@dataclass(frozen=True)
class OperatingPoint:
    """What is asked of one contact.

    Parameters
    ----------
    normal_force : float
        Load N [N].
    rolling_speed : float
        Rolling velocity V [m/s].
    creepage : Creepage
        Prescribed creepage; under a bearing torque its longitudinal value is only a first guess.
    friction : float or ndarray, shape (strips,) or (points, strips)
        Friction coefficient mu: one value, one per strip, or one for each of a strip's points,
        from the leading edge on, which the model names (`ContactModel.friction_points`).
    bearing_torque : float, optional
        Torque [N m] that the contact must carry to the roller's bearing. When given, the mean
        longitudinal creepage follows from the balance of torque.
    rolling_radius : ndarray, shape (strips,), optional
        Arm of each strip's longitudinal traction about the roller's axis [m]; needed with a
        bearing torque.
    friction_carried : bool
        Each of a strip's points is a particle that keeps its friction while it crosses the contact,
        as where the pattern is fixed to a body; what is solved is the mean over the particles.
    """

    normal_force: float
    rolling_speed: float
    creepage: Creepage
    friction: float | FloatArray
    bearing_torque: float | None = None
    rolling_radius: FloatArray | None = None
    friction_carried: bool = False

    @property
    def kind(self) -> tuple[object, ...]:
        """What points must have in common to be columns of `OperatingPoints`."""
        return (
            self.rolling_speed,
            self.bearing_torque,
            np.shape(self.friction),
            self.friction_carried,
            self.creepage.variation is None,
        )


@dataclass(frozen=True)
class OperatingPoints(Sequence[OperatingPoint]):
    """Many operating points without a bearing torque, as columns; a sequence of `OperatingPoint`.

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
        for name in ("longitudinal", "lateral", "spin", "friction", "variation"):
            column = getattr(self, name)
            if column is not None and len(column) != count:
                raise ValueError(
                    f"{name} has {len(column)} values for {count} contacts; give every contact one"
                )

    @classmethod
    def of(cls, points: Sequence[OperatingPoint]) -> OperatingPoints | None:
        """Return `points` as columns, or None where they are not all of one kind."""
        if isinstance(points, cls):
            return points
        if not points or points[0].bearing_torque is not None:
            return None
        if len(points) > 1 and len({point.kind for point in points}) > 1:
            return None
        creepages = [point.creepage for point in points]
        plain = creepages[0].variation is None
        return cls(
            normal_force=np.array([point.normal_force for point in points], dtype=np.float64),
            longitudinal=np.array([creepage.longitudinal for creepage in creepages]),
            lateral=np.array([creepage.lateral for creepage in creepages]),
            spin=np.array([creepage.spin for creepage in creepages]),
            friction=np.array([point.friction for point in points]),
            rolling_speed=points[0].rolling_speed,
            variation=None if plain else np.array([item.variation for item in creepages]),
            friction_carried=points[0].friction_carried,
        )

    def __len__(self) -> int:
        return len(self.normal_force)

    def at(self, numbers: IntArray) -> OperatingPoints:
        """Return some of the points, by number and in that order."""
        names = ("normal_force", "longitudinal", "lateral", "spin", "friction", "variation")
        columns = {n: getattr(self, n) for n in names}
        return replace(self, **{n: c[numbers] for n, c in columns.items() if c is not None})

    @overload
    def __getitem__(self, index: int) -> OperatingPoint: ...

    @overload
    def __getitem__(self, index: slice) -> OperatingPoints: ...

    def __getitem__(self, index: int | slice) -> OperatingPoint | OperatingPoints:
        variation = None if self.variation is None else self.variation[index]
        if isinstance(index, slice):
            names = ("normal_force", "longitudinal", "lateral", "spin", "friction")
            columns = {name: getattr(self, name)[index] for name in names}
            return replace(self, **columns, variation=variation)
        friction = self.friction[index]
        return OperatingPoint(
            normal_force=float(self.normal_force[index]),
            rolling_speed=self.rolling_speed,
            creepage=Creepage(
                float(self.longitudinal[index]),
                float(self.lateral[index]),
                float(self.spin[index]),
                variation,
            ),
            friction=float(friction) if self.friction.ndim == 1 else friction,
            friction_carried=self.friction_carried,
        )


@dataclass(frozen=True)
class ContactSolution:
    """One solved contact, strip by strip; tractions act on body 1 and oppose positive creepage.

    Parameters
    ----------
    y : ndarray, shape (strips,)
        Axial position of the strips [m].
    half_length : ndarray, shape (strips,)
        Half-length a(y) of the contact along rolling [m]; 0 outside it.
    line_load : ndarray, shape (strips,)
        Normal force per unit of axial length q(y) [N/m].
    dissipation : ndarray, shape (strips,)
        Dissipated power per unit of axial length P_l(y) [W/m].
    force_x, force_y : float
        Longitudinal and lateral force on body 1 [N].
    spin_moment : float
        Moment of the tractions on body 1 about the contact normal through the load's centre [N m].
    approach : float
        Approach of the bodies delta, measured from gap zero [m].
    peak_pressure : float
        Greatest normal pressure [Pa].
    adhesion_fraction : float
        Part of the contact's area that adheres, 0 to 1.
    power : float
        Dissipated power P_d, the sum of `dissipation` over the strips [W].
    longitudinal_creepage : float
        Mean longitudinal creepage, found by torque balance where a bearing torque is given.
    iterations : int
        Iterations the normal problem took.
    """

    y: FloatArray
    half_length: FloatArray
    line_load: FloatArray
    dissipation: FloatArray
    force_x: float
    force_y: float
    spin_moment: float
    approach: float
    peak_pressure: float
    adhesion_fraction: float
    power: float
    longitudinal_creepage: float
    iterations: int


@dataclass(frozen=True)
class ContactFields:
    """The inside of one contact, on points that follow each strip from trailing to leading edge.

    Parameters
    ----------
    x : ndarray, shape (points, strips)
        Position along rolling [m].
    y : ndarray, shape (strips,)
        Axial position [m].
    pressure, traction_x, traction_y : ndarray, shape (points, strips)
        Normal pressure and tangential traction on body 1 [Pa].
    slip_x, slip_y : ndarray, shape (points, strips)
        Slip of body 1 on body 2 per unit of rolling velocity.
    adhesion : ndarray of bool, shape (points, strips)
        Where the surfaces adhere.
    power_density : ndarray, shape (points, strips)
        Dissipated power per unit of area [W/m^2].
    """

    x: FloatArray
    y: FloatArray
    pressure: FloatArray
    traction_x: FloatArray
    traction_y: FloatArray
    slip_x: FloatArray
    slip_y: FloatArray
    adhesion: BoolArray
    power_density: FloatArray


@dataclass(frozen=True, eq=False)
class BatchSolution(Sequence[ContactSolution]):
    """Many solved contacts, column by column; a sequence of them one by one, last axis fastest.

    Parameters
    ----------
    shape : tuple of int
        Leading axes: (station, roller, realisation).
    y : ndarray, shape (strips,)
        Axial position of the strips [m], the same for all contacts.
    columns : mapping of str to ndarray
        The other fields of `ContactSolution`, each with the leading axes first.
    """

    shape: tuple[int, ...]
    y: FloatArray
    columns: Mapping[str, npt.NDArray[Any]]

    @classmethod
    def of(cls, shape: tuple[int, ...], solutions: Sequence[ContactSolution]) -> BatchSolution:
        """Gather contacts that were solved one after another, last axis fastest."""
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
        """The contacts one by one, last axis fastest."""
        axes = len(self.shape)
        # to lists where a contact has one number, so that it is a plain one of Python's
        flat = [
            self.columns[name].ravel().tolist()
            if self.columns[name].ndim == axes
            else self.columns[name].reshape(-1, len(self.y))
            for name in _COLUMNS
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
        """Return the contacts at some places of the last leading axis, in that order."""
        last = len(self.shape) - 1
        columns = {name: c.take(numbers, axis=last) for name, c in self.columns.items()}
        return BatchSolution((*self.shape[:-1], len(numbers)), self.y, columns)

    def with_axis_moved(self, source: int, target: int) -> BatchSolution:
        """Return the contacts in another order, with a leading axis at another place."""
        axes = len(self.shape)
        order = list(range(axes))
        order.insert(target, order.pop(source))
        columns = {
            name: np.ascontiguousarray(c.transpose(*order, *range(axes, c.ndim)))
            for name, c in self.columns.items()
        }
        return BatchSolution(tuple(self.shape[axis] for axis in order), self.y, columns)

    def joined_with(self, *others: BatchSolution) -> BatchSolution:
        """Return these contacts and others behind them along the last leading axis."""
        last, parts = len(self.shape) - 1, (self, *others)
        columns = {
            name: np.concatenate([part.columns[name] for part in parts], axis=last)
            for name in self.columns
        }
        count = sum(part.shape[-1] for part in parts)
        return BatchSolution((*self.shape[:-1], count), self.y, columns)

    def with_others(self, numbers: IntArray, others: BatchSolution) -> BatchSolution:
        """Return these contacts with others at some places of the last leading axis."""
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
