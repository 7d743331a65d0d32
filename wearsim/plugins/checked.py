"""Checks of the values that plugins return."""

from __future__ import annotations

from collections.abc import Callable
from numbers import Real
from typing import Any, ClassVar, TypeVar

import numpy as np

from wearsim.errors import PluginError, SolverError
from wearsim.plugins.manager import described_value, registry
from wearsim.plugins.specs import Spec

T = TypeVar("T")
ROUNDING = 1e-9  # of the greatest value: a negative one that is no error of a plugin


class Checked:
    """Base class of wrappers that check the values of a plugin before they are used.

    Parameters
    ----------
    plugin : object
        What the factory of the plugin has built.
    name : str
        Its name in a scenario.
    """

    spec: ClassVar[type[Spec]]

    def __init__(self, plugin: Any, name: str) -> None:
        self._plugin, self._name = plugin, name

    def _checked(
        self,
        what: str,
        value: T,
        shape: tuple[int, ...] = (),
        unit: str = "",
        *,
        signed: bool = False,
        **inputs: Any,
    ) -> T:
        """Return a value of the plugin after checking it.

        Parameters
        ----------
        what : str
            Its name, which starts with that of the method or attribute.
        value : float or ndarray
        shape : tuple of int
        unit : str
        signed : bool
            Whether it may be negative.
        **inputs
            What the plugin was called with, for the state of the error.

        Raises
        ------
        PluginError
            If it is no number, or no array of this shape.
        SolverError
            If it is not finite, or negative.
        """
        array: Any = value
        if not (is_numeric(value) and np.shape(array) == shape):
            wanted = f"an array of the shape {shape}" if shape else "a number"
            raise self._kind_error(what, value, wanted)
        low, high = np.min(array, initial=0.0), np.max(array, initial=0.0)
        if np.isfinite(high - low) and (signed or low >= -ROUNDING * high):
            return value
        text = f"values of {what} that are not finite"
        if np.isfinite(high - low):
            text = f"negative values of {what}, down to {low:.4g} {unit}".rstrip()
        state = {**inputs, what.split(maxsplit=1)[0]: value}
        raise SolverError(f"{self._subject} returned {text}; {self._remedy}", state)

    def _called(
        self,
        what: str,
        method: Callable[..., T],
        shape: tuple[int, ...] = (),
        unit: str = "",
        *,
        signed: bool = False,
        **inputs: Any,
    ) -> T:
        """Call a method of the plugin with the inputs, and return its value after `_checked`."""
        value = method(*inputs.values())  # a plugin may have other names of its parameters
        return self._checked(what, value, shape, unit, signed=signed, **inputs)

    def _texts(self, what: str, expected: str) -> tuple[str, ...]:
        """Return texts of the plugin after checking them."""
        texts: Any = getattr(self._plugin, what)
        if not (isinstance(texts, tuple | list) and all(isinstance(text, str) for text in texts)):
            raise self._kind_error(what, texts, expected)
        return tuple(texts)

    def _kind_error(self, what: str, value: object, expected: str) -> PluginError:
        """Return the error of a value of another type or shape."""
        returned = f"{self._subject} returned {described_value(value)} as {what}"
        return PluginError(f"{returned}, expected {expected}; {self._remedy}")

    @property
    def _subject(self) -> str:
        """The plugin with its distribution, as the subject of messages."""
        item = registry().registered(self.spec, self._name)
        return f"{self.spec.kind} '{self._name}' of {item.distribution} {item.version}"

    @property
    def _remedy(self) -> str:
        tests = f"{self.spec.kind.replace(' ', '_')}_tests"
        return f"correct the plugin, which {tests} of wearsim.testing checks"


def is_numeric(value: object) -> bool:
    """Return whether a value is a real number or an array of such numbers."""
    return isinstance(value, Real) or (isinstance(value, np.ndarray) and value.dtype.kind in "fiu")
