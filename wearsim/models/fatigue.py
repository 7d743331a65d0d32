"""Built-in fatigue laws: pressure-life and load-stress-factor."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field, field_validator

from wearsim.plugins import FatigueLaw, FatigueLawSpec, Options, PositivePressure
from wearsim.types import FloatArray
from wearsim.units import conversion

LN_10 = math.log(10.0)


class PressureLifeOptions(Options):
    """Options of the fatigue law `pressure-life`."""

    reference_passes: float = Field(
        gt=0.0, description="life N_ref at the reference pressure, in overrollings of a point"
    )
    reference_pressure: PositivePressure = Field(
        description="greatest pressure p_ref at which the life is N_ref, '1 GPa'"
    )
    exponent: float = Field(
        gt=0.0,
        description="m in N = N_ref (p_ref/p)^m; after Lundberg and Palmgren 9 in point contact and"
        " 8 in line contact",
    )
    endurance_pressure: PositivePressure | None = Field(
        None, description="pressure up to which there is no damage; by default there is none"
    )


class PressureLife(FatigueLaw):
    """Life N_ref (p_ref/p)^m, infinite up to an endurance pressure."""

    def __init__(self, options: PressureLifeOptions, contact_modulus: float) -> None:
        self._exponent, self._endurance = options.exponent, options.endurance_pressure
        self._per_reference, self._damage = (
            1.0 / options.reference_pressure,
            1.0 / options.reference_passes,
        )

    def damage_per_pass(self, pressure: FloatArray) -> FloatArray:
        """Return the damage that an overrolling adds, shape as `pressure` [Pa]."""
        damage = self._damage * (self._per_reference * pressure) ** self._exponent
        if self._endurance is not None:
            damage = np.where(pressure > self._endurance, damage, 0.0)
        return np.asarray(damage)


class LoadStressFactorOptions(Options):
    """Options of the fatigue law `load-stress-factor`."""

    a: float = Field(gt=0.0, description="A in log10 N = B - A log10 K")
    b: float = Field(description="B in log10 N = B - A log10 K")
    unit: str = Field(description="unit of K in the source, such as 'psi' or 'N/mm^2'")

    @field_validator("unit")
    @classmethod
    def _is_pressure(cls, value: str) -> str:
        conversion(value, "Pa", value, "a unit of pressure such as 'psi' or 'N/mm^2'")
        return value


class LoadStressFactor(FatigueLaw):
    """Life by the load-stress factor K of cam designers, log10 N = B - A log10 K.

    K = q/R' = pi p^2/E* in line contact, with the line load q and the relative radius R'.
    """

    def __init__(self, options: LoadStressFactorOptions, contact_modulus: float) -> None:
        unit = float(conversion(options.unit, "Pa"))
        # log10 of the damage at a pressure of 1 Pa, and its slope by log10 of the pressure
        self._constant = options.a * math.log10(math.pi / contact_modulus / unit) - options.b
        self._slope = 2.0 * options.a

    def damage_per_pass(self, pressure: FloatArray) -> FloatArray:
        """Return the damage that an overrolling adds, shape as `pressure` [Pa]."""
        touching = pressure > 0.0
        power = self._constant + self._slope * np.log10(np.where(touching, pressure, 1.0))
        return np.where(touching, np.exp(LN_10 * power), 0.0)


SPECS = (
    FatigueLawSpec(
        name="pressure-life",
        factory=PressureLife,
        options=PressureLifeOptions,
        summary="life as a power of the greatest pressure",
        references=(
            "Lundberg, Palmgren, Dynamic Capacity of Rolling Bearings, Acta Polytechnica 7 (1947)",
            "ISO 281:2007",
        ),
        protocol=2,
    ),
    FatigueLawSpec(
        name="load-stress-factor",
        factory=LoadStressFactor,
        options=LoadStressFactorOptions,
        summary="life by the load-stress factor K of cams and rollers",
        references=("Rothbart, Cam Design Handbook, McGraw-Hill (2004), eq. 9.15",),
        protocol=2,
    ),
)
