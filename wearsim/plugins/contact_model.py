"""The protocol of contact models."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import numpy as np

from wearsim.contact_batch import BatchSolution
from wearsim.errors import CapabilityError, ContactError
from wearsim.plugins.capabilities import Capabilities, PassLoop
from wearsim.plugins.shared_wear import SharedWear
from wearsim.types import (
    ContactFields,
    ContactSolution,
    FloatArray,
    Grid,
    Material,
    OperatingPoint,
)


class ContactModel(ABC):
    """Turns a gap profile and an operating point into strips.

    Body 1 is the cylinder, body 2 the roller. The undeformed gap at (x, y) is
    ``longitudinal_curvature * x**2 / 2 + gap(y)``; x points along rolling, so that the leading edge
    of a strip lies at x = +a(y). Tractions act on body 1, whose rigid slip per unit of rolling
    velocity is ``(xi - phi y, eta + phi x)``. Hence P = -V (xi F_x + eta F_y + phi M_z), and both
    sides are positive.
    """

    capabilities = Capabilities()

    @abstractmethod
    def prepare(self, grid: Grid, materials: tuple[Material, Material]) -> None:
        """Take the strips and the two bodies' materials; called once, before any `solve`."""

    @abstractmethod
    def solve(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        wear_compliance: FloatArray | None = None,
        warm: ContactSolution | None = None,
    ) -> ContactSolution:
        """Solve one contact.

        Parameters
        ----------
        gap : ndarray, shape (strips,)
            Gap of the undeformed bodies at x = 0 [m]; its zero is arbitrary.
        longitudinal_curvature : float
            Relative curvature along rolling, 1/R_1 + 1/R_2 [1/m].
        point : OperatingPoint
            Load, velocity, creepage and friction.
        wear_compliance : ndarray, shape (strips,), optional
            Gap that opens per unit of line load while the contact carries it [m/(N/m)]: the gap
            in contact is ``gap + wear_compliance * q``.
        warm : ContactSolution, optional
            A solution nearby to start from.

        Returns
        -------
        ContactSolution

        Raises
        ------
        ContactError
            If contact is lost or reaches beyond the strips, the solver does not converge or a
            value is not finite.
        CapabilityError
            If something is asked that `capabilities` do not claim.
        """

    def solve_coupled(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        points: Sequence[OperatingPoint],
        wear: SharedWear,
        warm: Sequence[ContactSolution] | None = None,
    ) -> Sequence[ContactSolution]:
        """Solve several contacts that wear bodies they share, by what they carry in the end.

        Parameters
        ----------
        gap : ndarray, shape (contacts, strips)
            Gap of each contact [m].
        longitudinal_curvature : float
            Relative curvature along rolling [1/m].
        points : sequence of OperatingPoint
            One per contact.
        wear : SharedWear
            Who wears which body, and how much per unit of line load.
        warm : sequence of ContactSolution, optional
            Solutions nearby to start from.

        Returns
        -------
        sequence of ContactSolution

        Raises
        ------
        ContactError
            As `solve`.
        CapabilityError
            If there are several contacts and the model solves one at a time.
        """
        if len(points) == 1:
            first = warm[0] if warm is not None else None
            own = wear.total[0]
            return [self.solve(gap[0], longitudinal_curvature, points[0], own, first)]
        raise CapabilityError(
            f"{type(self).__name__} solves one contact at a time, and rollers that differ share the"
            " cylinder's wear; use evolution.stepper = 'stabilised' or 'per-pass'"
        )

    def solve_coupled_batch(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        points: Sequence[OperatingPoint],
        wear: SharedWear,
        warm: Sequence[ContactSolution] | None = None,
    ) -> Sequence[ContactSolution]:
        """Solve many sets of contacts as `solve_coupled` does one; by default one after another.

        Parameters
        ----------
        gap : ndarray, shape (sets, contacts, strips)
            Gap of each contact [m].
        longitudinal_curvature : float
            Relative curvature along rolling [1/m].
        points : sequence of OperatingPoint
            One per contact, set by set.
        wear : SharedWear
            Its compliance has the axis of the sets first.
        warm : sequence of ContactSolution, optional
            Solutions nearby, in the order of `points`.

        Returns
        -------
        sequence of ContactSolution
            In the order of `points`.

        Raises
        ------
        ContactError, CapabilityError
            As `solve_coupled`, of the first set that fails.
        """
        found: list[ContactSolution] = []
        for k, gaps in enumerate(gap):
            own = slice(k * len(gaps), (k + 1) * len(gaps))
            start = None if warm is None else warm[own]
            found += self.solve_coupled(
                gaps, longitudinal_curvature, points[own], wear.at(k), start
            )
        return found

    def solve_batch(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        points: Sequence[OperatingPoint],
        wear_compliance: FloatArray | None = None,
        warm: Sequence[ContactSolution] | None = None,
    ) -> BatchSolution:
        """Solve many independent contacts; by default one after another.

        Parameters
        ----------
        gap : ndarray, shape (stations, rollers, realisations, strips)
            Gap of each contact [m]; an axis along which all are the same may have stride 0.
        longitudinal_curvature : float
            Relative curvature along rolling [1/m].
        points : sequence of OperatingPoint
            One per contact, in the order of `gap` with its last leading axis fastest. For thousands
            of contacts, `OperatingPoints` holds them as columns.
        wear_compliance : ndarray, shape as `gap`, optional
            As in `solve`.
        warm : sequence of ContactSolution, optional
            Solutions nearby, in the order of `points`.

        Returns
        -------
        BatchSolution

        Raises
        ------
        ContactError
            As `solve`, of the first contact that fails; it names the contact.
        """
        shape = gap.shape[:-1]
        if len(points) != int(np.prod(shape)):
            raise ValueError(f"{len(points)} operating points for a batch of shape {shape}")
        gaps = gap.reshape(-1, gap.shape[-1])
        compliances = None if wear_compliance is None else wear_compliance.reshape(gaps.shape)
        solutions = []
        for k in range(len(gaps)):
            compliance = None if compliances is None else compliances[k]
            start = None if warm is None else warm[k]
            try:
                found = self.solve(gaps[k], longitudinal_curvature, points[k], compliance, start)
            except ContactError as error:
                raise naming_contact(error, k, shape) from error
            solutions.append(found)
        return BatchSolution.of(shape, solutions)

    def friction_points(
        self, gap: FloatArray, longitudinal_curvature: float, point: OperatingPoint
    ) -> tuple[FloatArray, FloatArray]:
        """Return where friction is asked for; only where `capabilities.friction_field`.

        Parameters
        ----------
        gap, longitudinal_curvature, point
            As in `solve`; the friction of `point` counts for nothing yet.

        Returns
        -------
        x : ndarray, shape (points, strips)
            Position along rolling, from the leading edge on [m]; 0 outside the contact.
        y : ndarray, shape (strips,)
            Axial position [m].
        """
        raise CapabilityError(
            f"{type(self).__name__} takes no friction that differs from point to point; use"
            " contact.model = 'hertz-fastsim'"
        )

    def friction_points_batch(
        self, gap: FloatArray, longitudinal_curvature: float, points: Sequence[OperatingPoint]
    ) -> tuple[FloatArray, FloatArray]:
        """Return `friction_points` of every contact of a batch, by default one after another.

        Parameters
        ----------
        gap, longitudinal_curvature, points
            As in `solve_batch`.

        Returns
        -------
        x : ndarray, shape (contacts, points, strips)
            As of `friction_points`.
        y : ndarray, shape (strips,)
            Axial position [m].
        """
        gaps = gap.reshape(-1, gap.shape[-1])
        found = [
            self.friction_points(gaps[k], longitudinal_curvature, points[k])
            for k in range(len(gaps))
        ]
        return np.array([x for x, _ in found]), found[0][1]

    def suggest_grid(
        self,
        gap_curvature: float,
        longitudinal_curvature: float,
        normal_force: float,
        materials: tuple[Material, Material],
    ) -> Grid | None:
        """Return the strips that suit one contact of a fresh profile centred on y = 0, if any.

        `gap_curvature` is the relative curvature across the track [1/m].
        """
        return None

    def fields(
        self,
        solution: ContactSolution,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        points_along: int = 101,
    ) -> ContactFields:
        """Return tractions and slip inside a solved contact; only where `capabilities.fields`."""
        raise CapabilityError(f"{type(self).__name__} gives no fields inside the contact")

    def pass_loop(self, loop: PassLoop) -> int:
        """Run roller passes in compiled code, where `capabilities.pass_loop`.

        Returns
        -------
        int
            How many of the passes were solved in full, from no factorisation in use.
        """
        raise CapabilityError(f"{type(self).__name__} has no compiled per-pass loop")


def naming_contact(error: ContactError, number: int, shape: tuple[int, ...]) -> ContactError:
    """Return an error that says which contact of a batch it befell.

    Parameters
    ----------
    error : ContactError
        What went wrong.
    number : int
        The contact, in the order of the batch.
    shape : tuple of int
        The batch's leading axes, the last three of them station, contact and realisation.
    """
    place = [int(i) for i in np.unravel_index(number, shape)]
    axes = ("station", "contact", "realisation")[-len(shape) :]
    parts = [f"{axis} {i}" for axis, i, n in zip(axes, place, shape, strict=True) if n > 1]
    text = f"{', '.join(parts)}: {error}" if parts else str(error)
    return ContactError(text, error.state | {"contact": place})
