"""What a plugin's hook yields: a name, how to build the thing, and what can be said of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

from pydantic import BaseModel, ConfigDict

from wearsim.plugins.capabilities import Capabilities
from wearsim.plugins.contact_model import ContactModel
from wearsim.plugins.protocols import Load, LoadTerm, WearLaw
from wearsim.plugins.random_inputs import Distribution, FrictionField, JointDistribution, Process


class Options(BaseModel):
    """Base of every options model: frozen, and strict about names."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, arbitrary_types_allowed=True, allow_inf_nan=False
    )


@dataclass(frozen=True)
class Spec:
    """What all specs share.

    Parameters
    ----------
    name : str
        The name a scenario asks for.
    options : type of Options
        The table's remaining keys, validated.
    summary : str
        One line for lists.
    references : tuple of str
        Sources: paper, equation, DOI.
    """

    kind: ClassVar[str] = ""

    name: str
    options: type[Options]
    summary: str
    references: tuple[str, ...] = ()

    def describe(self) -> list[str]:
        """Return the capabilities as words."""
        return []


@dataclass(frozen=True)
class ContactModelSpec(Spec):
    """A contact model: `factory(options)` builds it."""

    kind: ClassVar[str] = "contact model"

    factory: Callable[[Any], ContactModel] = field(kw_only=True)
    capabilities: Capabilities = field(kw_only=True, default=Capabilities())

    def describe(self) -> list[str]:
        """Return the capabilities as words."""
        return self.capabilities.names()


@dataclass(frozen=True)
class WearLawSpec(Spec):
    """A wear law: `factory(options)` builds it."""

    kind: ClassVar[str] = "wear law"

    factory: Callable[[Any], WearLaw] = field(kw_only=True)


@dataclass(frozen=True)
class LoadSpec(Spec):
    """A load (`role = "base"`) or a term added to it (`role = "term"`): `factory(options)`."""

    kind: ClassVar[str] = "load"

    factory: Callable[[Any], Load | LoadTerm] = field(kw_only=True)
    role: Literal["base", "term"] = "base"

    def describe(self) -> list[str]:
        """Return the role as a word."""
        return [self.role]


@dataclass(frozen=True)
class RandomInputSpec(Spec):
    """A random input, chosen by the key `distribution` of the table that stands for a value.

    Parameters
    ----------
    factory : callable
        `factory(options)` builds a Distribution or, with ``role = "joint"``, a JointDistribution;
        with ``role = "field"`` and ``role = "process"`` it is `factory(options, marginal)`, the
        marginal Distribution being read from the sub-table `marginal`.
    role : {"scalar", "joint", "field", "process"}
        What it builds.
    """

    kind: ClassVar[str] = "random input"

    factory: Callable[..., Distribution | JointDistribution | FrictionField | Process] = field(
        kw_only=True
    )
    role: Literal["scalar", "joint", "field", "process"] = "scalar"

    def describe(self) -> list[str]:
        """Return the role as a word."""
        return [self.role]
