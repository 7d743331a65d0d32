"""The wear law `archard-dissipation`: depth per pass from the dissipated power of each strip."""

from __future__ import annotations

from pydantic import Field

from wearsim.plugins import Body, Options, WearLaw, WearLawSpec
from wearsim.quantities import NonNegativeWearFactor
from wearsim.types import ContactSolution, FloatArray


class BodyWear(Options):
    """Wear factor of one body."""

    k_over_h: NonNegativeWearFactor = Field(
        description="wear factor K/H, volume per dissipated energy, e.g. '1.1e-11 1/Pa'"
    )


class ArchardOptions(Options):
    """Options of the wear law `archard-dissipation`."""

    cylinder: BodyWear = Field(description="wear factor of the cylinder")
    roller: BodyWear = Field(description="wear factor of each roller; '0 1/Pa' for no wear")


class ArchardDissipation(WearLaw):
    """Depth per pass K/(H V) P_l(y) (eq. 4 of the paper, DOI 10.1016/j.wear.2004.11.012)."""

    def __init__(self, options: ArchardOptions) -> None:
        self._wear_factor = {
            "cylinder": options.cylinder.k_over_h,
            "roller": options.roller.k_over_h,
        }

    def depth_per_pass(
        self, body: Body, solution: ContactSolution, rolling_speed: float
    ) -> FloatArray:
        """Return the depth worn off `body` in one pass, shape (strips,) [m]."""
        return self.depth_per_dissipation(body, rolling_speed) * solution.dissipation

    def depth_per_dissipation(self, body: Body, rolling_speed: float) -> float:
        """Return K/(H V), depth per pass over dissipation [m/(W/m)]."""
        return self._wear_factor[body] / rolling_speed


SPEC = WearLawSpec(
    name="archard-dissipation",
    factory=ArchardDissipation,
    options=ArchardOptions,
    summary="wear proportional to the dissipated energy, strip by strip",
    references=(
        "Archard, J. Appl. Phys. 24 (1953), DOI 10.1063/1.1721448",
        "Chevalier, Cloupet, Soize, Wear 258 (2005), DOI 10.1016/j.wear.2004.11.012",
    ),
    protocol=2,
)
