"""A random input on the bench, with streams of uniform numbers to draw from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

from wearsim.plugins import RandomInputSpec, Uniforms
from wearsim.testing.specs import Chosen
from wearsim.uq.sampling.philox import Stream


@dataclass(frozen=True)
class RandomBench:
    """A random input with options.

    Parameters
    ----------
    chosen : Chosen
        Its spec and options.
    marginal : Chosen, optional
        The distribution at any one point or time, of a field or a process.
    """

    chosen: Chosen[RandomInputSpec]
    marginal: Chosen[RandomInputSpec] | None = None

    def __str__(self) -> str:
        return str(self.chosen)

    def fresh(self) -> Any:
        """Return a new random input."""
        spec, options = self.chosen.spec, self.chosen.options
        if self.marginal is None:
            return spec.factory(options)
        return spec.factory(options, self.marginal.spec.factory(self.marginal.options))

    @cached_property
    def thing(self) -> Any:
        """One random input for all checks."""
        return self.fresh()

    def uniforms(self, realisation: int = 0) -> Uniforms:
        """Return the stream of uniform numbers of one realisation."""
        return partial(Stream(1, str(self.chosen.spec.name), "field").uniforms,
                       realisation=realisation)  # fmt: skip
