"""Checks of the values that random inputs of plugins compute."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from wearsim.plugins.checked import Checked, is_numeric
from wearsim.plugins.manager import built_plugin
from wearsim.plugins.specs import (
    Distribution,
    FrictionField,
    JointDistribution,
    Process,
    RandomInputSpec,
    Uniforms,
)
from wearsim.types import FloatArray


class _CheckedRandomInput(Checked):
    """Checks of a random input of any role, which may warn of its validity."""

    spec = RandomInputSpec

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the validity, for the user."""
        return self._texts("warnings", "a tuple of texts")

    def _marginal(self) -> Distribution:
        marginal: Any = getattr(self._plugin, "marginal", None)
        if not isinstance(marginal, Distribution):
            raise self._kind_error("marginal", marginal, "the Distribution of one value")
        return marginal


class CheckedDistribution(_CheckedRandomInput, Distribution):
    """Distribution of a plugin, with checks of its quantiles; errors as of `Checked`."""

    def quantile(self, probability: FloatArray) -> FloatArray:
        """Return the quantiles, shape as `probability`; infinite only at 0 and 1."""
        values: FloatArray = self._plugin.quantile(probability)
        below = np.asarray(probability)
        if is_numeric(values) and np.shape(values) == below.shape:
            infinite = np.isinf(values) & ((below <= 0.0) | (below >= 1.0))  # ends of the support
            finite = np.where(infinite, 0.0, values)
            self._checked("quantile", finite, below.shape, signed=True, probability=probability)
            return values
        return self._checked("quantile", values, below.shape, signed=True)

    @cached_property
    def support(self) -> tuple[float, float]:
        """Minimum and maximum; may be infinite."""
        if not self._implements("support"):
            low, high = super().support
            if low > high:
                values = np.array([low, high])
                raise self._kind_error(f"quantiles {values}", values, "values that do not fall")
            return low, high
        support: Any = self._plugin.support
        pair = isinstance(support, tuple | list) and len(support) == 2
        if not (pair and all(map(is_numeric, support)) and support[0] <= support[1]):
            raise self._kind_error("support", support, "a tuple of two numbers that do not fall")
        return float(support[0]), float(support[1])

    @cached_property
    def mean(self) -> float:
        """Mean, by default integrated over the quantiles."""
        return self._moment("mean") if self._implements("mean") else super().mean

    @cached_property
    def std(self) -> float:
        """Standard deviation, by default integrated over the quantiles."""
        return self._moment("std") if self._implements("std") else super().std

    def _moment(self, what: str) -> float:
        """Return mean or std, which may be infinite: the scenario then refuses the distribution."""
        value: Any = getattr(self._plugin, what)
        if not (is_numeric(value) and np.shape(value) == ()):
            raise self._kind_error(what, value, "a number")
        self._checked(what, 0.0 if np.isinf(value) else value, signed=what == "mean")
        return float(value)

    def _implements(self, name: str) -> bool:
        """Return whether the plugin has its own property; the default one follows the quantiles."""
        own = getattr(type(self._plugin), name) is not getattr(Distribution, name)
        return own or name in vars(self._plugin)


class CheckedJointDistribution(Checked, JointDistribution):
    """Joint distribution of a plugin, with checks of its draws; errors as of `Checked`."""

    spec = RandomInputSpec

    def __init__(self, plugin: JointDistribution, name: str) -> None:
        super().__init__(plugin, name)
        self.components = self._texts("components", "a tuple of names")
        self.dimension: Any = plugin.dimension
        if not (isinstance(self.dimension, int) and self.dimension >= 1):
            raise self._kind_error("dimension", self.dimension, "a whole number of at least 1")

    def values(self, uniform: FloatArray) -> FloatArray:
        """Return the components, shape (draws, components), from uniforms (draws, dimension)."""
        shape = len(uniform), len(self.components)
        return self._called("values", self._plugin.values, shape, signed=True, uniform=uniform)

    @property
    def mean(self) -> tuple[float, ...]:
        """Mean of each component."""
        return self._numbers("mean", signed=True)

    @property
    def reach(self) -> tuple[float, ...]:
        """Maximum magnitude of each component."""
        return self._numbers("reach", signed=False)

    def _numbers(self, what: str, *, signed: bool) -> tuple[float, ...]:
        """Return one number per component after checking them."""
        values: Any = getattr(self._plugin, what)
        count = len(self.components)
        if np.shape(np.asarray(values, dtype=object)) != (count,):
            raise self._kind_error(what, values, f"a tuple of {count} numbers, one per component")
        return tuple(float(self._checked(what, value, signed=signed)) for value in values)


class CheckedFrictionField(_CheckedRandomInput, FrictionField):
    """Friction field of a plugin, with checks of its values; errors as of `Checked`."""

    def __init__(self, plugin: FrictionField, name: str) -> None:
        super().__init__(plugin, name)
        if plugin.frame not in ("contact", "cylinder", "roller"):
            expected = "contact, cylinder or roller"
            raise self._kind_error(f"frame {plugin.frame!r}", plugin.frame, expected)
        self.frame, self.marginal = plugin.frame, self._marginal()

    def values(self, x: FloatArray, y: FloatArray, uniforms: Uniforms) -> FloatArray:
        """Return one realisation of the friction at given points, shape (points, strips)."""
        return self._checked(
            "values", self._plugin.values(x, y, uniforms), np.shape(x), signed=True, x=x, y=y
        )

    def unresolved(self, along: float, across: float) -> str | None:
        """Return why a grid of these spacings [m] does not resolve the field, or None."""
        reason: str | None = self._plugin.unresolved(along, across)
        if reason is not None and not isinstance(reason, str):
            raise self._kind_error("unresolved", reason, "a text or None")
        return reason


class CheckedProcess(_CheckedRandomInput, Process):
    """Process of a plugin, with checks of its paths; errors as of `Checked`."""

    def __init__(self, plugin: Process, name: str) -> None:
        super().__init__(plugin, name)
        spacing: Any = getattr(plugin, "spacing", None)
        self.spacing = self._checked("spacing", spacing, (), "s")
        if self.spacing == 0.0:
            raise self._kind_error("spacing", spacing, "a time above 0 s")
        self.marginal = self._marginal()

    def path(self, points: int, uniforms: Uniforms) -> FloatArray:
        """Return one realisation at the times 0, spacing, 2 spacing, ..., shape (points,)."""
        return self._checked(
            "path", self._plugin.path(points, uniforms), (points,), signed=True, points=points
        )


_BY_ROLE: dict[str, tuple[type[Any], type[Any]]] = {
    "scalar": (Distribution, CheckedDistribution),
    "joint": (JointDistribution, CheckedJointDistribution),
    "field": (FrictionField, CheckedFrictionField),
    "process": (Process, CheckedProcess),
}


def built_random_input(spec: RandomInputSpec, options: Any, marginal: Distribution | None) -> Any:
    """Return what the factory of a random input builds; that of a plugin is checked.

    Parameters
    ----------
    spec : RandomInputSpec
    options : Options
    marginal : Distribution or None
        Of a field or a process.

    Raises
    ------
    PluginError
        If the factory returns an object of another class than that of the role.
    """
    expected, checked = _BY_ROLE[spec.role]
    arguments = (options,) if marginal is None else (options, marginal)
    return built_plugin(spec, expected, checked, *arguments)
