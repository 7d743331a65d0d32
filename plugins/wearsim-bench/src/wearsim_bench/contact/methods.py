"""The contact models that are registered, each with every choice its options offer."""

from __future__ import annotations

import types
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Union, get_args, get_origin

import numpy as np

from wearsim.models.tangential.options import TangentialOptions
from wearsim.plugins import ContactModel, ContactModelSpec, Options, registry
from wearsim.scenario.tables.plugin import ContactTable
from wearsim.types import ContactSolution
from wearsim_bench.contact.accuracy import solved
from wearsim_bench.contact.cases import worn_cases

DEFAULT_MODEL = str(ContactTable.model_fields["model"].default)
HOST = "hertz"  # whose normal contact is exact on ellipses: there tangential theories are compared
_RESOLUTION = ("mx", "my")  # options that follow the number of strips
_NAMES = ("variant", "tangential")  # options whose values say by themselves what they are
_STRIPS = 81  # on which it shows whether a choice changes the normal contact


@dataclass(frozen=True)
class Method:
    """A contact model with options.

    Parameters
    ----------
    model : str
        Its registered name.
    options : mapping of str to Any
        Those that are not left at their defaults.
    """

    model: str
    options: Mapping[str, Any] = field(default_factory=dict)

    @property
    def spec(self) -> ContactModelSpec:
        """The model's spec."""
        return registry().get(ContactModelSpec, self.model)

    @property
    def name(self) -> str:
        """The model and its choices: "hertz, fastsim, bound parabolic"."""
        fields = self.spec.options.model_fields
        known = [
            key
            for key in _NAMES
            if key in self.options or (key in fields and not fields[key].is_required())
        ]
        parts = [str(self.options.get(key, fields[key].default)) for key in known]
        rest = [(key, value) for key, value in self.options.items() if key not in known]
        parts += [f"{key.replace('_', ' ')} {_word(value)}" for key, value in rest]
        return ", ".join([self.model, *parts])

    @property
    def default(self) -> bool:
        """Whether it is what a scenario gets that asks for nothing."""
        return self.model == DEFAULT_MODEL and not self.options

    def build(self, strips: int | None = None) -> ContactModel:
        """Return the model, not yet prepared; options of resolution follow the strips."""
        return self.spec.factory(self.spec.options(**self._resolved(strips)))

    def setting(self, strips: int) -> str:
        """Return how finely it solves: "81 strips", or "81 x 81" where it marches."""
        steps = self._resolved(strips).get("mx")
        return f"{strips} strips" if steps is None else f"{steps} x {strips}"

    def _resolved(self, strips: int | None) -> dict[str, Any]:
        options = dict(self.options)
        for key in _RESOLUTION if strips is not None else ():
            if key in self.spec.options.model_fields and _valid(
                self.spec.options, options | {key: strips}
            ):
                options[key] = strips
        return options


def methods(plugin: str | None = None) -> list[Method]:
    """Return the registered contact models with all their choices, each choice by itself.

    A choice that means nothing beside the others' defaults stands beside the one that gives it a
    meaning: `bound = "parabolic"` beside `tangential = "fastsim"`. Choices of a tangential theory
    are varied in one model alone, as what they change is the same in all.

    Parameters
    ----------
    plugin : str, optional
        The one model to return, beside the default.

    Raises
    ------
    PluginError
        If there is no such model.
    """
    if plugin is None:
        names, host = registry().names(ContactModelSpec), HOST
    else:
        registry().get(ContactModelSpec, plugin)
        names, host = list(dict.fromkeys((plugin, DEFAULT_MODEL))), plugin
    return [
        method
        for name in names
        for method in _methods_of(name, with_theories=name == host)
        if plugin in (None, name) or method.default
    ]


def normal_methods(plugin: str | None = None) -> list[Method]:
    """Return those of `methods` that differ in the normal contact; the others tell nothing new."""
    own = [method for method in methods(plugin) if not _of_theory(method)]
    plain = {method.model: _flat(method) for method in own if not method.options}
    return [
        method
        for method in own
        if not method.options or not _same(plain[method.model], _flat(method))
    ]


def _methods_of(name: str, *, with_theories: bool) -> list[Method]:
    options = registry().get(ContactModelSpec, name).options
    found = [Method(name), *(Method(name, chosen) for chosen in _choices(options))]
    return [method for method in found if with_theories or not _of_theory(method)]


def _of_theory(method: Method) -> bool:
    """Return whether a method chooses a tangential theory that every model of strips offers."""
    shared = TangentialOptions.model_fields
    return issubclass(method.spec.options, TangentialOptions) and any(
        key in shared for key in method.options
    )


def _choices(options: type[Options]) -> list[dict[str, Any]]:
    """Return every value other than the default, alone or beside the choice that it needs."""
    alone = [
        {key: value}
        for key, info in options.model_fields.items()
        for value in _values(info.annotation)
        if value != info.default
    ]
    found = []
    for choice in alone:
        beside = [other | choice for other in alone if other.keys() != choice.keys()]
        found += [tried for tried in (choice, *beside) if _valid(options, tried)][:1]
    return found


def _values(annotation: Any) -> Iterator[Any]:
    """Yield what an option can be chosen from, if it is a choice."""
    if annotation is bool:
        yield from (False, True)
    elif get_origin(annotation) is Literal:
        yield from get_args(annotation)
    elif get_origin(annotation) in (Union, types.UnionType):
        for part in get_args(annotation):
            yield from _values(part)


def _valid(options: type[Options], values: dict[str, Any]) -> bool:
    try:
        options(**values)
    except Exception:  # whatever a validator of a plugin raises, the value is refused
        return False
    return True


def _word(value: object) -> str:
    return {True: "on", False: "off"}[value] if isinstance(value, bool) else str(value)


def _flat(method: Method) -> ContactSolution | None:
    """Return the contact of the profile worn flat, if the model has an answer."""
    try:
        return solved(method.build(_STRIPS), worn_cases("flat")["mean"], _STRIPS)[0]
    except Exception:  # it is told where the method is measured
        return None


def _same(one: ContactSolution | None, other: ContactSolution | None) -> bool:
    """Return whether two normal contacts are the same."""
    if one is None or other is None:
        return one is other
    return np.array_equal(one.line_load, other.line_load) and np.array_equal(
        one.half_length, other.half_length
    )
