"""Capabilities of contact models, and the arguments of the compiled pass loop."""

from __future__ import annotations

from dataclasses import dataclass

from wearsim.types import FloatArray, IntArray


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
        Load lost per displacement of a roller towards the cylinder [N/m].
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
        *State*: approach after the last pass, and at the current factorisation [m].
    energy : ndarray, shape (contacts,)
        *State*: dissipated power summed over the passes [W].
    """

    order: IntArray
    first_pass: int
    base_load: FloatArray
    creepage: FloatArray
    friction: FloatArray
    tilt: FloatArray
    spin: FloatArray
    stiffness: float
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
