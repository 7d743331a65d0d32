"""Checks of the solutions of contact models that plugins register."""

from __future__ import annotations

import numpy as np

from wearsim.contact_batch import ContactBatch, ContactBatchSolution, SharedWear
from wearsim.errors import ContactError, PluginError
from wearsim.plugins.checked import ROUNDING, is_numeric
from wearsim.plugins.contact_model import (
    ContactModel,
    PassLoop,
    SingleContactModel,
    naming_contact,
    refuse_unclaimed,
)
from wearsim.plugins.manager import described_value
from wearsim.types import (
    ContactFields,
    ContactSolution,
    FloatArray,
    OperatingPoint,
)

_STRIPS = ("half_length", "line_load", "dissipation")
_NUMBERS = (
    *("force_x", "force_y", "spin_moment", "approach", "peak_pressure"),
    *("adhesion_fraction", "power", "longitudinal_creepage", "iterations"),
)


class CheckedModel(SingleContactModel):
    """Contact model of a plugin whose solutions are checked before they are used.

    Parameters
    ----------
    model : ContactModel
    name : str
        Its name in a scenario.
    """

    def __init__(self, model: ContactModel, name: str) -> None:
        self.capabilities = model.capabilities
        self._model, self._name = model, name

    def solve(
        self,
        batch: ContactBatch,
        wear_compliance: FloatArray | None = None,
        coupling: SharedWear | None = None,
        warm: ContactBatchSolution | None = None,
    ) -> ContactBatchSolution:
        """Solve a batch of contacts.

        Raises
        ------
        PluginError
            If a solution is of another type, or has arrays of another shape.
        ContactError
            If a value is not finite, or a dissipation is negative.
        """
        if type(self._model).solve is SingleContactModel.solve:
            # solutions are checked one by one, since others cannot be joined to a batch
            refuse_unclaimed(self._model, batch, wear_compliance, coupling)
            return super().solve(batch, wear_compliance, None, warm)
        solution = self._model.solve(batch, wear_compliance, coupling, warm)
        self._check_kind(solution, ContactBatchSolution, (len(batch),), batch.gap.shape[1])
        if fault := self._fault(solution):
            number, name, what = fault
            value = getattr(solution, name)[number]
            error = self._error(name, what, value, batch.gap[number], batch.point(number))
            raise naming_contact(error, number, batch)
        return solution

    def solve_contact(
        self,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        wear_compliance: FloatArray | None = None,
        warm: ContactSolution | None = None,
    ) -> ContactSolution:
        """Solve one contact with a model that solves single contacts; errors as in `solve`."""
        assert isinstance(self._model, SingleContactModel)
        solution = self._model.solve_contact(
            gap, longitudinal_curvature, point, wear_compliance, warm
        )
        self._check_kind(solution, ContactSolution, (), len(gap))
        if fault := self._fault(ContactBatchSolution.of([solution])):
            _, name, what = fault
            raise self._error(name, what, getattr(solution, name), gap, point)
        return solution

    def friction_points(self, batch: ContactBatch) -> tuple[FloatArray, FloatArray]:
        """Return the points at which friction must be given."""
        return self._model.friction_points(batch)

    def with_creep_factor(self, factor: float) -> ContactModel:
        """Return the model with its tangential compliance divided."""
        return CheckedModel(self._model.with_creep_factor(factor), self._name)

    def fields(
        self,
        solution: ContactSolution,
        gap: FloatArray,
        longitudinal_curvature: float,
        point: OperatingPoint,
        points_along: int = 101,
    ) -> ContactFields:
        """Return pressure, traction and slip in a solved contact."""
        return self._model.fields(solution, gap, longitudinal_curvature, point, points_along)

    def pass_loop(self, loop: PassLoop) -> int:
        """Run roller passes in compiled code; errors as in `solve`."""
        solves = self._model.pass_loop(loop)
        for name in ("energy", "cylinder_depth", "roller_depth"):
            values = getattr(loop, name)
            if not np.isfinite(values).all():
                raise ContactError(f"{self._returned} {name} that is not finite", {name: values})
        if loop.energy.min() < 0.0:
            raise ContactError(f"{self._returned} a negative energy", {"energy": loop.energy})
        return solves

    @property
    def _returned(self) -> str:
        """Subject and verb of messages: the name of the model in the scenario, "returned"."""
        return f"contact model '{self._name}' returned"

    def _check_kind(
        self, solution: object, kind: type, contacts: tuple[int, ...], strips: int
    ) -> None:
        """Raise a PluginError unless a solution has a type, and its fields their shapes."""
        if not isinstance(solution, kind):
            raise PluginError(
                f"{self._returned} {described_value(solution)}, expected a {kind.__name__}"
            )
        shapes = {"y": (strips,)} | dict.fromkeys(_STRIPS, (*contacts, strips))
        shapes |= dict.fromkeys(_NUMBERS, contacts)
        if getattr(solution, "separation", None) is not None:
            shapes["separation"] = (*contacts, strips)
        for name, shape in shapes.items():
            value = getattr(solution, name)
            if not (is_numeric(value) and np.shape(value) == shape):
                wanted = f"an array of the shape {shape}" if shape else "a number"
                raise PluginError(
                    f"{self._returned} {described_value(value)} as {name}, expected {wanted}"
                )

    def _fault(self, solution: ContactBatchSolution) -> tuple[int, str, str] | None:
        """Return number, field and fault of the first contact with an invalid value, or None."""
        values, count = vars(solution), len(solution)
        for name in (*_STRIPS, *_NUMBERS):
            finite = np.isfinite(values[name])
            if not finite.all():
                number = int(np.argmin(finite.reshape(count, -1).all(axis=1)))
                return number, name, f"{name} that is not finite"
        least = solution.dissipation.min(axis=1)
        negative = least < -ROUNDING * solution.dissipation.max(axis=1, initial=0.0)
        if negative.any():
            number = int(np.argmax(negative))
            return number, "dissipation", f"a negative dissipation of {least[number]:.4g} W/m"
        return None

    def _error(
        self,
        name: str,
        what: str,
        value: FloatArray | float,
        gap: FloatArray,
        point: OperatingPoint,
    ) -> ContactError:
        """Return the error of a contact, with the state that led to it and the value returned."""
        state = {"point": point, "gap": gap, "normal_force": point.normal_force, name: value}
        return ContactError(f"{self._returned} {what}", state)
