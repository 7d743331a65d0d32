"""Base classes of laws, loads and random inputs that plugins add, and the specs of all hooks."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any, ClassVar, Literal, TypeAlias

import numpy as np
from pydantic import BaseModel, ConfigDict

from wearsim.errors import PluginError
from wearsim.plugins.contact_model import Capabilities, ContactModel
from wearsim.plugins.laws import FatigueLaw, MotionLaw, WearLaw
from wearsim.types import FloatArray, Grid, Material
from wearsim.uq.distributions.base import Distribution as Distribution  # noqa: PLC0414  (exported)

_NO_TIMES: FloatArray = np.zeros((0, 2))
_NO_TIMES.flags.writeable = False
PROTOCOL = 2  # version of the plugin interface; docs/plugins.md describes the changes
Frame: TypeAlias = Literal["contact", "cylinder", "roller"]
#: uniform random numbers of one stream, by first index and count; reproducible by index
Uniforms: TypeAlias = Callable[[int, int], FloatArray]
Materials: TypeAlias = tuple[Material, Material]
SuggestGrid: TypeAlias = Callable[[Any, float, float, float, Materials], Grid | None]


class Load(ABC):
    """Load on a roller as a function of time, before any feedback.

    `stiffness` [N/m] is the decrease of the load per displacement of the roller: its worn descent,
    less the fall of the elastic approach from that of unworn bodies under the same load.
    """

    stiffness: float = 0.0
    #: whether the load is the same at all times; it is then computed once
    constant: bool = False

    @property
    def span(self) -> tuple[float, float] | None:
        """First and last time at which the load is known [s], or None if at all times."""
        return None

    @abstractmethod
    def force(self, time: FloatArray) -> FloatArray:
        """Return the load at each `time` [s], shape as `time` [N]."""

    @abstractmethod
    def mean(self, start: float, stop: float) -> float:
        """Return the exact mean of the load between two times [s] [N]."""

    def extremes(self, start: float, stop: float) -> tuple[float, float]:
        """Return the minimum and maximum load between two times [s] [N]; by default sampled."""
        forces = self.force(np.linspace(start, stop, 10_001))
        return float(forces.min()), float(forces.max())

    def deviation(self, start: float, stop: float) -> float:
        """Return the exact standard deviation of the load between two times [s] [N]."""
        return 0.0

    @property
    def pauses(self) -> FloatArray:
        """Start and end of times at zero load, in order, shape (pauses, 2) [s].

        The bodies do not touch in a pause, and nothing wears. Elsewhere a load that falls to zero
        is an error.
        """
        return _NO_TIMES

    @property
    def gaps(self) -> FloatArray:
        """Start and end of gaps in a log, in order, shape (gaps, 2) [s]."""
        return _NO_TIMES


class LoadTerm(ABC):
    """Term added to a load; its state is one force per roller [N] that follows the power."""

    @abstractmethod
    def advance(self, state: FloatArray, power: FloatArray, duration: float) -> FloatArray:
        """Return the state, shape (rollers,), after `duration` [s] at constant `power` [W]."""

    @abstractmethod
    def mean_force(self, state: FloatArray, power: FloatArray, duration: float) -> FloatArray:
        """Return the mean of the term over `duration` [s], shape (rollers,) [N]."""

    def lag(self) -> tuple[float, float] | None:
        """Return gain [N/W] and time constant [s] if the term is a first-order lag, else None.

        The compiled per-pass loop supports first-order lags only; other terms need Python.
        """
        return None


@dataclass(frozen=True)
class AxialPair:
    """Pair of bodies for which an axial profile is designed.

    Parameters
    ----------
    width : float or None
        Width of the roller, if the scenario gives it [m].
    contact_modulus : float
        E* of the materials [Pa].
    curvature : float
        Relative curvature along rolling, on the base circle of a cam [1/m].
    """

    width: float | None
    contact_modulus: float
    curvature: float


class AxialProfile(ABC):
    """Form of a body along its axis, without its measured start profile.

    Attributes
    ----------
    length : float
        Length of the body, which ends at a distance of half of it from the middle [m].
    crown_radius : float or None
        R of a circular crown, whose drop is s^2/(2 R) [m]; infinite for a straight body.
    """

    length: float = math.inf
    crown_radius: float | None = None

    @abstractmethod
    def drop(self, s: FloatArray) -> FloatArray:
        """Return the distance of the surface below its highest line.

        Parameters
        ----------
        s : ndarray
            Axial distance from the middle of the body, within its length [m].

        Returns
        -------
        ndarray
            Same shape; not negative [m].
        """


class JointDistribution(ABC):
    """Joint distribution of several random numbers, such as the misalignment angles of a roller.

    Attributes
    ----------
    components : tuple of str
        Keys of the scenario's table that are set, such as ("yaw", "tilt").
    dimension : int
        Number of independent uniform random numbers per realisation.
    """

    components: tuple[str, ...] = ()
    dimension: int = 1

    @abstractmethod
    def values(self, uniform: FloatArray) -> FloatArray:
        """Return the components, shape (draws, components), from uniforms (draws, dimension)."""

    @property
    @abstractmethod
    def mean(self) -> tuple[float, ...]:
        """Mean of each component."""

    @property
    @abstractmethod
    def reach(self) -> tuple[float, ...]:
        """Maximum magnitude of each component."""


class FrictionField(ABC):
    """Random field of the friction coefficient within one contact.

    Attributes
    ----------
    frame : {"contact", "cylinder", "roller"}
        Frame in which the field is fixed: the contact, or a body that carries it through.
    marginal : Distribution
        Distribution of the friction coefficient at a point.
    """

    frame: Frame = "contact"
    marginal: Distribution

    @abstractmethod
    def values(self, x: FloatArray, y: FloatArray, uniforms: Uniforms) -> FloatArray:
        """Return one realisation of the friction coefficient at given points.

        Parameters
        ----------
        x : ndarray, shape (points, strips)
            Position along rolling, starting at the leading edge [m].
        y : ndarray, shape (strips,)
            Axial position [m].
        uniforms : callable
            Stream of uniform random numbers of the realisation.

        Returns
        -------
        ndarray, shape (points, strips)
        """

    def unresolved(self, along: float, across: float) -> str | None:
        """Return why a grid of these spacings [m] does not resolve the field, or None."""
        return None

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the validity, for the user."""
        return self.marginal.warnings


