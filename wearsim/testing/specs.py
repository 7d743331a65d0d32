"""What every spec promises, and how the kit gets from a name and raw options to the thing."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from wearsim.plugins import Options, Quantity, Spec, registry
from wearsim.testing.checks import Checks, require

if TYPE_CHECKING:
    from wearsim.units import Kind

S = TypeVar("S", bound=Spec)


@dataclass(frozen=True)
class Chosen(Generic[S]):
    """A spec with options as a scenario would write them.

    Parameters
    ----------
    spec : Spec
        What a plugin yields.
    raw : mapping of str to object
        Its options, quantities with their units: ``{"stiffness": "690 N/mm"}``.
    kind : Kind, optional
        What a random input stands for; nothing for a plain number.
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
        told = ", ".join(f"{key} = {value!r}" for key, value in self.raw.items())
        return f"{self.spec.kind} '{self.spec.name}'" + (f" with {told}" if told else "")


def found(kind: type[S], spec: S | str) -> S:
    """Return a spec, looked up among the installed plugins where it is given by name."""
    return registry().get(kind, spec) if isinstance(spec, str) else spec


def spec_checks() -> Checks[Any]:
    """Return what every spec promises; its bench has a `chosen`."""
    checks: Checks[Any] = Checks()

    @checks.promised_in("wearsim.plugins.Spec")
    def spec_says_what_it_is(bench: Any) -> None:
        """A spec has a name of lower-case words, and one line that says what it is."""
        spec = bench.chosen.spec
        require(
            re.fullmatch(r"[a-z][a-z0-9]*(-[a-z0-9]+)*", spec.name) is not None,
            f"the name {spec.name!r} is not made of lower-case words joined by hyphens",
        )
        require(
            bool(spec.summary.strip()) and "\n" not in spec.summary, "the summary is not one line"
        )
        references = spec.references
        require(
            isinstance(references, tuple) and all(isinstance(item, str) for item in references),
            "the references are not a tuple of texts",
        )

    @checks.promised_in("wearsim.plugins.Options")
    def options_refuse_what_they_do_not_know(bench: Any) -> None:
        """Options refuse keys that they do not know, and do not change."""
        model = bench.chosen.spec.options
        require(issubclass(model, Options), f"{model.__name__} is not derived from Options")
        config = model.model_config
        require(
            config.get("extra") == "forbid" and bool(config.get("frozen")),
            f"{model.__name__} takes keys that it does not know, or can be changed",
        )

    return checks
