"""State of a wear test, the content of a checkpoint, and its contacts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from wearsim.contact_batch import ContactBatchSolution
from wearsim.evolution.quantities import is_every
from wearsim.types import FloatArray, IntArray

HERTZ = 2.0 / 3.0  # approach of unworn bodies as a power of the load


SIGMAS = 2.0  # standard deviations of the sampling scatter that are counted as error
#: Depths of cylinder and rollers, shapes as in `WearState` [m].
Depths: TypeAlias = tuple[FloatArray, FloatArray]
_CONTACT = "contact_"
_AUXILIARY = ("coarse_step_solution", "half_quadrature_solution")
#: axis of the realisations in the arrays of a `WearState`
_AXES = {
    "passes": 0,
    "cylinder_depth": 2,
    "roller_depth": 2,
    "terms": 2,
    "energy": 0,
    "depth_error": 0,
    "volume_error": 0,
    "profile_error": 0,
    "quadrature": 1,
    "scatter": 1,
    "step": 0,
    "steps": 0,
    "rejected": 0,
    "solves": 0,
    "full_solves": 0,
    "loop_strips": 3,
    "loop_contacts": 3,
    "decay": 0,
    "approach_factor": 2,
    "wear_exponents": 2,
    "separation": 2,
    "part": 2,
    "whole_steps": 2,
    "past_wear": 2,
    "past_sums": 2,
    "past_feedback": 3,
    "past_spans": 1,
    "order": 0,
    "skid_loads": 2,
    "stepping_error": 1,
    "damage": 2,
    "damage_points": 1,
}


class Past(NamedTuple):
    """Rates, differences, past points and edges of a state as kernels take them; see `WearState`.

    Sums and feedback have the shape (6, rows, realisations, 1), without rows where a state has
    none; fields of the edges the shape (contacts, strips), without strips where a state has none.
    """

    wear: FloatArray
    sums: FloatArray
    feedback: FloatArray
    spans: FloatArray
    separation: FloatArray
    part: FloatArray
    whole_steps: FloatArray


#: properties of a `WearState` that are computed once, and the fields that they are computed from
_DERIVED = (
    ("stacked", {"cylinder_depth", "roller_depth"}),
    (
        "past",
        {
            *("past_wear", "past_sums", "past_feedback", "past_spans"),
            *("separation", "part", "whole_steps"),
        },
    ),
)


@dataclass(frozen=True)
class WearState:
    """Wear tests after some roller passes, each with its own number of passes.

    Leading axes are (station, roller, realisation). The axis of rollers has length one for the
    cylinder, that of stations has length one for the rollers.

    Parameters
    ----------
    passes : ndarray, shape (realisations,)
        Roller passes done, all rollers together.
    cylinder_depth : ndarray, shape (stations, 1, realisations, strips)
        Worn depth of the cylinder [m].
    roller_depth : ndarray, shape (1, rollers, realisations, strips)
        Worn depth of each roller [m].
    terms : ndarray, shape (terms, rollers, realisations)
        State of each load term.
    contacts : ContactBatchSolution
        Last solution of every contact, numbered as in `WearProblem`, the realisation fastest.
    energy : ndarray, shape (realisations,)
        Dissipated energy of all rollers [J].
    depth_error : ndarray, shape (realisations,)
        Error estimate of the worn depth, the greater of both bodies [m].
    volume_error : ndarray, shape (realisations,)
        Error estimate of the volume worn off both bodies [m^3].
    profile_error : ndarray, shape (realisations,)
        Error estimate of the profiles of all bodies: its Euclidean norm over that of the depths.
    quadrature : ndarray, shape (3, realisations)
        Part of these errors due to the quadrature over inputs drawn at every pass: in depth [m],
        volume [m^3] and profile.
    scatter : ndarray, shape (3, realisations)
        Variance between tests due to these draws: of depth [m^2], volume [m^6] and profile.
    step : ndarray, shape (realisations,)
        Length of the next step proposed by the step-size control [passes]; 0 before the first.
    steps, rejected : ndarray of int, shape (realisations,)
        Steps taken and rejected.
    solves : ndarray of int, shape (realisations,)
        Contact solves of the steps taken.
    full_solves : ndarray of int, shape (realisations,)
        Passes solved in full, not by the chord method, in a per-pass run.
    loop_strips : ndarray, shape (3, stations, rollers, realisations, strips), optional
        Memory of the compiled per-pass loop: line load [N/m], and line load [N/m] and gap [m] of
        the last factorisation.
    loop_contacts : ndarray, shape (3, stations, rollers, realisations), optional
        Memory of the compiled per-pass loop: approach [m], approach of the last factorisation [m],
        and the sum of the dissipated powers of all passes [W].
    coarse_step_solution : WearState, optional
        The same test with steps of twice the length; the difference is the error estimate.
    half_quadrature_solution : WearState, optional
        The coarse-step solution with half the quadrature nodes per roller.
    decay : ndarray, shape (realisations,), optional
        Greatest decay rate of a profile by wear, last measurement [1/pass].
    approach_factor : ndarray, shape (stations, rollers, realisations), optional
        Elastic approach of each roller on unworn bodies over the power 2/3 of its load
        [m/N^(2/3)], where a load has a spring.
    wear_exponents : ndarray, shape (stations, contacts, realisations, strips), optional
        Exponent of the wear of a strip as a power of its line load, in the last implicit step.
    separation : ndarray, shape (stations, contacts, realisations, strips), optional
        Mean distance between the deformed surfaces in each strip, 0 in those wholly in contact [m];
        None where the edge of a contact is not resolved within a strip, see `edges`.
    part : ndarray, shape as `separation`, optional
        Part of each strip that is in contact.
    whole_steps : ndarray, shape as `separation`, optional
        Steps since each strip has been wholly in contact, at most `edges.SETTLED`.
    past_wear : ndarray, shape (6, stations + rollers, realisations, strips), optional
        Wear per roller pass of cylinder and rollers [m], and divided differences of order 1 to 5 of
        their depths less separations over the exposure (see `implicit`) at the present and at past
        points.
    past_sums : ndarray, shape (6, sums, realisations), optional
        The same of the energy [J] and, where edges of contacts are resolved within a strip, before
        it of the sums of the depths of each body over the strips [m].
    past_feedback : ndarray, shape (6, stations, contacts, realisations), optional
        Part of the loads due to springs and terms [N], and its divided differences.
    past_spans : ndarray, shape (5, realisations), optional
        Exposure from the past points to the present one; infinite where there is none.
    order : ndarray of int, shape (realisations,), optional
        Order of the next implicit step.
    skid_loads : ndarray, shape (2, stations of the unworn cam, realisations), optional
        Changes of the normal force of a cam with which its stations were placed, and with which
        the skids were last located, see `relocation` [N]; none before wear has changed them.
    stepping_error : ndarray, shape (stations + rollers, realisations, strips), optional
        Estimated error of the depths of cylinder and rollers, computed less true ones [m].
    damage : ndarray, shape (4, stations + rollers, realisations, strips), optional
        Where the bodies may pit, the damage of cylinder and rollers, its error by the integration
        over the passes, and damage per roller pass at present and at the point before.
    damage_points : ndarray, shape (2, realisations), optional
        Roller passes at the point before, and those that wear off the elastic approach.
    """

    passes: FloatArray
    cylinder_depth: FloatArray
    roller_depth: FloatArray
    terms: FloatArray
    contacts: ContactBatchSolution
    energy: FloatArray
    depth_error: FloatArray
    volume_error: FloatArray
    profile_error: FloatArray
    quadrature: FloatArray
    scatter: FloatArray
    step: FloatArray
    steps: IntArray
    rejected: IntArray
    solves: IntArray
    full_solves: IntArray
    loop_strips: FloatArray | None = None
    loop_contacts: FloatArray | None = None
    coarse_step_solution: WearState | None = None
    half_quadrature_solution: WearState | None = None
    decay: FloatArray | None = None
    approach_factor: FloatArray | None = None
    wear_exponents: FloatArray | None = None
    separation: FloatArray | None = None
    part: FloatArray | None = None
    whole_steps: FloatArray | None = None
    past_wear: FloatArray | None = None
    past_sums: FloatArray | None = None
    past_feedback: FloatArray | None = None
    past_spans: FloatArray | None = None
    order: IntArray | None = None
    skid_loads: FloatArray | None = None
    stepping_error: FloatArray | None = None
    damage: FloatArray | None = None
    damage_points: FloatArray | None = None

    @property
    def depths(self) -> Depths:
        """Worn depths of cylinder and rollers [m]."""
        return self.cylinder_depth, self.roller_depth

    @cached_property
    def stacked(self) -> FloatArray:
        """Worn depths of all bodies, shape (stations + rollers, realisations, strips) [m]."""
        return np.concatenate([self.cylinder_depth[:, 0], self.roller_depth[0]])

    @cached_property
    def past(self) -> Past:
        """Past points of a state of the implicit stepper, as kernels take them."""
        sums, feedback, contacts = (
            np.asarray(self.past_sums),
            self.past_feedback,
            len(self.contacts),
        )
        rows, _, realisations = sums.shape
        return Past(
            np.asarray(self.past_wear),
            sums[..., None],
            np.empty((rows, 0, realisations, 1))
            if feedback is None
            else feedback.reshape(rows, -1, realisations, 1),
            np.asarray(self.past_spans),
            *(
                np.empty((contacts, 0)) if field is None else field.reshape(contacts, -1)
                for field in (self.separation, self.part, self.whole_steps)
            ),
        )

    @property
    def auxiliary(self) -> dict[str, Any]:
        """The coarse-step and half-quadrature solutions that exist, by field name."""
        if self.coarse_step_solution is None and self.half_quadrature_solution is None:
            return {}
        states = ((name, getattr(self, name)) for name in _AUXILIARY)
        return {name: state for name, state in states if state is not None}

    def replaced(self, **others: Any) -> WearState:
        """Return the state with some fields replaced, in a tenth of the time of `replace`."""
        state = object.__new__(WearState)
        values, changed = self.__dict__ | others, {*others}
        for name, fields in _DERIVED:
            if name in values and fields & changed:
                del values[name]
        state.__dict__.update(values)
        return state

    def with_stacked(self, depths: FloatArray, past: Past, **others: Any) -> WearState:
        """Return the state with depths given as `stacked` [m], and with other fields replaced.

        Parameters
        ----------
        depths : ndarray
        past : Past
            Of the fields in `others`.
        """
        cylinder, roller = separated(depths, self.cylinder_depth.shape[0])
        state = self.replaced(cylinder_depth=cylinder, roller_depth=roller, **others)
        state.__dict__.update(stacked=depths, past=past)
        return state

    def with_added(self, depths: Depths, energy: FloatArray | float = 0.0) -> WearState:
        """Return the state with depths of cylinder and rollers [m] and energy [J] added."""
        return self.replaced(
            cylinder_depth=self.cylinder_depth + depths[0],
            roller_depth=self.roller_depth + depths[1],
            energy=self.energy + energy,
        )

    def contacts_of(self, realisations: IntArray) -> IntArray:
        """Return the numbers of the contacts of some realisations, in the state's order."""
        return np.arange(len(self.contacts)).reshape(-1, len(self.passes))[:, realisations].ravel()

    def at(self, realisations: IntArray) -> WearState:
        """Return the state of some realisations, by number and in that order."""
        if is_every(realisations, self.passes.size):
            return self
        arrays = ((name, getattr(self, name)) for name in _AXES)
        return self.replaced(
            contacts=self.contacts.at(self.contacts_of(realisations)),
            **{n: a.take(realisations, axis=_AXES[n]) for n, a in arrays if a is not None},
            **{name: state.at(realisations) for name, state in self.auxiliary.items()},
        )

    def with_others(self, places: IntArray, others: WearState) -> WearState:
        """Return the state with that of some realisations, by increasing place, replaced."""
        if places.size == self.passes.size:
            return others
        arrays = {n: getattr(self, n).copy() for n in _AXES if getattr(self, n) is not None}
        for name, values in arrays.items():
            values[(slice(None),) * _AXES[name] + (places,)] = getattr(others, name)
        # the coarse-step solution of a test begins as the test itself
        both = self.auxiliary.keys() | others.auxiliary.keys()
        pairs = {
            name: (getattr(self, name) or self, getattr(others, name) or others) for name in both
        }
        return self.replaced(
            contacts=self.contacts.with_others(self.contacts_of(places), others.contacts),
            **arrays,
            **{name: before.with_others(places, after) for name, (before, after) in pairs.items()},
        )

    @property
    def irreducible(self) -> FloatArray:
        """Errors of depth [m] and volume [m^3] not due to step size, shape (2, realisations)."""
        if not self.scatter.nonzero()[0].size:
            return self.quadrature
        return np.asarray(self.quadrature + SIGMAS * np.sqrt(self.scatter))

    def to_arrays(self) -> dict[str, npt.NDArray[np.generic]]:
        """Return the whole state as named arrays, for a checkpoint."""
        arrays: dict[str, npt.NDArray[np.generic]] = {
            name: getattr(self, name) for name in _AXES if getattr(self, name) is not None
        }
        columns = vars(self.contacts).items()
        arrays |= {_CONTACT + n: np.array(column) for n, column in columns if column is not None}
        arrays[_CONTACT + "y"] = np.tile(self.contacts.y, (len(self.contacts), 1))
        for name, state in self.auxiliary.items():
            arrays.update({f"{name}_{key}": a for key, a in state.to_arrays().items()})
        return arrays

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, npt.NDArray[np.generic]]) -> WearState:
        """Return the state stored in the result of `to_arrays`."""
        values: dict[str, Any] = {n: np.array(a) for n, a in arrays.items() if n in _AXES}
        for name in _AUXILIARY:
            if part := _with_prefix(arrays, f"{name}_"):
                values[name] = cls.from_arrays(part)
        columns = _with_prefix(arrays, _CONTACT)
        values["contacts"] = ContactBatchSolution(**columns | {"y": columns["y"][0]})
        values.setdefault("profile_error", np.zeros_like(values["depth_error"]))
        for name in ("quadrature", "scatter"):  # files of earlier versions lack the profile
            values[name] = np.resize(values[name], (3, *values[name].shape[1:]))
        return cls(**values)