class Process(ABC):
    """Random process in time, linear between the points of an equally spaced time grid.

    Attributes
    ----------
    marginal : Distribution
        Distribution at a point of the time grid.
    spacing : float
        Spacing of the time grid [s].
    """

    marginal: Distribution
    spacing: float

    @abstractmethod
    def path(self, points: int, uniforms: Uniforms) -> FloatArray:
        """Return one realisation at the times 0, spacing, 2 spacing, ..., shape (points,).

        A longer path starts with the values of a shorter one, bit for bit.
        """

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the validity, for the user."""
        return self.marginal.warnings


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
        role = getattr(self, "role", None)  # of the specs that have roles
        return [role] if role else []


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
    reference : bool
        Whether the model is costly and meant for the errors of others. A comparison of all models
        leaves it out unless it is named.
    """

    kind: ClassVar[str] = "contact model"

    factory: Callable[[Any, Grid, Materials], ContactModel] = field(kw_only=True)
    capabilities: Capabilities = field(kw_only=True, default=Capabilities())
    suggest_grid: SuggestGrid | None = field(kw_only=True, default=None)
    reference: bool = field(kw_only=True, default=False)

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


@dataclass(frozen=True)
class FatigueLawSpec(Spec):
    """Spec of a fatigue law, selected by the key `law` of a body in the table [fatigue].

    Parameters
    ----------
    factory : callable
        ``factory(options, contact_modulus)`` returns a FatigueLaw for bodies with the contact
        modulus E* [Pa].
    """

    kind: ClassVar[str] = "fatigue law"

    factory: Callable[[Any, float], FatigueLaw] = field(kw_only=True)


