"""Specs that the hooks of a plugin yield: name, options, factory and description."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict

from wearsim.plugins.capabilities import Capabilities
from wearsim.plugins.contact_model import ContactModel
from wearsim.plugins.protocols import (
    Distribution,
    FrictionField,
    JointDistribution,
    Load,
    LoadTerm,
    Process,
    WearLaw,
)
from wearsim.types import Grid, Material

Materials: TypeAlias = tuple[Material, Material]
SuggestGrid: TypeAlias = Callable[[Any, float, float, float, Materials], Grid | None]


PROTOCOL = 2  # version of the plugin interface; docs/plugins.md describes the changes


class Options(BaseModel):
    """Base class of options: frozen, and unknown keys are an error."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, arbitrary_types_allowed=True, allow_inf_nan=False
    )


@dataclass(frozen=True)
class Spec:
    """Base class of specs.

    Parameters
    ----------
    name : str
        Name used in a scenario.
    options : type of Options
        Model that validates the remaining keys of the table.
    summary : str
        One line for lists.
    references : tuple of str
        Sources: paper, equation, DOI.
    protocol : int
        Version of the interface that the plugin is written for; `PROTOCOL` is the only one that a
        scenario can select. A spec that gives none is of version 1.
    """

    kind: ClassVar[str] = ""

    name: str
    options: type[Options]
    summary: str
    references: tuple[str, ...] = ()
    protocol: int = field(kw_only=True, default=1)

    def describe(self) -> list[str]:
        """Return the capabilities or the role as words."""
        return []


@dataclass(frozen=True)
class ContactModelSpec(Spec):
    """Spec of a contact model.

    Parameters
    ----------
    factory : callable
        `factory(options, grid, materials)` returns a ContactModel for the strips `grid` and the
        materials of cylinder and roller.
    capabilities : Capabilities
        All capabilities that its models have with some options.
    suggest_grid : callable, optional
        ``suggest_grid(options, gap_curvature, longitudinal_curvature, normal_force, materials)``
        returns a Grid for one contact of unworn bodies centred on y = 0, or None. `gap_curvature`
        is the relative curvature across the track [1/m].
    """

    kind: ClassVar[str] = "contact model"

    factory: Callable[[Any, Grid, Materials], ContactModel] = field(kw_only=True)
    capabilities: Capabilities = field(kw_only=True, default=Capabilities())
    suggest_grid: SuggestGrid | None = field(kw_only=True, default=None)

    def describe(self) -> list[str]:
        """Return the names of the capabilities."""
        return self.capabilities.names()


@dataclass(frozen=True)
class WearLawSpec(Spec):
    """Spec of a wear law, built by `factory(options)`."""

    kind: ClassVar[str] = "wear law"

    factory: Callable[[Any], WearLaw] = field(kw_only=True)


@dataclass(frozen=True)
class LoadSpec(Spec):
    """Spec of a load (role "base") or of a term added to it (role "term")."""

    kind: ClassVar[str] = "load"

    factory: Callable[[Any], Load | LoadTerm] = field(kw_only=True)
    role: Literal["base", "term"] = "base"

    def describe(self) -> list[str]:
        """Return the role."""
        return [self.role]


@dataclass(frozen=True)
class RandomInputSpec(Spec):
    """Spec of a random input, selected by the key `distribution` of a table.

    Parameters
    ----------
    factory : callable
        `factory(options)` returns a Distribution or, with ``role = "joint"``, a JointDistribution;
        with ``role = "field"`` or ``role = "process"``, `factory(options, marginal)` returns a
        FrictionField or a Process. The marginal Distribution is read from the table `marginal`.
    role : {"scalar", "joint", "field", "process"}
        Kind of the object that the factory returns.
    """

    kind: ClassVar[str] = "random input"

    factory: Callable[..., Distribution | JointDistribution | FrictionField | Process] = field(
        kw_only=True
    )
    role: Literal["scalar", "joint", "field", "process"] = "scalar"

    def describe(self) -> list[str]:
        """Return the role."""
        return [self.role]
