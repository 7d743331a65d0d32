"""Base classes of contact models, their capabilities and the arguments of the pass loop."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

from wearsim.contact_batch import ContactBatch, ContactBatchSolution, SharedWear
from wearsim.errors import CapabilityError, ContactError
from wearsim.types import ContactFields, ContactSolution, FloatArray, IntArray, OperatingPoint

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


@dataclass(frozen=True)
class Capabilities:
    """Optional capabilities of a contact model; the default stepper is chosen by them.

    Parameters
    ----------
    wear_compliance : bool
        `solve` accepts `wear_compliance`, which implicit steps require.
    coupled : bool
        `solve` accepts `coupling`: contacts that wear the same bodies.
    creepage_variation : bool
        The creepage may vary from strip to strip (`Creepage.variation`).
    bearing_torque : bool
        The mean longitudinal creepage may follow from a prescribed bearing torque.
    local_friction : bool
        Friction may be given per strip.
    friction_field : bool
        Friction may be given per point within the contact, fixed to the contact or to a body.
    creep_factor : bool
        `with_creep_factor` reduces the initial slope of traction against creepage.
    pass_loop : bool
        `pass_loop` runs the per-pass loop in compiled code.
    fields : bool
        `fields` returns pressure, traction and slip within a contact.
    """

    wear_compliance: bool = False
    coupled: bool = False
    creepage_variation: bool = False
    bearing_torque: bool = False
    local_friction: bool = False
    friction_field: bool = False
    creep_factor: bool = False
    pass_loop: bool = False
    fields: bool = False

    def names(self) -> list[str]:
        """Return the names of the capabilities that the model has."""
        return [name for name, able in vars(self).items() if able]


@dataclass
class PassLoop:
    """Arguments of a compiled loop over roller passes; arrays marked *state* are updated in place.

    The physical rollers pass in turn. In pass p, contact g has the gap
    ``nominal_gap[g] + tilt[p] * from_apex[g]`` plus the worn depths; its longitudinal creepage
    varies by ``slip_base[g] - spin[p] * spin_arm[g]`` plus the contribution of the worn depths.
    The pass wears the depth ``wear[0] * w`` off the cylinder and ``wear[1 + g] * w`` off the
    roller, where w(y) = P_l(y) / V.

    Parameters
    ----------
    order : ndarray of int, shape (physical rollers,)
        Index of the contact of each physical roller.
    first_pass : int
        Number of the first pass, counted from the start of the test.
    base_load : ndarray, shape (passes,)
        Load of each pass before feedback [N].
    creepage : ndarray, shape (passes, 2)
        Mean longitudinal creepage and lateral creepage.
    friction, tilt, spin : ndarray, shape (passes,)
        Friction coefficient, tilt of the roller that shifts the contact [rad], spin [1/m].
    stiffness : float
        Load lost per displacement of a roller towards the cylinder [N/m]. The load and the contact
        of a pass are solved together: the displacement is the approach of the pass, less the least
        gap of the unworn bodies, less `fresh_approach`.
    fresh_approach : ndarray, shape (passes,)
        Elastic approach of unworn bodies in each pass, which does not displace the roller [m].
    nominal_gap, from_apex : ndarray, shape (contacts, strips)
        Gap before wear and axial distance from the roller's apex [m].
    longitudinal_curvature, rolling_speed : ndarray, shape (contacts,)
        Relative curvature along rolling [1/m], rolling velocity V [m/s].
    slip_base, spin_arm : ndarray, shape (contacts, strips)
        Variation of the longitudinal creepage on unworn bodies; its decrease per spin [m].
    slip_rates : ndarray, shape (2,)
        Increase of that variation per worn depth of the roller, and its decrease per worn depth
        of the cylinder [1/m].
    wear : ndarray, shape (1 + contacts,)
        Worn depth per pass and per w, of the cylinder and then of each roller [m/(N/m)].
    term_rates : ndarray, shape (terms, 1 + contacts)
        Gain of each load term [N/W], then the fraction of the distance to its equilibrium that it
        covers in one pass of each contact.
    similar : bool
        Whether consecutive passes of a contact differ little, so that a factorisation is reused.
    terms : ndarray, shape (terms, contacts)
        *State*: load terms [N].
    cylinder_depth, roller_depth : ndarray, shape (strips,) and (contacts, strips)
        *State*: worn depths [m].
    line_load, anchor, anchor_gap : ndarray, shape (contacts, strips)
        *State*: line load after the last pass; line load [N/m] and gap [m] at which the current
        factorisation was computed, zero if there is none.
    approach, anchor_approach : ndarray, shape (contacts,)
        *State*: approach after the last pass, before the first one that of fresh bodies if there is
        a stiffness; approach at the current factorisation [m].
    energy : ndarray, shape (contacts,)
        *State*: dissipated power summed over the passes [W].
    rests : bool
        Whether the load has pauses: a pass without load wears nothing, instead of being an error.
    """

    order: IntArray
    first_pass: int
    base_load: FloatArray
    creepage: FloatArray
    friction: FloatArray
    tilt: FloatArray
    spin: FloatArray
    stiffness: float
    fresh_approach: FloatArray
    nominal_gap: FloatArray
    from_apex: FloatArray
    longitudinal_curvature: FloatArray
    rolling_speed: FloatArray
    slip_base: FloatArray
    spin_arm: FloatArray
    slip_rates: FloatArray
    wear: FloatArray
    term_rates: FloatArray
    similar: bool
    terms: FloatArray
    cylinder_depth: FloatArray
    roller_depth: FloatArray
    line_load: FloatArray
    anchor: FloatArray
    anchor_gap: FloatArray
    approach: FloatArray
    anchor_approach: FloatArray
    energy: FloatArray
    rests: bool = False


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

    def with_creep_factor(self, factor: float) -> ContactModel:
        """Return the model with its tangential compliance divided; requires `creep_factor`.

        A third body between the surfaces adds compliance along them. Tractions are those of
        `factor` times the creepages, since a slip of zero is then reached at creepages 1/`factor`
        times as large; the normal contact does not change.

        Parameters
        ----------
        factor : float
            Kalker's reduction factor, above 0 and at most 1: initial slope of traction against
            creepage over that of ideal bodies.
        """
        raise CapabilityError(f"{type(self).__name__} does not support a creep factor")

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
    return ContactError(
        f"{text}: {error.message}" if text else error.message,
        error.state | {"contact": place},
        remedy=error.remedy,
        cause=error.cause,
    )


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
    rank, capabilities = batch.friction.ndim, model.capabilities
    for name, need, has in (
        ("wear_compliance", wear_compliance is not None, capabilities.wear_compliance),
        ("coupled", coupling is not None, capabilities.coupled),
        ("creepage_variation", batch.variation is not None, capabilities.creepage_variation),
        ("bearing_torque", batch.bearing_torque is not None, capabilities.bearing_torque),
        ("local_friction", rank == 2, capabilities.local_friction),
        ("friction_field", rank > 2, capabilities.friction_field),
    ):
        if need and not has:
            what, also = _QUANTITIES[name]
            raise CapabilityError(
                f"{type(model).__name__} does not support {what}, since its capabilities do not"
                f" include {name}; choose a contact.model that does{also}"
            )
