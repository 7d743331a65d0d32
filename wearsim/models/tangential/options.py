"""Options that select the tangential theory of a contact model."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, ValidationInfo, field_validator

from wearsim.models.tangential.base import TangentialTheory
from wearsim.models.tangential.fastsim import FastripTheory, FastsimTheory
from wearsim.models.tangential.strip_theory import StripTheory
from wearsim.plugins import Options
from wearsim.units import QuantityError, shown

# the theories that use each of the other options
_USED_BY = {"mx": ("fastrip", "fastsim"), "bound": ("fastsim",), "flexibility": ("fastsim",)}


class TangentialOptions(Options):
    """Options of contact models of strips that select the tangential theory."""

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

    @field_validator(*_USED_BY)
    @classmethod
    def _is_used(cls, value: object, info: ValidationInfo) -> object:
        """Refuse an option that the theory does not use; defaults are not validated."""
        theory, users = info.data.get("tangential"), _USED_BY[str(info.field_name)]
        if theory is not None and theory not in users:
            raise QuantityError(
                f'is not used with tangential = "{theory}"',
                shown(value),
                "none of it, or " + " or ".join(f'tangential = "{user}"' for user in users),
            )
        return value


def tangential_theory(options: TangentialOptions) -> TangentialTheory:
    """Return the tangential theory that the options select."""
    if options.tangential == "strip":
        return StripTheory()
    if options.tangential == "fastrip":
        return FastripTheory(options.mx)
    return FastsimTheory(options.bound, options.mx, flexibility=options.flexibility)