@dataclass(frozen=True)
class MotionLawSpec(Spec):
    """Spec of a motion law, selected by the key `law` of an entry of ``cam.motion``.

    Parameters
    ----------
    factory : callable
        ``factory(options, angle, rise, unit)`` returns a MotionLaw for a segment of `angle` [rad]
        over which the follower rises by `rise`, in `unit`: "m", or "rad" for a swinging arm.
    rise : {"required", "none", "own"}
        Whether the entry gives a rise, or the law has none, or finds it from its options.
    """

    kind: ClassVar[str] = "motion law"

    factory: Callable[[Any, float, float, str], MotionLaw] = field(kw_only=True)
    rise: Literal["required", "none", "own"] = "required"


@dataclass(frozen=True)
class AxialProfileSpec(Spec):
    """Spec of an axial profile, selected by the key `form` of a table ``axial_profile``.

    Parameters
    ----------
    factory : callable
        ``factory(options, pair)`` returns an AxialProfile for an `AxialPair`.
    """

    kind: ClassVar[str] = "axial profile"

    factory: Callable[[Any, AxialPair], AxialProfile] = field(kw_only=True)


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


@dataclass(frozen=True)
class TableSpec(Spec):
    """Spec of a table of the scenario that a plugin owns, ``[NAME]``.

    Its options are validated with the scenario, and stored in ``Scenario.tables`` by name. They
    have no effect on studies other than the plugin's own.
    """

    kind: ClassVar[str] = "scenario table"


@dataclass(frozen=True)
class StudyKind(Spec):
    """Spec of a kind of study: its results, their file, and how they are shown and continued.

    References have the form "package.module:name" and are imported when they are needed.

    Parameters
    ----------
    result : str
        Reference of the class of its results, derived from `wearsim.results.content.StudyResult` if
        it has a file.
    view : str
        Reference of a class derived from `wearsim.report.view.View`, or of a function that returns
        such a view; called with a result.
    data : str
        Reference of the class of the content of its files, derived from
        `wearsim.results.content.StudyData`, which has their schema.
    format : str
        Name of the format of its files, "wearsim-run"; empty if it has none.
    read : str
        Reference of a function that reads the content of a file, if it takes more than its schema.
    marked_by : str
        Field of the file that is not empty, for a kind that shares the format of another one.
    holds : str
        Content of a file and the command that writes it, for messages.
    resume : str
        Reference of a function that continues a study from its file; empty if there is none. That
        of a plugin is called as ``resume(file, workers=..., scheduler=..., on_progress=...,
        on_notice=..., stop_requested=...)``, where ``on_progress(done, total, text)`` shows how far
        it is.
    compare : str
        Reference of a function that returns the view of several results; kinds with the same one
        can be compared with each other.
    """

    kind: ClassVar[str] = "study kind"

    options: type[Options] = field(kw_only=True, default=Options)
    result: str = field(kw_only=True)
    view: str = field(kw_only=True)
    data: str = field(kw_only=True, default="")
    format: str = field(kw_only=True, default="")
    read: str = field(kw_only=True, default="")
    marked_by: str = field(kw_only=True, default="")
    holds: str = field(kw_only=True, default="")
    resume: str = field(kw_only=True, default="")
    compare: str = field(kw_only=True, default="")

    def load(self, name: str) -> Any:
        """Return what the reference in a field names, such as "result".

        Raises
        ------
        PluginError
            If there is no such module, or nothing of this name in it.
        """
        reference = getattr(self, name)
        module, _, item = reference.partition(":")
        try:
            return getattr(import_module(module), item)
        except (ImportError, AttributeError, ValueError) as error:
            raise PluginError(
                f"study kind '{self.name}': its {name}, {reference!r}, cannot be imported"
                f" ({error}); correct the reference in the plugin"
            ) from error