def _with_prefix(arrays: Mapping[str, npt.NDArray[Any]], prefix: str) -> dict[str, Any]:
    """Return the arrays whose names begin with a prefix, by the rest of their names."""
    return {n.removeprefix(prefix): a for n, a in arrays.items() if n.startswith(prefix)}


def joined_states(states: Sequence[WearState]) -> WearState:
    """Return the states of tests without inputs drawn at every pass as those of one problem."""
    first = states[0]
    if len(states) == 1:
        return first
    fields, contacts = [state.__dict__ for state in states], [state.contacts for state in states]
    arrays = {
        name: [values[name] for values in fields] for name in _AXES if fields[0][name] is not None
    }
    rows = len(first.contacts) // len(first.passes)
    # the coarse-step solution of a test begins as the test itself
    coarse = [state.coarse_step_solution or state for state in states]
    has_coarse = [state.coarse_step_solution is not None for state in states]
    return first.replaced(
        contacts=contacts[0].joined_with(*contacts[1:], rows=rows),
        coarse_step_solution=joined_states(coarse) if any(has_coarse) else None,
        **{n: np.concatenate(a, axis=_AXES[n]) for n, a in arrays.items()},
    )


def separated(depths: FloatArray, stations: int) -> Depths:
    """Return the depths of cylinder and rollers from those of `WearState.stacked`."""
    return depths[:stations, None], depths[None, stations:]
