"""Finds plugins through their entry points and keeps what they registered."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import TypeVar

import pluggy

from wearsim.errors import PluginError
from wearsim.plugins.hookspecs import PROJECT, HookSpecs
from wearsim.plugins.specs import ContactModelSpec, LoadSpec, RandomInputSpec, Spec, WearLawSpec

S = TypeVar("S", bound=Spec)

_HOOKS: dict[type[Spec], str] = {
    ContactModelSpec: "wearsim_contact_models",
    WearLawSpec: "wearsim_wear_laws",
    LoadSpec: "wearsim_loads",
    RandomInputSpec: "wearsim_random_inputs",
}


@dataclass(frozen=True)
class Registered:
    """A spec, and the distribution that brought it."""

    spec: Spec
    distribution: str
    version: str


@dataclass(frozen=True)
class Broken:
    """A plugin that could not be loaded, with its own cause."""

    entry_point: str
    distribution: str
    version: str
    cause: str


def _origin(entry_point: EntryPoint) -> tuple[str, str]:
    dist = entry_point.dist
    return (dist.name, dist.version) if dist is not None else ("unknown distribution", "?")


class Registry:
    """Everything the plugins registered, by kind and name.

    Parameters
    ----------
    points : iterable of EntryPoint
        The entry points of the group `wearsim`.

    Raises
    ------
    PluginError
        If two plugins share a name, or a hook is misspelt.
    """

    def __init__(self, points: Iterable[EntryPoint]) -> None:
        self.broken: list[Broken] = []
        self._specs: dict[type[Spec], dict[str, Registered]] = {kind: {} for kind in _HOOKS}
        for point in sorted(points, key=lambda p: (p.name, p.value)):
            self._load(point)

    def _load(self, point: EntryPoint) -> None:
        name, version = _origin(point)
        manager = pluggy.PluginManager(PROJECT)
        manager.add_hookspecs(HookSpecs)
        try:
            manager.register(point.load(), name=point.name)
            manager.check_pending()
            found = {
                kind: [spec for batch in getattr(manager.hook, hook)() for spec in batch]
                for kind, hook in _HOOKS.items()
            }
        except pluggy.PluginValidationError as error:
            raise PluginError(
                f"plugin '{point.name}' of {name} {version} does not fit the hooks: {error};"
                f" the hooks are {', '.join(_HOOKS.values())}, without arguments"
            ) from error
        except (Exception, SystemExit) as error:  # whatever it does, it must not take us along
            cause = f"{type(error).__name__}: {error}"
            self.broken.append(Broken(point.name, name, version, cause))
            return
        for kind, specs in found.items():
            for spec in specs:
                self._add(kind, Registered(spec, name, version))

    def _add(self, kind: type[Spec], item: Registered) -> None:
        if not isinstance(item.spec, kind):
            raise PluginError(
                f"{item.distribution} {item.version}: hook {_HOOKS[kind]} yielded"
                f" {item.spec!r}, expected a {kind.__name__}"
            )
        known = self._specs[kind]
        if item.spec.name in known:
            other = known[item.spec.name]
            raise PluginError(
                f"two plugins register a {kind.kind} named '{item.spec.name}':"
                f" {other.distribution} {other.version} and {item.distribution} {item.version};"
                " uninstall one of them"
            )
        known[item.spec.name] = item

    def all(self) -> list[Registered]:
        """Return everything registered, by kind and then by name."""
        return [
            items[name]
            for items in (self._specs[kind] for kind in _HOOKS)
            for name in sorted(items)
        ]

    def names(self, kind: type[Spec]) -> list[str]:
        """Return the names registered for `kind`."""
        return sorted(self._specs[kind])

    def get(self, kind: type[S], name: str) -> S:
        """Return the spec of `kind` called `name`.

        Raises
        ------
        PluginError
            If there is none; broken plugins are named with their causes.
        """
        item = self._specs[kind].get(name)
        if item is None or not isinstance(item.spec, kind):
            raise PluginError(self._unknown(kind, name))
        return item.spec

    def registered(self, kind: type[Spec], name: str) -> Registered:
        """Return the spec called `name` together with its distribution; raises as `get`."""
        self.get(kind, name)
        return self._specs[kind][name]

    def _unknown(self, kind: type[Spec], name: str) -> str:
        known = self.names(kind)
        text = f"no {kind.kind} is named '{name}'; known: {', '.join(known) or 'none'}"
        near = difflib.get_close_matches(name, known, n=1)
        if near:
            text += f"; did you mean '{near[0]}'?"
        for item in self.broken:
            text += (
                f"; plugin '{item.entry_point}' of {item.distribution} {item.version}"
                f" failed to load ({item.cause})"
            )
        return text


@cache
def registry() -> Registry:
    """Return the registry of the installed plugins, found once per process."""
    return Registry(entry_points(group=PROJECT))
