"""The tangential theories that a contact model offers, and the options that choose among them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, ValidationInfo, field_validator

from wearsim.models.tangential.base import TangentialTheory
from wearsim.models.tangential.strip_theory import StripTheory
from wearsim.plugins import Options
from wearsim.units import QuantityError, shown

# the theories that each of the other options means something to
_TAKEN_BY = {"mx": ("fastrip", "fastsim"), "bound": ("fastsim",), "flexibility": ("fastsim",)}


class TangentialOptions(Options):
    """Options with which every contact model of strips chooses its tangential theory."""

    tangential: Literal["strip", "fastrip", "fastsim"] = Field(
        "strip",
        description="tangential theory: closed-form strips, a FaStrip march or a FASTSIM march",
    )
    mx: int = Field(50, ge=2, description="points along rolling of a FaStrip or FASTSIM march")
    bound: Literal["parabolic", "elliptic"] = Field(
        "elliptic", description="traction bound of a FASTSIM march"
    )
    flexibility: Literal["three", "one"] = Field(
        "three",
        description="flexibilities of a FASTSIM march: Kalker's three, or one weighted by creepage",
    )

    @field_validator(*_TAKEN_BY)
    @classmethod
    def _means_something(cls, value: object, info: ValidationInfo) -> object:
        """Refuse an option that the theory chosen has no use for; defaults do not come here."""
        chosen, takers = info.data.get("tangential"), _TAKEN_BY[str(info.field_name)]
        if chosen is not None and chosen not in takers:
            remedy = " or ".join(f'tangential = "{taker}"' for taker in takers)
            raise QuantityError(
                f'means nothing with tangential = "{chosen}"',
                shown(value),
                f"none of it, or {remedy}",
            )
        return value


def tangential_theory(options: TangentialOptions) -> TangentialTheory:
    """Return the tangential theory that `options` choose."""
    if options.tangential == "strip":
        return StripTheory()
    # kernels of marches take a while to load, and strips alone have no use for them
    if options.tangential == "fastrip":
        from wearsim.models.tangential.fastrip import FastripTheory  # noqa: PLC0415

        return FastripTheory(options.mx)
    from wearsim.models.tangential.fastsim import FastsimTheory  # noqa: PLC0415

    return FastsimTheory(options.bound, options.mx, flexibility=options.flexibility)
