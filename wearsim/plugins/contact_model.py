"""Base classes of contact models."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

from wearsim.contact_batch import ContactBatch, ContactBatchSolution
from wearsim.errors import CapabilityError, ContactError
from wearsim.plugins.capabilities import Capabilities, PassLoop
from wearsim.plugins.shared_wear import SharedWear
from wearsim.types import ContactFields, ContactSolution, FloatArray, OperatingPoint


class ContactModel(ABC):
    """Solver of the contact of two bodies for gap profiles and operating points.

    Body 1 is the cylinder, body 2 the roller. The undeformed gap at (x, y) is
    ``longitudinal_curvature * x**2 / 2 + gap(y)``; x points along rolling, so that the leading edge
    of a strip is at x = +a(y). Tractions act on body 1, whose rigid slip per unit of rolling
    velocity is ``(xi - phi y, eta + phi x)``. Hence P = -V (xi F_x + eta F_y + phi M_z), which is
    not negative.

    The factory of its spec builds a model for strips and materials; no call changes it.
    """

    capabilities = Capabilities()

    @abstractmethod
    def solve(
        self,
        batch: ContactBatch,
        wear_compliance: FloatArray | None = None,
        coupling: SharedWear | None = None,
        warm: ContactBatchSolution | None = None,
    ) -> ContactBatchSolution:
        """Solve a batch of contacts; the solution of each depends only on those coupled to it.

        Parameters
        ----------
        batch : ContactBatch
            Gaps, loads, velocities, creepages and friction.
        wear_compliance : ndarray, shape (contacts, strips), optional
            Gap that wear opens per unit of line load q [m/(N/m)]: each contact is solved on the
            gap ``gap + wear_compliance * q``.
        coupling : SharedWear, optional
            The same for sets of contacts that wear common bodies, with the contacts of a set next
            to each other in the batch; instead of a wear compliance.
        warm : ContactBatchSolution, optional
            Solutions of similar contacts, as the initial guess.

        Returns
        -------
        ContactBatchSolution

        Raises
        ------
        ContactError
            If a contact is lost or extends beyond the strips, the solver does not converge or a
            value is not finite; with the number of the contact in its state.
        CapabilityError
            If the arguments require a capability that the model does not have, see
            `refuse_unclaimed`.
        """

    def solve_one(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        wear_compliance: FloatArray | None = None,
        warm: ContactSolution | None = None,
    ) -> ContactSolution:
        """Solve one contact, as a batch of one; arguments as in `SingleContactModel`."""
        return self.solve(
            ContactBatch.of(gap[None], longitudinal_curvature, [point]),
            None if wear_compliance is None else wear_compliance[None],
            None,
            None if warm is None else ContactBatchSolution.of([warm]),
        )[0]

    def friction_points(self, batch: ContactBatch) -> tuple[FloatArray, FloatArray]:
        """Return the points at which friction must be given; requires `friction_field`.

        Parameters
        ----------
        batch : ContactBatch
            The contacts; their friction is not used.

        Returns
        -------
        x : ndarray, shape (contacts, points, strips)
            Position along rolling, starting at the leading edge [m]; 0 outside the contact.
        y : ndarray, shape (strips,)
            Axial position [m].
        """
        raise CapabilityError(
            f"{type(self).__name__} does not support friction that varies from point to point;"
            " use contact.model = 'hertz-fastsim'"
        )

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


class SingleContactModel(ContactModel):
    """Contact model that solves the contacts of a batch one after another."""

    @abstractmethod
    def solve_contact(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        wear_compliance: FloatArray | None = None,
        warm: ContactSolution | None = None,
    ) -> ContactSolution:
        """Solve one contact.

        The arguments require no capability that the model does not claim.

        Parameters
        ----------
        gap : ndarray, shape (strips,)
            Gap of the undeformed bodies at x = 0 [m]; its zero is arbitrary.
        longitudinal_curvature : float
            Relative curvature along rolling, 1/R_1 + 1/R_2 [1/m].
        point : OperatingPoint
            Load, velocity, creepage and friction.
        wear_compliance : ndarray, shape (strips,), optional
            Gap that wear opens per unit of line load [m/(N/m)].
        warm : ContactSolution, optional
            Solution of a similar contact, as the initial guess.

        Returns
        -------
        ContactSolution

        Raises
        ------
        ContactError
            As `ContactModel.solve`.
        """

    def solve(
        self,
        batch: ContactBatch,
        wear_compliance: FloatArray | None = None,
        coupling: SharedWear | None = None,
        warm: ContactBatchSolution | None = None,
    ) -> ContactBatchSolution:
        """Solve the contacts of a batch one after another by `solve_contact`."""
        refuse_unclaimed(self, batch, wear_compliance, coupling)
        return solved_one_by_one(
            batch,
            lambda k: self.solve_contact(
                batch.gap[k],
                float(batch.longitudinal_curvature[k]),
                batch.point(k),
                None if wear_compliance is None else wear_compliance[k],
                None if warm is None else warm[k],
            ),
        )


def solved_one_by_one(
    batch: ContactBatch, solve: Callable[[int], ContactSolution]
) -> ContactBatchSolution:
    """Return the solutions that `solve` returns for the numbers of the contacts of a batch.

    Raises
    ------
    ContactError
        Of the first contact that fails, with its place in the batch.
    """
    solutions = []
    for number in range(len(batch)):
        try:
            solutions.append(solve(number))
        except ContactError as error:
            raise naming_contact(error, number, batch) from error
    return ContactBatchSolution.of(solutions)


def naming_contact(error: ContactError, number: int, batch: ContactBatch) -> ContactError:
    """Return the error of a contact with its place in the batch."""
    place, text = batch.place(number)
    message = f"{text}: {error}" if text else str(error)
    return ContactError(message, error.state | {"contact": place})


def refuse_unclaimed(
    model: ContactModel,
    batch: ContactBatch,
    wear_compliance: FloatArray | None = None,
    coupling: SharedWear | None = None,
) -> None:
    """Raise an error if a batch requires a capability that a contact model does not have.

    Parameters
    ----------
    model : ContactModel
        The model, with its `capabilities`.
    batch, wear_compliance, coupling
        Arguments of `ContactModel.solve`.

    Raises
    ------
    CapabilityError
        With the name of the missing capability.
    """
    rank = batch.friction.ndim
    needed = {
        "wear_compliance": wear_compliance is not None,
        "coupled": coupling is not None,
        "creepage_variation": batch.variation is not None,
        "bearing_torque": batch.bearing_torque is not None,
        "local_friction": rank == 2,
        "friction_field": rank > 2,
    }
    for name, need in needed.items():
        if need and not getattr(model.capabilities, name):
            what, also = _QUANTITIES[name]
            raise CapabilityError(
                f"{type(model).__name__} does not support {what}, since its capabilities do not"
                f" include {name}; choose a contact.model that does{also}"
            )


_STEPPERS = ", or evolution.stepper = 'stabilised' or 'per-pass'"
# what a capability is required for, and other remedies than another model
_QUANTITIES = {
    "wear_compliance": ("wear compliance", _STEPPERS),
    "coupled": ("contacts that wear common bodies", _STEPPERS),
    "creepage_variation": ("creepage that varies from strip to strip", ""),
    "bearing_torque": ("bearing torque", ""),
    "local_friction": ("friction that varies from strip to strip", ""),
    "friction_field": ("friction that varies from point to point", ", such as 'hertz-fastsim'"),
}
