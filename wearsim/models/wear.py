"""Built-in wear laws: archard-dissipation and t-gamma."""

from __future__ import annotations

from typing import Annotated, Self

import numpy as np
from pydantic import Field, field_validator, model_validator

from wearsim.plugins import Body, Options, WearLaw, WearLawSpec
from wearsim.quantities import (
    NonNegativeMassPerEnergy,
    NonNegativeWearFactor,
    PositiveDensity,
    PositiveMassPerEnergy,
    Quantity,
)
from wearsim.types import ContactSolution, FloatArray
from wearsim.units import WEAR_FACTOR, Kind, QuantityError, as_written

SPECIFIC = Quantity(Kind("a specific wear rate", "m^3/(N m)", "1e-5 mm^3/(N m)"), "not negative")
_OF_A_TEST = "specific_wear_rate", "measured_friction"
_EITHER = "k_over_h, or specific_wear_rate with measured_friction"
RATE = Quantity(
    Kind("a mass per rolled distance and contact area", "kg/m^3", "55 ug/(m mm^2)"), "positive"
)
INDEX = Quantity(
    Kind("an energy per rolled distance and contact area", "Pa", "77.2 N/mm^2"), "positive"
)


class BodyWear(Options):
    """Wear factor of one body.

    A specific wear rate k of a handbook is a volume per load and sliding distance. In the test in
    which it was measured, the work per distance was friction times load, so that K/H = k/mu.
    """

    k_over_h: NonNegativeWearFactor | None = Field(
        None,
        description="wear factor K/H, volume per dissipated energy, e.g. '1.1e-11 1/Pa'",
        validate_default=True,
    )
    specific_wear_rate: Annotated[float, SPECIFIC] | None = Field(
        None,
        description="instead: volume per load and sliding distance in a wear test, e.g."
        " '1e-5 mm^3/(N m)'; needs measured_friction, by which it is divided",
    )
    measured_friction: float | None = Field(
        None, gt=0.0, description="coefficient of friction in the test of specific_wear_rate"
    )

    @model_validator(mode="before")
    @classmethod
    def _converted(cls, raw: object) -> object:
        """Replace a specific wear rate and the friction of its test by the wear factor."""
        if not isinstance(raw, dict) or not raw.keys() & set(_OF_A_TEST):
            return raw
        given = {key: raw[key] for key in ("k_over_h", *_OF_A_TEST) if key in raw}
        if "k_over_h" in given:
            raise QuantityError("gives the wear factor twice", " and ".join(given), _EITHER)
        if len(given) < len(_OF_A_TEST):
            missing = next(key for key in _OF_A_TEST if key not in given)
            raise QuantityError(f"{missing} is missing", " and ".join(given), _EITHER)
        rate, friction = SPECIFIC.parse(raw["specific_wear_rate"]), raw["measured_friction"]
        known = isinstance(friction, int | float) and not isinstance(friction, bool)
        if not (known and 0.0 < friction < np.inf):
            what = "measured_friction is not a coefficient of friction"
            raise QuantityError(what, as_written(friction), "a number above 0")
        unchanged = {key: value for key, value in raw.items() if key not in given}
        return {**unchanged, "k_over_h": f"{rate / friction!r} 1/Pa"}

    @field_validator("k_over_h")
    @classmethod
    def _is_given(cls, value: float | None) -> float | None:
        if value is None:
            raise QuantityError("is missing", None, WEAR_FACTOR.expected("not negative"))
        return value

    @property
    def wear_factor(self) -> float:
        """K/H [1/Pa]."""
        if self.k_over_h is None:
            raise ValueError("a wear factor is needed")
        return self.k_over_h


class ArchardOptions(Options):
    """Options of the wear law `archard-dissipation`."""

    factor: float = Field(
        1.0, gt=0.0, description="factor of both wear factors, such as a scatter that they share"
    )
    cylinder: BodyWear = Field(description="wear factor of the cylinder, cylinder.k_over_h")
    roller: BodyWear = Field(
        description="wear factor of each roller, roller.k_over_h; '0 1/Pa' for no wear"
    )


class ArchardDissipation(WearLaw):
    """Depth per pass K/(H V) P_l(y) (eq. 4 of the paper, DOI 10.1016/j.wear.2004.11.012)."""

    def __init__(self, options: ArchardOptions) -> None:
        self._wear_factor = {
            "cylinder": options.factor * options.cylinder.wear_factor,
            "roller": options.factor * options.roller.wear_factor,
        }

    def depth_per_pass(
        self, body: Body, solution: ContactSolution, rolling_speed: float
    ) -> FloatArray:
        """Return the depth worn off `body` in one pass, shape (strips,) [m]."""
        return self.depth_per_dissipation(body, rolling_speed) * solution.dissipation

    def depth_per_dissipation(self, body: Body, rolling_speed: float) -> float:
        """Return K/(H V), depth per pass over dissipation [m/(W/m)]."""
        return self._wear_factor[body] / rolling_speed


