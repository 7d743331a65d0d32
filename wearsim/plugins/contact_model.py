"""Base class of contact models."""

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
    """Solver of the contact of two bodies for a gap profile and an operating point.

    Body 1 is the cylinder, body 2 the roller. The undeformed gap at (x, y) is
    ``longitudinal_curvature * x**2 / 2 + gap(y)``; x points along rolling, so that the leading edge
    of a strip is at x = +a(y). Tractions act on body 1, whose rigid slip per unit of rolling
    velocity is ``(xi - phi y, eta + phi x)``. Hence P = -V (xi F_x + eta F_y + phi M_z), which is
    not negative.
    """

    capabilities = Capabilities()

    @abstractmethod
    def prepare(self, grid: Grid, materials: tuple[Material, Material]) -> None:
        """Set the strips and the materials of both bodies; called once, before any `solve`."""

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
            Gap that wear opens per unit of line load q [m/(N/m)]: the contact is solved on the
            gap ``gap + wear_compliance * q``.
        warm : ContactSolution, optional
            Solution of a similar contact, as the initial guess.

        Returns
        -------
        ContactSolution

        Raises
        ------
        ContactError
            If contact is lost or extends beyond the strips, the solver does not converge or a
            value is not finite.
        CapabilityError
            If the arguments require a capability that the model does not have.
        """

    def solve_coupled(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        points: Sequence[OperatingPoint],
        wear: SharedWear,
        warm: Sequence[ContactSolution] | None = None,
    ) -> Sequence[ContactSolution]:
        """Solve several contacts that wear common bodies in proportion to their line loads.

        Parameters
        ----------
        gap : ndarray, shape (contacts, strips)
            Gap of each contact [m].
        longitudinal_curvature : float
            Relative curvature along rolling [1/m].
        points : sequence of OperatingPoint
            One per contact.
        wear : SharedWear
            Bodies of each contact, and their wear per unit of line load.
        warm : sequence of ContactSolution, optional
            Solutions of similar contacts, as the initial guess.

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
        if len(points) != 1:
            raise CapabilityError(
                f"{type(self).__name__} solves one contact at a time, and rollers that differ are"
                " coupled by the wear of the cylinder; use evolution.stepper = 'stabilised' or"
                " 'per-pass'"
            )
        return [
            self.solve(
                gap[0],
                longitudinal_curvature,
                points[0],
                wear.total[0],
                None if warm is None else warm[0],
            )
        ]

    def solve_coupled_batch(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        points: Sequence[OperatingPoint],
        wear: SharedWear,
        warm: Sequence[ContactSolution] | None = None,
    ) -> Sequence[ContactSolution]:
        """Solve many sets of contacts as by `solve_coupled`; by default one set after another.

        Parameters
        ----------
        gap : ndarray, shape (sets, contacts, strips)
            Gap of each contact [m].
        longitudinal_curvature : float
            Relative curvature along rolling [1/m].
        points : sequence of OperatingPoint
            One per contact, set after set.
        wear : SharedWear
            As in `solve_coupled`, with a compliance of shape (sets, contacts, 2, strips).
        warm : sequence of ContactSolution, optional
            Initial guess, in the order of `points`.

        Returns
        -------
        sequence of ContactSolution
            In the order of `points`.

        Raises
        ------
        ContactError, CapabilityError
            As `solve_coupled`, of the first set that fails.
        """
        solutions: list[ContactSolution] = []
        for k, gaps in enumerate(gap):
            own = slice(k * len(gaps), (k + 1) * len(gaps))
            start = None if warm is None else warm[own]
            solutions += self.solve_coupled(
                gaps, longitudinal_curvature, points[own], wear.at(k), start
            )
        return solutions

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
            Gap of each contact [m]; an axis along which the gaps are equal may have stride 0.
        longitudinal_curvature : float
            Relative curvature along rolling [1/m].
        points : sequence of OperatingPoint
            One per contact, in the order of `gap`, realisations fastest. `OperatingPoints` stores
            thousands of them as columns.
        wear_compliance : ndarray, shape as `gap`, optional
            As in `solve`.
        warm : sequence of ContactSolution, optional
            Initial guess, in the order of `points`.

        Returns
        -------
        BatchSolution

        Raises
        ------
        ContactError
            As `solve`, of the first contact that fails, with its position in the batch.
        """
        shape = gap.shape[:-1]
        if len(points) != int(np.prod(shape)):
            raise ValueError(f"{len(points)} operating points for a batch of shape {shape}")
        gaps = gap.reshape(-1, gap.shape[-1])
        compliances = None if wear_compliance is None else wear_compliance.reshape(gaps.shape)
        solutions = []
        for k in range(len(gaps)):
            try:
                solutions.append(
                    self.solve(
                        gaps[k],
                        longitudinal_curvature,
                        points[k],
                        None if compliances is None else compliances[k],
                        None if warm is None else warm[k],
                    )
                )
            except ContactError as error:
                raise naming_contact(error, k, shape) from error
        return BatchSolution.of(shape, solutions)

    def friction_points(
        self, gap: FloatArray, longitudinal_curvature: float, point: OperatingPoint
    ) -> tuple[FloatArray, FloatArray]:
        """Return the points at which friction must be given; requires `friction_field`.

        Parameters
        ----------
        gap, longitudinal_curvature, point
            As in `solve`; the friction of `point` is not used.

        Returns
        -------
        x : ndarray, shape (points, strips)
            Position along rolling, starting at the leading edge [m]; 0 outside the contact.
        y : ndarray, shape (strips,)
            Axial position [m].
        """
        raise CapabilityError(
            f"{type(self).__name__} does not support friction that varies from point to point;"
            " use contact.model = 'hertz-fastsim'"
        )

    def friction_points_batch(
        self, gap: FloatArray, longitudinal_curvature: float, points: Sequence[OperatingPoint]
    ) -> tuple[FloatArray, FloatArray]:
        """Return `friction_points` of all contacts of a batch; by default one after another.

        Parameters
        ----------
        gap, longitudinal_curvature, points
            As in `solve_batch`.

        Returns
        -------
        x : ndarray, shape (contacts, points, strips)
            As in `friction_points`.
        y : ndarray, shape (strips,)
            Axial position [m].
        """
        gaps = gap.reshape(-1, gap.shape[-1])
        places = [
            self.friction_points(gaps[k], longitudinal_curvature, points[k])
            for k in range(len(gaps))
        ]
        return np.array([x for x, _ in places]), places[0][1]

    def suggest_grid(
        self,
        gap_curvature: float,
        longitudinal_curvature: float,
        normal_force: float,
        materials: tuple[Material, Material],
    ) -> Grid | None:
        """Return a grid for one contact of unworn bodies centred on y = 0, or None.

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
        """Return pressure, traction and slip in a solved contact; requires `fields`."""
        raise CapabilityError(f"{type(self).__name__} returns no fields inside the contact")

    def pass_loop(self, loop: PassLoop) -> int:
        """Run roller passes in compiled code; requires `pass_loop`.

        Returns
        -------
        int
            Number of passes solved in full, without an earlier factorisation.
        """
        raise CapabilityError(f"{type(self).__name__} has no compiled per-pass loop")


