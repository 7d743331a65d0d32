"""Hooks that a plugin can implement, and the registry of plugins found by entry points."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, distribution, entry_points
from typing import TypeVar

import pluggy

from wearsim.errors import PluginError, described
from wearsim.plugins.specs import (
    PROTOCOL,
    AxialProfileSpec,
    ContactModelSpec,
    LoadSpec,
    MotionLawSpec,
    RandomInputSpec,
    Spec,
    StudyKind,
    TableSpec,
    WearLawSpec,
)

PROJECT = "wearsim"

hookspec = pluggy.HookspecMarker(PROJECT)
hookimpl = pluggy.HookimplMarker(PROJECT)
S = TypeVar("S", bound=Spec)
MIGRATION = "docs/plugins.md, section 'Migration to protocol 2'"
_HOOKS: dict[type[Spec], str] = {
    ContactModelSpec: "wearsim_contact_models",
    WearLawSpec: "wearsim_wear_laws",
    LoadSpec: "wearsim_loads",
    RandomInputSpec: "wearsim_random_inputs",
    MotionLawSpec: "wearsim_motion_laws",
    AxialProfileSpec: "wearsim_axial_profiles",
    StudyKind: "wearsim_study_kinds",
    TableSpec: "wearsim_tables",
}
#: modules of wearsim that implement hooks; they need no entry point
_BUILT_IN = {"builtin": "wearsim.models", "studies": "wearsim.studies.kinds"}


class HookSpecs:
    """The hooks of the entry-point group `wearsim`."""

    @hookspec
    def wearsim_contact_models(self) -> Iterable[ContactModelSpec]:  # type: ignore[empty-body]
        """Yield contact models, selected in a scenario by ``contact.model``.

        The requirements are documented in `ContactModel` and `SingleContactModel` and tested by
        `wearsim.testing.contact_model_tests`; ``wearsim new plugin NAME`` writes a complete one.

        Returns
        -------
        iterable of ContactModelSpec

        Examples
        --------
        .. code-block:: python

            from wearsim.plugins import ContactModelSpec, Options, hookimpl
            from my_package.foundation import Foundation


            class FoundationOptions(Options):
                foundation_modulus: float = 2.0e13  # Pa/m


            @hookimpl
            def wearsim_contact_models():
                yield ContactModelSpec(
                    name="foundation",
                    factory=Foundation,  # called with options, grid and materials
                    options=FoundationOptions,
                    summary="elastic foundation",
                    protocol=2,
                )
        """

    @hookspec
    def wearsim_wear_laws(self) -> Iterable[WearLawSpec]:  # type: ignore[empty-body]
        """Yield wear laws, selected in a scenario by ``wear.law``.

        The requirements are documented in `WearLaw` and tested by
        `wearsim.testing.wear_law_tests`.

        Returns
        -------
        iterable of WearLawSpec

        Examples
        --------
        .. code-block:: python

            from wearsim.plugins import Options, WearLaw, WearLawSpec, hookimpl


            class PerPass(Options):
                depth: float = 1e-12  # m, where the bodies slide


            class Constant(WearLaw):
                def __init__(self, options):
                    self.depth = options.depth

                def depth_per_pass(self, body, solution, rolling_speed):
                    return self.depth * (solution.dissipation > 0.0)


            @hookimpl
            def wearsim_wear_laws():
                yield WearLawSpec(
                    name="constant-depth",
                    factory=Constant,
                    options=PerPass,
                    summary="the same depth in every pass",
                    protocol=2,
                )
        """

    @hookspec
    def wearsim_loads(self) -> Iterable[LoadSpec]:  # type: ignore[empty-body]
        """Yield loads, selected by ``load.kind``, and terms, added by a table ``[load.NAME]``.

        The requirements are documented in `Load` and `LoadTerm` and tested by
        `wearsim.testing.load_tests`.

        Returns
        -------
        iterable of LoadSpec

        Examples
        --------
        .. code-block:: python

            import numpy as np
            from wearsim.plugins import Load, LoadSpec, Options, hookimpl


            class RampOptions(Options):
                start: float = 300.0  # N
                slope: float = 0.001  # N/s


            class Ramp(Load):
                def __init__(self, options):
                    self.options = options

                def force(self, time):
                    return self.options.start + self.options.slope * np.asarray(time)

                def mean(self, start, stop):
                    return float(self.force(0.5 * (start + stop)))

                def deviation(self, start, stop):
                    return abs(self.options.slope) * (stop - start) / 12**0.5


            @hookimpl
            def wearsim_loads():
                yield LoadSpec(
                    name="ramp",
                    factory=Ramp,
                    options=RampOptions,
                    summary="a rising load",
                    protocol=2,
                )
        """

    @hookspec
    def wearsim_random_inputs(self) -> Iterable[RandomInputSpec]:  # type: ignore[empty-body]
        """Yield random inputs, selected by ``distribution`` in the table that replaces a value.

        Options in the unit of the replaced value have the types `Value`, `PositiveValue` and
        `Limit`: "300 N" for a load, a plain number for a coefficient. The requirements are
        documented in `Distribution`, `JointDistribution`, `FrictionField` and `Process` and tested
        by `wearsim.testing.random_input_tests`.

        Returns
        -------
        iterable of RandomInputSpec

        Examples
        --------
        .. code-block:: python

            from wearsim.plugins import Distribution, Options, RandomInputSpec, Value, hookimpl


            class Bounds(Options):
                low: Value
                high: Value


            class Flat(Distribution):
                def __init__(self, options):
                    self.options = options

                def quantile(self, probability):
                    return self.options.low + (self.options.high - self.options.low) * probability


            @hookimpl
            def wearsim_random_inputs():
                yield RandomInputSpec(
                    name="flat",
                    factory=Flat,
                    options=Bounds,
                    summary="uniform between two bounds",
                    protocol=2,
                )
        """

    @hookspec
    def wearsim_motion_laws(self) -> Iterable[MotionLawSpec]:  # type: ignore[empty-body]
        """Yield motion laws, selected by ``law`` in the entries of ``cam.motion``.

        The requirements are documented in `MotionLaw` and tested by
        `wearsim.testing.motion_law_tests`.

        Returns
        -------
        iterable of MotionLawSpec

        Examples
        --------
        .. code-block:: python

            import numpy as np
            from wearsim.plugins import MotionLaw, MotionLawSpec, Options, hookimpl


            class Cosine(MotionLaw):
                def __init__(self, options, angle, rise, unit):
                    self.rate, self.height = np.pi / angle, 0.5 * rise

                def lift(self, angle):
                    turn = self.rate * angle
                    waves = 1.0 - np.cos(turn), np.sin(turn), np.cos(turn)
                    return self.height * np.stack([w * self.rate**k for k, w in enumerate(waves)])


            @hookimpl
            def wearsim_motion_laws():
                yield MotionLawSpec(
                    name="cosine",
                    factory=Cosine,
                    options=Options,
                    summary="half a period of a cosine",
                    protocol=2,
                )
        """

    @hookspec
    def wearsim_axial_profiles(self) -> Iterable[AxialProfileSpec]:  # type: ignore[empty-body]
        """Yield forms of bodies along their axis, selected by ``form`` in ``axial_profile``.

        The requirements are documented in `AxialProfile` and tested by
        `wearsim.testing.axial_profile_tests`.

        Returns
        -------
        iterable of AxialProfileSpec

        Examples
        --------
        .. code-block:: python

            from wearsim.plugins import (
                AxialProfile,
                AxialProfileSpec,
                Options,
                PositiveLength,
                hookimpl,
            )


            class QuarticOptions(Options):
                length: PositiveLength
                drop: PositiveLength


            class Quartic(AxialProfile):
                def __init__(self, options, pair):
                    self.length, self.end = options.length, options.drop

                def drop(self, s):
                    return self.end * (2.0 * s / self.length) ** 4


            @hookimpl
            def wearsim_axial_profiles():
                yield AxialProfileSpec(
                    name="quartic",
                    factory=Quartic,
                    options=QuarticOptions,
                    summary="drop with the fourth power of the distance from the middle",
                    protocol=2,
                )
        """

    @hookspec
    def wearsim_study_kinds(self) -> Iterable[StudyKind]:  # type: ignore[empty-body]
        """Yield kinds of studies, whose files all verbs for results open.

        The requirements are documented in `StudyKind`, `StudyResult` and `View` and tested by
        `wearsim.testing.study_kind_tests`.

        Returns
        -------
        iterable of StudyKind

        Examples
        --------
        .. code-block:: python

            from wearsim.plugins import StudyKind, hookimpl


            @hookimpl
            def wearsim_study_kinds():
                yield StudyKind(
                    name="survey",
                    summary="depths of several grooves",
                    result="my_package.survey:SurveyResult",
                    view="my_package.survey:SurveyView",
                    data="my_package.survey:SurveyData",
                    format="my-package-survey",
                    holds="depths of several grooves, from `wearsim survey`",
                    protocol=2,
                )
        """

    @hookspec
    def wearsim_tables(self) -> Iterable[TableSpec]:  # type: ignore[empty-body]
        """Yield tables of the scenario that the plugin owns; see `TableSpec`.

        Examples
        --------
        .. code-block:: python

            from wearsim.plugins import Options, PositiveLength, TableSpec, hookimpl


            class SurveyOptions(Options):
                spacing: PositiveLength = 1e-3  # between the grooves


            @hookimpl
            def wearsim_tables():
                yield TableSpec("survey", SurveyOptions, "grooves of a survey", protocol=2)
        """


@dataclass(frozen=True)
class Registered:
    """Spec with the name and version of its distribution."""

    spec: Spec
    distribution: str
    version: str

    @property
    def refusal(self) -> str | None:
        """Why a scenario cannot select the spec, if it is of another protocol."""
        spec = self.spec
        if spec.protocol == PROTOCOL:
            return None
        older = spec.protocol < PROTOCOL
        remedy = "a newer version of the plugin" if older else "a newer wearsim"
        return (
            f"{spec.kind} '{spec.name}' of {self.distribution} {self.version} is written for plugin"
            f" protocol {spec.protocol}, and this wearsim has {PROTOCOL}; install {remedy},"
            f" or change the plugin as described at {MIGRATION}"
        )


@dataclass(frozen=True)
class Broken:
    """Plugin that could not be loaded, with the cause."""

    entry_point: str
    distribution: str
    version: str
    cause: str


class Registry:
    """All registered specs, by kind and name.

    Parameters
    ----------
    points : iterable of EntryPoint
        The entry points of the group `wearsim`.

    Raises
    ------
    PluginError
        If two plugins register the same name, or a hook does not fit its specification.
    """

    def __init__(self, points: Iterable[EntryPoint]) -> None:
        self.broken: list[Broken] = []
        self._specs: dict[type[Spec], dict[str, Registered]] = {kind: {} for kind in _HOOKS}
        for point in sorted(points, key=lambda p: (p.name, p.value)):
            self._load(point)

    def _load(self, point: EntryPoint) -> None:
        dist = point.dist or (distribution(PROJECT) if point.value in _BUILT_IN.values() else None)
        name, version = (dist.name, dist.version) if dist else ("unknown distribution", "?")
        manager = pluggy.PluginManager(PROJECT)
        manager.add_hookspecs(HookSpecs)
        try:
            manager.register(point.load(), name=point.name)
            manager.check_pending()
            specs = {
                kind: [spec for batch in getattr(manager.hook, hook)() for spec in batch]
                for kind, hook in _HOOKS.items()
            }
        except pluggy.PluginValidationError as error:
            raise PluginError(
                f"plugin '{point.name}' of {name} {version} does not match the hooks: {error};"
                f" the hooks are {', '.join(_HOOKS.values())}, without arguments"
            ) from error
        except (Exception, SystemExit) as error:  # scenarios without this plugin must work
            self.broken.append(
                Broken(point.name, name, version, f"{type(error).__name__}: {described(error)}")
            )
            return
        for kind, yielded in specs.items():
            for spec in yielded:
                self._add(kind, Registered(spec, name, version))

    def _add(self, kind: type[Spec], item: Registered) -> None:
        if not isinstance(item.spec, kind):
            raise PluginError(
                f"{item.distribution} {item.version}: hook {_HOOKS[kind]} yielded"
                f" {item.spec!r}, expected a {kind.__name__}"
            )
        other = self._specs[kind].setdefault(item.spec.name, item)
        if other is not item:
            raise PluginError(
                f"two plugins register a {kind.kind} named '{item.spec.name}':"
                f" {other.distribution} {other.version} and {item.distribution} {item.version};"
                " uninstall one of them"
            )

    def all(self) -> list[Registered]:
        """Return all registered specs, sorted by kind and then by name."""
        return [item for items in self._specs.values() for _, item in sorted(items.items())]

    def names(self, kind: type[Spec]) -> list[str]:
        """Return the sorted names of the specs of `kind` that a scenario can select."""
        specs = self._specs[kind]
        return sorted(name for name, item in specs.items() if item.refusal is None)

    def get(self, kind: type[S], name: str) -> S:
        """Return the spec of `kind` called `name`.

        Raises
        ------
        PluginError
            If there is none; the message includes broken plugins and their causes. If it is of
            another protocol; the message has both protocols.
        """
        item = self._specs[kind].get(name)
        if item is not None and isinstance(item.spec, kind):
            if item.refusal is not None:
                raise PluginError(item.refusal)
            return item.spec
        known = self.names(kind)
        text = f"no {kind.kind} is named '{name}'; known: {', '.join(known) or 'none'}"
        if near := difflib.get_close_matches(name, known, n=1):
            text += f"; did you mean '{near[0]}'?"
        for broken in self.broken:
            text += (
                f"; plugin '{broken.entry_point}' of {broken.distribution} {broken.version}"
                f" failed to load ({broken.cause})"
            )
        raise PluginError(text)

    def registered(self, kind: type[Spec], name: str) -> Registered:
        """Return the spec called `name` with its distribution; errors as in `get`."""
        return self._specs[kind][self.get(kind, name).name]


@cache
def registry() -> Registry:
    """Return the registry of the installed plugins, built once per process."""
    built_in = [EntryPoint(name, value, PROJECT) for name, value in _BUILT_IN.items()]
    installed = entry_points(group=PROJECT)
    return Registry([*built_in, *(p for p in installed if p.value not in _BUILT_IN.values())])