class Regimes(Options):
    """Wear rates of one body in three regimes, and the threshold of the third.

    The defaults are those of twin-disc tests of R8T wheel steel on 900A rail steel. Severe wear
    begins where the rate of mild wear reaches that of severe wear: at 10.4 N/mm^2 by default.
    """

    mild: PositiveMassPerEnergy = Field(
        5.3e-9, description="mass worn per dissipated energy in mild wear, '5.3 ug/J'"
    )
    severe: Annotated[float, RATE] = Field(
        55.0e-3,
        description="mass worn per rolled distance and contact area in severe wear, independent of"
        " the energy, '55 ug/(m mm^2)'",
    )
    catastrophic: NonNegativeMassPerEnergy = Field(
        61.9e-9, description="mass worn per energy beyond the last threshold, '61.9 ug/J'"
    )
    catastrophic_from: Annotated[float, INDEX] = Field(
        77.2e6, description="T gamma over A where catastrophic wear begins, '77.2 N/mm^2'"
    )
    density: PositiveDensity = Field(7850.0, description="density of the body, '7850 kg/m^3'")
    factor: float = Field(1.0, ge=0.0, description="factor of all rates; 0 for no wear")

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        """Refuse catastrophic wear that begins before severe wear does."""
        onset = self.severe / self.mild
        if self.catastrophic_from < onset:
            raise QuantityError(
                "catastrophic wear would begin before severe wear does",
                f"catastrophic_from = {self.catastrophic_from * 1e-6:g} N/mm^2",
                f"at least severe/mild = {onset * 1e-6:.4g} N/mm^2",
            )
        return self

    def rate(self, index: FloatArray) -> FloatArray:
        """Return the mass worn per rolled distance and contact area [kg/m^3].

        Parameters
        ----------
        index : ndarray
            T gamma over A [Pa].
        """
        beyond = np.maximum(index - self.catastrophic_from, 0.0)
        rate = np.minimum(self.mild * index, self.severe) + self.catastrophic * beyond
        return np.asarray(self.factor * rate)


class TGammaOptions(Options):
    """Options of the wear law `t-gamma`."""

    cylinder: Regimes = Field(default_factory=Regimes, description="wear of the cylinder")
    roller: Regimes = Field(
        default_factory=Regimes, description="wear of each roller; factor = 0 for no wear"
    )


class TGamma(WearLaw):
    """Depth per pass by the local T gamma over A of each strip.

    A strip of half-length a with the dissipation P_l has T gamma / A = P_l/(2 a V). Its mass loss
    per rolled distance is the rate times its area, so that a pass wears the depth 2 a rate/density.
    If all strips are in mild wear this is Archard's law with K/H = mild/density.
    """

    def __init__(self, options: TGammaOptions) -> None:
        self._regimes: dict[Body, Regimes] = {
            "cylinder": options.cylinder,
            "roller": options.roller,
        }

    def depth_per_pass(
        self, body: Body, solution: ContactSolution, rolling_speed: float
    ) -> FloatArray:
        """Return the depth worn off `body` in one pass, shape (strips,) [m]."""
        regimes, length = self._regimes[body], 2.0 * solution.half_length
        touching = length > 0.0
        index = solution.dissipation / (np.where(touching, length, 1.0) * rolling_speed)
        return np.where(touching, length * regimes.rate(index) / regimes.density, 0.0)


SPECS = (
    WearLawSpec(
        name="archard-dissipation",
        factory=ArchardDissipation,
        options=ArchardOptions,
        summary="wear proportional to the dissipated energy, strip by strip",
        references=(
            "Archard, J. Appl. Phys. 24 (1953), DOI 10.1063/1.1721448",
            "Chevalier, Cloupet, Soize, Wear 258 (2005), DOI 10.1016/j.wear.2004.11.012",
        ),
        protocol=2,
    ),
    WearLawSpec(
        name="t-gamma",
        factory=TGamma,
        options=TGammaOptions,
        summary="mild, severe and catastrophic wear by dissipated energy per contact area",
        references=(
            "Lewis, Dwyer-Joyce, Proc. IMechE J 218 (2004), DOI 10.1243/1350650042794815",
            "Braghin, Lewis, Dwyer-Joyce, Bruni, Wear 261 (2006), DOI 10.1016/j.wear.2006.03.025",
        ),
        protocol=2,
    ),
)
