"""The registry of plugins found by entry points, and the building of plugins."""

from __future__ import annotations

import difflib
import inspect
import traceback
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, distribution, entry_points
from numbers import Real
from typing import Any, TypeVar

import numpy as np
import pluggy

from wearsim.errors import PluginError, described
from wearsim.plugins.hooks import PROJECT, HookSpecs
from wearsim.plugins.specs import (
    PROTOCOL,
    AxialProfileSpec,
    ContactModelSpec,
    FatigueLawSpec,
    LoadSpec,
    MotionLawSpec,
    Options,
    RandomInputSpec,
    Spec,
    StudyKind,
    TableSpec,
    WearLawSpec,
)

S = TypeVar("S", bound=Spec)
Built = TypeVar("Built")
MIGRATION = "docs/plugins.md, section 'Migration to protocol 2'"
_HOOKS: dict[type[Spec], str] = {
    ContactModelSpec: "wearsim_contact_models",
    WearLawSpec: "wearsim_wear_laws",
    LoadSpec: "wearsim_loads",
    RandomInputSpec: "wearsim_random_inputs",
    MotionLawSpec: "wearsim_motion_laws",
    AxialProfileSpec: "wearsim_axial_profiles",
    FatigueLawSpec: "wearsim_fatigue_laws",
    StudyKind: "wearsim_study_kinds",
    TableSpec: "wearsim_tables",
}
#: words that a field of a spec may hold
_WORDS: dict[type[Spec], tuple[str, tuple[str, ...]]] = {
    LoadSpec: ("role", ("base", "term")),
    MotionLawSpec: ("rise", ("required", "none", "own")),
    RandomInputSpec: ("role", ("scalar", "joint", "field", "process")),
}
#: modules of wearsim that implement hooks; they need no entry point
_BUILT_IN = {"builtin": "wearsim.models", "studies": "wearsim.studies.kinds"}


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
        remedy = "a newer version of the plugin" if spec.protocol < PROTOCOL else "a newer wearsim"
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
        self._packages: dict[str, str] = {}
        for point in sorted(points, key=lambda p: (p.name, p.value)):
            self._load(point)

    def _load(self, point: EntryPoint) -> None:
        dist = point.dist or (distribution(PROJECT) if point.value in _BUILT_IN.values() else None)
        name, version = (dist.name, dist.version) if dist else ("unknown distribution", "?")
        if name != PROJECT:
            package = point.value.partition(":")[0].partition(".")[0]
            self._packages[package] = f"plugin '{point.name}' of {name} {version}"
        manager = pluggy.PluginManager(PROJECT)
        manager.add_hookspecs(HookSpecs)
        try:
            module = point.load()
            manager.register(module, name=point.name)
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
        for hook in _HOOKS.values():
            function = vars(module).get(hook) if hasattr(module, "__dict__") else None
            if callable(function) and not hasattr(function, f"{PROJECT}_impl"):
                raise PluginError(
                    f"plugin '{point.name}' of {name} {version}: the function {hook} is no hook;"
                    " write @hookimpl above it, from wearsim.plugins"
                )
        for kind, yielded in specs.items():
            for spec in yielded:
                self._add(kind, Registered(spec, name, version))

    def _add(self, kind: type[Spec], item: Registered) -> None:
        if not isinstance(item.spec, kind):
            raise PluginError(
                f"{item.distribution} {item.version}: hook {_HOOKS[kind]} yielded"
                f" {item.spec!r}, expected a {kind.__name__}"
            )
        if fault := _fault(kind, item.spec):
            raise PluginError(
                f"{item.distribution} {item.version}: the {kind.__name__} of {item.spec.name!r}"
                f" has the {fault}"
            )
        self._refuse_format(item)
        other = self._specs[kind].setdefault(item.spec.name, item)
        if other is not item:
            raise PluginError(
                f"two plugins register a {kind.kind} named '{item.spec.name}':"
                f" {other.distribution} {other.version} and {item.distribution} {item.version};"
                " uninstall one of them"
            )

    def _refuse_format(self, item: Registered) -> None:
        """Raise a PluginError if another kind of study has the same files, and nothing marks it."""
        format_, marked_by = getattr(item.spec, "format", ""), getattr(item.spec, "marked_by", "")
        for other in self._specs[StudyKind].values() if format_ else ():
            kind = other.spec
            same = isinstance(kind, StudyKind) and (kind.format, kind.marked_by)
            if same == (format_, marked_by) and kind.name != item.spec.name:
                raise PluginError(
                    f"two study kinds have the format '{format_}': '{kind.name}' of"
                    f" {other.distribution} {other.version} and '{item.spec.name}' of"
                    f" {item.distribution} {item.version}; change it in the plugin"
                )

    def all(self) -> list[Registered]:
        """Return all registered specs, sorted by kind and then by name."""
        return [item for items in self._specs.values() for _, item in sorted(items.items())]

    def names(self, kind: type[Spec]) -> list[str]:
        """Return the sorted names of the specs of `kind` that a scenario can select."""
        return sorted(name for name, item in self._specs[kind].items() if item.refusal is None)

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
        parts = [
            text,
            *(f"did you mean '{other}'?" for other in difflib.get_close_matches(name, known, n=1)),
            *(
                f"plugin '{broken.entry_point}' of {broken.distribution} {broken.version}"
                f" failed to load ({broken.cause})"
                for broken in self.broken
            ),
        ]
        raise PluginError("; ".join(parts))

    def registered(self, kind: type[Spec], name: str) -> Registered:
        """Return the spec called `name` with its distribution; errors as in `get`."""
        return self._specs[kind][self.get(kind, name).name]

    def raised_in(self, error: BaseException) -> str | None:
        """Return the plugin that raised an error, with file and line, or None if none did."""
        for frame, line in reversed(list(traceback.walk_tb(error.__traceback__))):
            package = str(frame.f_globals.get("__name__", "")).partition(".")[0]
            if package in self._packages:
                place = f"{frame.f_code.co_name}, line {line} of {frame.f_code.co_filename}"
                return f"{self._packages[package]}, {place}"
        return None


