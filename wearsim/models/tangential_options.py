"""The tangential theories that a contact model offers, and the options that choose among them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from wearsim.models.strip_theory import StripTheory
from wearsim.models.tangential import TangentialTheory
from wearsim.plugins import Options


class TangentialOptions(Options):
    """Options with which every contact model of strips chooses its tangential theory."""

    tangential: Literal["strip", "fastsim"] = Field(
        "strip", description="tangential theory: closed-form strips, or a FASTSIM march"
    )
    mx: int = Field(50, ge=1, description="points along rolling of a FASTSIM march")
    bound: Literal["parabolic", "elliptic"] = Field(
        "elliptic", description="traction bound of a FASTSIM march"
    )


def tangential_theory(options: TangentialOptions) -> TangentialTheory:
    """Return the tangential theory that `options` choose."""
    if options.tangential == "strip":
        return StripTheory()
    # its kernels take a while to load, and strips alone have no use for them
    from wearsim.models.fastsim_theory import FastsimTheory  # noqa: PLC0415

    return FastsimTheory(options.bound, options.mx)
