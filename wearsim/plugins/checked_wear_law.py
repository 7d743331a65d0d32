"""Checks of the depths that wear laws of plugins compute."""

from __future__ import annotations

from typing import Any, NoReturn

import numpy as np

from wearsim.errors import PluginError, SolverError
from wearsim.plugins.checked_model import ROUNDING, built_plugin, described_value, is_numeric
from wearsim.plugins.laws import Body, WearLaw
from wearsim.plugins.manager import registry
from wearsim.plugins.specs import WearLawSpec
from wearsim.types import ContactSolution, FloatArray


def built_wear_law(spec: WearLawSpec, options: Any) -> WearLaw:
    """Return a new wear law; the depths of one that is not of wearsim are checked.

    Parameters
    ----------
    spec : WearLawSpec
    options
        Argument of its factory.

    Raises
    ------
    PluginError
        If the factory returns no wear law.
    """
    return built_plugin(spec, WearLaw, CheckedWearLaw, options)


class CheckedWearLaw(WearLaw):
    """Wear law of a plugin whose depths are checked before they are used.

    Parameters
    ----------
    law : WearLaw
    name : str
        Its name in a scenario.
    """

    def __init__(self, law: WearLaw, name: str) -> None:
        self._law, self._name = law, name

    def depth_per_pass(
        self, body: Body, solution: ContactSolution, rolling_speed: float
    ) -> FloatArray:
        """Return the depth worn off `body` in one pass, shape (strips,) [m].

        Raises
        ------
        PluginError
            If it is no array of this shape.
        SolverError
            If a value is not finite or negative; with the contact as state.
        """
        depth = self._law.depth_per_pass(body, solution, rolling_speed)
        what, shape = f"depth_per_pass of the {body}", np.shape(solution.dissipation)
        if not (is_numeric(depth) and np.shape(depth) == shape):
            self._refuse_kind(what, depth, f"an array of the shape {shape}")
        if not (np.isfinite(depth).all() and depth.min() >= -ROUNDING * depth.max()):
            state: dict[str, Any] = {
                "half_length": solution.half_length,
                "line_load": solution.line_load,
                "dissipation": solution.dissipation,
                "rolling_speed": rolling_speed,
            }
            self._refuse_value(what, depth, "m", state)
        return depth

    def depth_per_dissipation(self, body: Body, rolling_speed: float) -> float | None:
        """Return depth per pass over dissipation [m/(W/m)]; errors as of `depth_per_pass`."""
        factor = self._law.depth_per_dissipation(body, rolling_speed)
        if factor is None:
            return None
        what = f"depth_per_dissipation of the {body}"
        if not (is_numeric(factor) and np.ndim(factor) == 0):
            self._refuse_kind(what, factor, "a number or None")
        if not 0.0 <= factor < np.inf:
            self._refuse_value(what, factor, "m^2/W", {"rolling_speed": rolling_speed})
        return factor

    @property
    def _returned(self) -> str:
        """Subject and verb of messages: the wear law with its distribution, "returned"."""
        item = registry().registered(WearLawSpec, self._name)
        return f"wear law '{self._name}' of {item.distribution} {item.version} returned"

    def _refuse_kind(self, what: str, value: object, expected: str) -> NoReturn:
        """Raise the error of a value of another type or shape."""
        raise PluginError(
            f"{self._returned} {described_value(value)} as {what}, expected {expected}"
        )

    def _refuse_value(
        self, what: str, value: FloatArray | float, unit: str, state: dict[str, Any]
    ) -> NoReturn:
        """Raise the error of a value that is not finite or negative, with the state."""
        text = f"a {what} that is not finite"
        if np.isfinite(value).all():
            text = f"a negative {what}, down to {np.min(value):.4g} {unit}"
        raise SolverError(f"{self._returned} {text}", {**state, what.split(maxsplit=1)[0]: value})
