"""Capabilities that a contact model may claim."""

from __future__ import annotations

from dataclasses import dataclass

from wearsim.types import (
    FloatArray,
    IntArray,
)


@dataclass(frozen=True)
class Capabilities:
    """What a contact model can take; the solver picks the stepper that fits.

    Parameters
    ----------
    wear_compliance : bool
        `solve` honours its `wear_compliance`, so that implicit steps are possible.
    coupled : bool
        `solve_coupled` takes several contacts that share a wearing profile.
    creepage_variation : bool
        The creepage may vary from strip to strip (`Creepage.variation`).
    bearing_torque : bool
        The mean longitudinal creepage can be found from a bearing torque.
    local_friction : bool
        Friction may be given per strip.
    friction_field : bool
        Friction may differ from point to point within the contact, and be carried through it.
    pass_loop : bool
        `pass_loop` runs the per-pass loop in compiled code.
    fields : bool
        `fields` gives the inside of a contact.
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
        """Return the names of what the model can take."""
        return [name for name, able in vars(self).items() if able]


@dataclass
class PassLoop:
    """A run of roller passes in compiled code; arrays marked *state* are changed in place.

    The physical rollers take turns, one pass each. Pass p of contact g meets the gap
    ``nominal_gap[g] + tilt[p] * from_apex[g]`` and the worn depths; its creepage varies by
    ``slip_base[g] - spin[p] * spin_arm[g]`` and what worn depth adds. It wears ``wear[0] * w`` off
    the cylinder and ``wear[1 + g] * w`` off the roller, w(y) being the dissipation P_l over V.

    Parameters
    ----------
    order : ndarray of int, shape (physical rollers,)
        Which contact each physical roller is.
    first_pass : int
        Number of the first pass, counted from the start of the test.
    base_load : ndarray, shape (passes,)
        Load before feedback at each pass [N].
    creepage : ndarray, shape (passes, 2)
        Mean longitudinal, and lateral creepage.
    friction, tilt, spin : ndarray, shape (passes,)
        Friction coefficient, tilt that moves the contact [rad], and spin [1/m].
    stiffness : float
        Load lost per descent of a roller [N/m].
    nominal_gap, from_apex : ndarray, shape (contacts, strips)
        Gap before wear, and distance from the roller's apex [m].
    longitudinal_curvature, rolling_speed : float
        Relative curvature along rolling [1/m], V [m/s].
    slip_base, spin_arm : ndarray, shape (contacts, strips)
        Variation of the longitudinal creepage on unworn bodies; its fall per spin [m].
    slip_rates : ndarray, shape (2,)
        What worn depth of the roller adds to it, and of the cylinder takes off it [1/m].
    wear : ndarray, shape (1 + contacts,)
        Depth per pass and w: the cylinder's, then each roller's [m/(N/m)].
    term_rates : ndarray, shape (terms, 1 + contacts)
        Gain of each load term [N/W], and the part of the way to rest that a pass goes.
    similar : bool
        Whether one pass of a contact is much like the one before, so that it can be followed.
    terms : ndarray, shape (terms, contacts)
        *State*: the load terms [N].
    cylinder_depth, roller_depth : ndarray, shape (strips,) and (contacts, strips)
        *State*: worn depths [m].
    line_load, anchor, anchor_gap : ndarray, shape (contacts, strips)
        *State*: line load after the last pass; line load [N/m] and gap [m] where the factorisation
        in use was made, zero where there is none.
    approach, anchor_approach : ndarray, shape (contacts,)
        *State*: approach after the last pass, and where the factorisation was made [m].
    energy : ndarray, shape (contacts,)
        *State*: sum over the passes of the dissipated power [W].
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
    longitudinal_curvature: float
    rolling_speed: float
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
