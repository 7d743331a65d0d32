"""Conformance checks: requirement, place that specifies it, and error message; specs under test."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Generic, TypeVar

import numpy as np
import numpy.typing as npt
from pydantic import ValidationError

from wearsim.errors import PluginError, WearsimError, described
from wearsim.plugins import (
    AxialProfileSpec,
    ContactModelSpec,
    FatigueLawSpec,
    LoadSpec,
    MotionLawSpec,
    Options,
    Quantity,
    RandomInputSpec,
    TableSpec,
    WearLawSpec,
    registry,
)
from wearsim.plugins.specs import PROTOCOL
from wearsim.types import FloatArray
from wearsim.units import Kind

F = TypeVar("F")
S = TypeVar(
    "S",
    ContactModelSpec,
    WearLawSpec,
    LoadSpec,
    RandomInputSpec,
    MotionLawSpec,
    AxialProfileSpec,
    FatigueLawSpec,
    TableSpec,
)


class ConformanceError(AssertionError):
    """A plugin violates a requirement; the message holds the measured numbers."""


@dataclass(frozen=True)
class Check(Generic[F]):
    """One testable requirement.

    Parameters
    ----------
    name : str
        Short name, used as the id of the test item.
    requirement : str
        The requirement in one sentence.
    specified_in : str
        Dotted name of the class or method that specifies it, "wearsim.plugins.ContactModel.solve".
    run : callable
        Takes the fixture with the object under test and raises ConformanceError.
    """

    name: str
    requirement: str
    specified_in: str
    run: Callable[[F], None]

    def __call__(self, fixture: F) -> None:
        """Check the object under test.

        Raises
        ------
        ConformanceError
            If it violates the requirement, or raises a WearsimError where a result is required.
        """
        __tracebackhide__ = True
        try:
            self.run(fixture)
        except ConformanceError as violation:
            message = str(violation)
        except WearsimError as error:
            message = f"{type(error).__name__} raised where a result is required: {error}"
        else:
            return
        raise ConformanceError(
            f"{fixture}: {message}. Violated requirement: {self.requirement} ({self.specified_in})"
        )


class Checks(dict[str, Check[F]]):
    """The checks of one kind of plugin by their names, in order."""

    def specified_in(self, place: str) -> Callable[[Callable[[F], None]], Check[F]]:
        """Return a decorator that adds a function as a check.

        The check takes its name from the function and its requirement from the docstring.

        Parameters
        ----------
        place : str
            Dotted name of the class or method that specifies the requirement.
        """

        def add(function: Callable[[F], None]) -> Check[F]:
            name = function.__name__.replace("_", "-")
            self[name] = Check(name, inspect.getdoc(function) or "", place, function)
            return self[name]

        return add


def require(condition: object, message: str) -> None:
    """Raise ConformanceError with a message unless the condition holds."""
    if not condition:
        raise ConformanceError(message)


def require_values(name: str, values: npt.ArrayLike, shape: tuple[int, ...]) -> None:
    """Raise ConformanceError unless values have a shape and are finite."""
    array = np.asarray(values)
    require(array.shape == shape, f"{name} has the shape {array.shape}, not {shape}")
    require(np.isfinite(array).all(), f"{name} is not finite")


def require_repeatable(
    name: str,
    function: Callable[..., npt.ArrayLike],
    others: Mapping[str, Callable[..., npt.ArrayLike]],
    *inputs: FloatArray,
) -> FloatArray:
    """Return the result of a function that must be the same at every call, bit for bit.

    Parameters
    ----------
    name : str
        Name of the function, for the message.
    function : callable
    others : mapping of str to callable
        Functions with the same result, by their description.
    *inputs : ndarray
        Arguments of the functions, which must not change them.

    Raises
    ------
    ConformanceError
        If an input is changed or a result differs.
    """
    copies = [array.copy() for array in inputs]
    first = np.array(function(*inputs))
    for array, copy in zip(inputs, copies, strict=True):
        require(np.array_equal(array, copy), f"{name} changes its input")
    for description, other in {"a second call": function, **others}.items():
        require(np.array_equal(first, other(*copies)), f"{name}: {description} differs")
    return first


def agree(
    name: str,
    got: npt.ArrayLike,
    expected: npt.ArrayLike,
    tolerance: float,
    scale: float = 0.0,
) -> None:
    """Raise ConformanceError unless two numbers or arrays agree.

    Parameters
    ----------
    name : str
        Name of the quantity, for the message.
    got, expected : array_like
        Of the same shape.
    tolerance : float
        Largest difference, relative to the largest magnitude in `expected` or to `scale`.
    scale : float
        Smallest reference magnitude of the relative difference.
    """
    actual, reference = np.asarray(got, dtype=np.float64), np.asarray(expected, dtype=np.float64)
    require_values(name, actual, reference.shape)
    size = max(float(np.abs(reference).max(initial=0.0)), scale)
    difference = np.abs(actual - reference)
    if (difference <= tolerance * size).all():
        return
    worst = int(np.argmax(difference))
    index = ", ".join(map(str, np.unravel_index(worst, actual.shape)))
    place = f" at index {index}" if actual.ndim else ""
    raise ConformanceError(
        f"{name} is {actual.flat[worst]:.9g}{place}, expected {reference.flat[worst]:.9g}: off by"
        f" {difference.flat[worst] / size if size else np.inf:.2e} of {size:.3g}, and"
        f" {tolerance:.0e} is allowed"
    )


@dataclass(frozen=True)
class ConfiguredSpec(Generic[S]):
    """A spec with options as written in a scenario.

    Parameters
    ----------
    spec : Spec
        The spec that the hook yields.
    raw : mapping of str to object
        Its options, quantities with their units: ``{"stiffness": "690 N/mm"}``.
    kind : Kind, optional
        Kind of quantity of a random input; None for a plain number.
    files : mapping of str to str
        Content of the files that the options name.
    """

    spec: S
    raw: Mapping[str, object] = field(default_factory=dict)
    kind: Kind | None = None
    files: Mapping[str, str] = field(default_factory=dict)

    @property
    def options(self) -> Options:
        """The validated options; raises PluginError if they are not valid."""

        def component(table: Mapping[str, Any]) -> Any:
            inner = {key: value for key, value in table.items() if key != "distribution"}
            spec = resolve(RandomInputSpec, table["distribution"])
            return spec.factory(ConfiguredSpec(spec, inner, self.kind, self.files).options)

        context: dict[str, Any] = {"read": self.files.__getitem__, "component": component}
        if self.kind is not None:
            context["quantity"] = Quantity(self.kind)
        try:
            return self.spec.options.model_validate(dict(self.raw), context=context)
        except ValidationError as error:
            random = self.kind is None and isinstance(self.spec, RandomInputSpec)
            remedy = "; values with units need the argument kind" if random else ""
            raise PluginError(f"{self}: {described(error)}{remedy}") from error

    def __str__(self) -> str:
        options = ", ".join(f"{key} = {value!r}" for key, value in self.raw.items())
        return f"{self.spec.kind} '{self.spec.name}'" + (f" with {options}" if options else "")


@dataclass(frozen=True)
class Fixture(Generic[S]):
    """A configured spec under test.

    Parameters
    ----------
    configured : ConfiguredSpec
        The spec and its options.
    """

    configured: ConfiguredSpec[S]

    def __str__(self) -> str:
        return str(self.configured)

    def fresh(self) -> Any:
        """Return a new instance."""
        spec: Any = self.configured.spec
        return spec.factory(self.configured.options)

    @cached_property
    def instance(self) -> Any:
        """The instance that all checks share: earlier calls must not change later results."""
        return self.fresh()


def require_instance(fixture: Fixture[S], kind: type) -> None:
    """Raise ConformanceError unless the factory has built an object of a class."""
    got = fixture.instance
    require(isinstance(got, kind), f"{type(got).__name__} is not a {kind.__name__}")


def resolve(kind: type[S], spec: S | str) -> S:
    """Return a spec; a name is looked up among the installed plugins."""
    return registry().get(kind, spec) if isinstance(spec, str) else spec


def spec_checks() -> Checks[Any]:
    """Return the checks of any spec; their fixtures have an attribute `configured`."""
    checks: Checks[Any] = Checks()

    @checks.specified_in("wearsim.plugins.Spec")
    def spec_is_complete(fixture: Any) -> None:
        """A spec has the current protocol, a name of lower-case words and a summary of one line."""
        spec = fixture.configured.spec
        require(
            spec.protocol == PROTOCOL,
            f"the spec has protocol {spec.protocol}, and wearsim has protocol {PROTOCOL}",
        )
        require(
            re.fullmatch(r"[a-z][a-z0-9]*(-[a-z0-9]+)*", spec.name),
            f"the name {spec.name!r} does not consist of lower-case words joined by hyphens",
        )
        require(spec.summary.strip() and "\n" not in spec.summary, "the summary is not one line")
        require(
            isinstance(spec.references, tuple)
            and all(isinstance(item, str) for item in spec.references),
            "the references are not a tuple of strings",
        )

    @checks.specified_in("wearsim.plugins.Options")
    def options_reject_unknown_keys(fixture: Any) -> None:
        """Options reject unknown keys and are immutable."""
        model = fixture.configured.spec.options
        require(issubclass(model, Options), f"{model.__name__} is not derived from Options")
        require(
            model.model_config.get("extra") == "forbid" and model.model_config.get("frozen"),
            f"{model.__name__} accepts unknown keys, or its values can be changed",
        )

    return checks
