"""Specs under test: options, instances, and the requirements common to all specs."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from wearsim.plugins import (
    ContactModelSpec,
    LoadSpec,
    Options,
    Quantity,
    RandomInputSpec,
    WearLawSpec,
    registry,
)
from wearsim.plugins.specs import PROTOCOL
from wearsim.testing.checks import Checks, require

if TYPE_CHECKING:
    from wearsim.units import Kind

S = TypeVar("S", ContactModelSpec, WearLawSpec, LoadSpec, RandomInputSpec)


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
        """The validated options."""
        context: dict[str, Any] = {"read": self.files.__getitem__}
        if self.kind is not None:
            context["quantity"] = Quantity(self.kind)
        return self.spec.options.model_validate(dict(self.raw), context=context)

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
        factory: Callable[..., Any] = self.configured.spec.factory
        return factory(self.configured.options)

    @cached_property
    def instance(self) -> Any:
        """The instance that all checks share: earlier calls must not change later results."""
        return self.fresh()


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
