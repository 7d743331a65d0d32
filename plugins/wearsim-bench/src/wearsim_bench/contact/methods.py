"""All registered contact models with all choices of their options."""

from __future__ import annotations

import types
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Union, get_args, get_origin

import numpy as np

from wearsim.models.contact.strip_model import TangentialOptions
from wearsim.plugins import ContactModelSpec, Options, registry
from wearsim.scenario.tables.plugin import ContactChoice, ContactTable
from wearsim.types import ContactSolution
from wearsim_bench.contact.accuracy import solved
from wearsim_bench.contact.cases import worn_cases

DEFAULT_MODEL = str(ContactTable.model_fields["model"].default)
COMPARISON_MODEL = "hertz"  # used to compare tangential theories: exact normal contact on ellipses
_RESOLUTION = ("mx", "my")  # options that follow the number of strips
_NAMES = ("variant", "tangential")  # options shown by their value only
_STRIPS = 81  # for the comparison of normal contacts


@dataclass(frozen=True)
class Method:
    """A contact model with options.

    Parameters
    ----------
    model : str
        Registered name.
    options : mapping of str to Any
        Options with non-default values.
    """

    model: str
    options: Mapping[str, Any] = field(default_factory=dict)

    @property
    def spec(self) -> ContactModelSpec:
        """Spec of the model."""
        return registry().get(ContactModelSpec, self.model)

    @property
    def name(self) -> str:
        """Model and choices: "hertz, fastsim, bound parabolic"."""
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
        """Whether this is the default of a scenario."""
        return self.model == DEFAULT_MODEL and not self.options

    def choice(self, strips: int | None = None) -> ContactChoice:
        """Return the model with its options; `mx` and `my` are set to the number of strips."""
        return ContactChoice(self.model, self.spec.options(**self._resolved(strips)))

    def setting(self, strips: int) -> str:
        """Return the resolution: "81 strips", or "81 x 81" with steps along rolling."""
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


def compared_models() -> list[str]:
    """Return the registered contact models without references, which cost hours."""
    specs = [registry().get(ContactModelSpec, name) for name in registry().names(ContactModelSpec)]
    return [spec.name for spec in specs if not spec.reference]


def is_reference(plugin: str | None) -> bool:
    """Return whether a contact model is a reference, which takes up to seconds a contact."""
    return plugin is not None and registry().get(ContactModelSpec, plugin).reference


def methods(plugin: str | None = None) -> list[Method]:
    """Return contact models with all their choices, one choice at a time.

    A choice that is invalid with the defaults of the other options is combined with the choice it
    requires: `bound = "parabolic"` with `tangential = "fastsim"`. Choices of a tangential theory
    are varied in one model only, since their effect is the same in all.

    Parameters
    ----------
    plugin : str, optional
        Model to return in addition to the default; None for all except references.

    Raises
    ------
    PluginError
        If there is no such model.
    """
    if plugin is None:
        names, varied = compared_models(), COMPARISON_MODEL
    else:
        registry().get(ContactModelSpec, plugin)
        names, varied = list(dict.fromkeys((plugin, DEFAULT_MODEL))), plugin
    return [
        method
        for name in names
        for method in _methods_of(name, with_theories=name == varied)
        if plugin in (None, name) or method.default
    ]


def normal_methods(plugin: str | None = None) -> list[Method]:
    """Return the `methods` that differ in the normal contact."""
    candidates = [method for method in methods(plugin) if not _of_theory(method)]
    defaults = {method.model: _flat(method) for method in candidates if not method.options}
    return [
        method
        for method in candidates
        if not method.options or not _same(defaults[method.model], _flat(method))
    ]


def _methods_of(name: str, *, with_theories: bool) -> list[Method]:
    options = registry().get(ContactModelSpec, name).options
    every = [Method(name), *(Method(name, choice) for choice in _choices(options))]
    return [method for method in every if with_theories or not _of_theory(method)]


def _of_theory(method: Method) -> bool:
    """Return whether a method varies a tangential theory common to all models of strips."""
    shared = TangentialOptions.model_fields
    return issubclass(method.spec.options, TangentialOptions) and any(
        key in shared for key in method.options
    )


def _choices(options: type[Options]) -> list[dict[str, Any]]:
    """Return all non-default values, each alone or with the choice that it requires."""
    single = [
        {key: value}
        for key, info in options.model_fields.items()
        for value in _values(info.annotation)
        if value != info.default
    ]
    choices = []
    for choice in single:
        pairs = [required | choice for required in single if required.keys() != choice.keys()]
        choices += [tried for tried in (choice, *pairs) if _valid(options, tried)][:1]
    return choices


def _values(annotation: Any) -> Iterator[Any]:
    """Yield the possible values of an option, if it is a choice."""
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
    except Exception:  # a validator of a plugin may raise any exception
        return False
    return True


def _word(value: object) -> str:
    return {True: "on", False: "off"}[value] if isinstance(value, bool) else str(value)


def _flat(method: Method) -> ContactSolution | None:
    """Return the contact on the flat worn profile, or None if the model has no solution."""
    try:
        return solved(method.choice(_STRIPS), worn_cases("flat")["mean"], _STRIPS)[0]
    except Exception:  # reported when the method is measured
        return None


def _same(first: ContactSolution | None, second: ContactSolution | None) -> bool:
    """Return whether two normal contacts are identical."""
    if first is None or second is None:
        return first is second
    return np.array_equal(first.line_load, second.line_load) and np.array_equal(
        first.half_length, second.half_length
    )