def naming_contact(error: ContactError, number: int, shape: tuple[int, ...]) -> ContactError:
    """Return an error with the position of the contact in its batch.

    Parameters
    ----------
    error : ContactError
        The error of the contact.
    number : int
        Index of the contact in the batch.
    shape : tuple of int
        Leading axes of the batch, the last three being station, contact and realisation.
    """
    place = [int(i) for i in np.unravel_index(number, shape)]
    axes = zip(("station", "contact", "realisation")[-len(shape) :], place, shape, strict=True)
    parts = [f"{axis} {i}" for axis, i, length in axes if length > 1]
    text = f"{', '.join(parts)}: {error}" if parts else str(error)
    return ContactError(text, error.state | {"contact": place})


def refuse_unclaimed(
    model: ContactModel, point: OperatingPoint, wear_compliance: FloatArray | None = None
) -> None:
    """Raise an error if a problem requires a capability that a contact model does not have.

    Parameters
    ----------
    model : ContactModel
        The model, with its `capabilities`.
    point : OperatingPoint
        The operating point of the problem.
    wear_compliance : ndarray, shape (strips,), optional
        As in `ContactModel.solve`.

    Raises
    ------
    CapabilityError
        With the name of the missing capability.
    """
    rank = np.ndim(point.friction)
    required = {
        "wear_compliance": (wear_compliance is not None, "wear compliance"),
        "creepage_variation": (
            point.creepage.variation is not None,
            "creepage that varies from strip to strip",
        ),
        "bearing_torque": (point.bearing_torque is not None, "bearing torque"),
        "local_friction": (rank == 1, "friction that varies from strip to strip"),
        "friction_field": (rank > 1, "friction that varies from point to point"),
    }
    for name, (needed, quantity) in required.items():
        if needed and not getattr(model.capabilities, name):
            raise CapabilityError(
                f"{type(model).__name__} does not support {quantity}, since its capabilities do"
                f" not include {name}; choose a contact.model that does"
            )