def _fault(kind: type[Spec], spec: Any) -> str | None:
    """Return the first field of a spec with a value that cannot be used, or None."""
    derived = isinstance(spec.options, type) and issubclass(spec.options, Options)
    checks = [
        ("name", isinstance(spec.name, str) and spec.name, "a text"),
        ("options", derived, "a class derived from Options"),
        ("protocol", isinstance(spec.protocol, int), f"the number {PROTOCOL}"),
        ("factory", callable(getattr(spec, "factory", print)), "a class or a function"),
    ]
    if isinstance(spec, StudyKind):
        of_file = ("read" if spec.read else "data",) if spec.format else ()
        checks += [
            (
                name,
                all(str(getattr(spec, name)).partition(":")),
                "a reference 'package.module:name'",
            )
            for name in ("result", "view", *of_file)
        ]
    if kind in _WORDS:
        field, words = _WORDS[kind]
        checks.append((field, getattr(spec, field) in words, f"one of {', '.join(words)}"))
    faults = (
        f"{field} {getattr(spec, field)!r}, expected {expected}"
        for field, fits, expected in checks
        if not fits
    )
    return next(faults, None)


@cache
def registry() -> Registry:
    """Return the registry of the installed plugins, built once per process."""
    built_in = [EntryPoint(name, value, PROJECT) for name, value in _BUILT_IN.items()]
    installed = entry_points(group=PROJECT)
    return Registry([*built_in, *(p for p in installed if p.value not in _BUILT_IN.values())])


def built_plugin(
    spec: Any, expected: type[Any], checked: Callable[[Any, str], Built], *arguments: Any
) -> Built:
    """Build the object of a plugin; the values of a third-party plugin are checked from then on.

    Parameters
    ----------
    spec : Spec
        With a factory.
    expected : type
        Class of which the factory must return an object.
    checked : callable
        Returns the object with checks, from the object and the name of the plugin.
    *arguments
        Arguments of the factory.

    Raises
    ------
    PluginError
        If the factory returns an object of another class.
    """
    try:
        built = spec.factory(*arguments)
    except TypeError as error:
        if error.__traceback__ is not None and error.__traceback__.tb_next is not None:
            raise  # of a line in the factory
        raise PluginError(
            f"the factory of {spec.kind} '{spec.name}' cannot be called: {error}"
        ) from error
    if not isinstance(built, expected):
        raise PluginError(
            f"the factory of {spec.kind} '{spec.name}' returned {described_value(built)}, expected"
            f" a {expected.__name__}"
        )
    own: Built = built
    of_wearsim = [
        base for base in type(built).__mro__ if base.__module__.partition(".")[0] == "wearsim"
    ]
    if type(built) in of_wearsim:
        return own
    for base in of_wearsim:
        _refuse_other_arguments(spec, built, base)
    return checked(built, spec.name)


def _refuse_other_arguments(spec: Any, built: object, base: type[Any]) -> None:
    """Raise a PluginError if a required method does not take the arguments of its base class."""
    for name in sorted(getattr(base, "__abstractmethods__", ())):
        required = getattr(base, name)
        if not callable(required):
            continue  # a property
        wanted, own = inspect.signature(required), getattr(built, name)
        given = [item for item in wanted.parameters.values() if item.name != "self"]
        try:
            inspect.signature(own).bind(*given)
        except TypeError as error:
            taken = ", ".join(map(str, inspect.signature(own).parameters))
            raise PluginError(
                f"{name} of {spec.kind} '{spec.name}' takes ({taken}), expected"
                f" ({', '.join(item.name for item in given)})"
            ) from error
        except ValueError:  # a compiled function without a signature
            pass


def described_value(value: object) -> str:
    """Return a value that was returned, as the object of a sentence."""
    if isinstance(value, np.ndarray):
        return f"an array of the shape {value.shape} and type {value.dtype}"
    return repr(value) if value is None or isinstance(value, Real) else f"a {type(value).__name__}"
