"""Numbers printed in the paper, in SI units, with their sections.

Chevalier, Cloupet, Soize, Wear 258 (2005) 1543-1554, DOI 10.1016/j.wear.2004.11.012.
"""

from __future__ import annotations

from dataclasses import dataclass

REFERENCE = "Chevalier, Cloupet, Soize, Wear 258 (2005) 1543-1554, DOI 10.1016/j.wear.2004.11.012"


@dataclass(frozen=True)
class Printed:
    """A printed number.

    Parameters
    ----------
    value : float
        Value in SI units.
    place : str
        Section or equation of the paper.
    """

    value: float
    place: str


@dataclass(frozen=True)
class PrintedRange:
    """A printed range.

    Parameters
    ----------
    low, high : float
        Lower and upper end in SI units.
    place : str
        Section or equation of the paper.
    """

    low: float
    high: float
    place: str

    @property
    def value(self) -> tuple[float, float]:
        """Lower and upper end."""
        return self.low, self.high


@dataclass(frozen=True)
class PrintedMultipliers:
    """Printed multipliers of a maximum-entropy distribution.

    Parameters
    ----------
    l0, l1, l2 : float
        Multipliers in powers of the SI unit.
    place : str
        Section of the paper.
    """

    l0: float
    l1: float
    l2: float
    place: str


ROLLER_RADIUS = Printed(40e-3, "section 2.1")
CROWN_RADIUS = Printed(1000e-3, "section 2.1")
CYLINDER_RADIUS = Printed(50e-3, "section 2.1")
SPEED = PrintedRange(2.0, 3.0, "section 1.1")  # missing for the mean problem
CONTACT_LENGTH = Printed(0.27e-3, "section 3.3")
CONTACT_WIDTH = Printed(3.1e-3, "section 3.3")
BOUND_RISE = Printed(0.25, "section 3.2")
MEAN_PROBLEM_POWER = Printed(0.073, "section 3.3")

LOAD_MEAN = Printed(307.0, "section 2.2")
LOAD_STD = Printed(32.0, "section 2.2")
LATERAL_STD = Printed(0.001, "section 4.2")
SPIN_STD = Printed(0.05, "section 4.2")
LOAD_MULTIPLIERS = PrintedMultipliers(50.40, -0.299, 4.88e-4, "section 4.2")
CREEPAGE_MULTIPLIERS = PrintedMultipliers(-3.982, -5.861e3, 2.957e6, "section 4.2")

REALISATIONS = Printed(1000, "section 5")
CONVERGED_AT = Printed(300, "section 5.1")
CLASSES = Printed(30, "section 5.2")
MEAN_POWER = Printed(0.127, "section 5.1")
ALIGNED_MEAN_POWER = Printed(0.068, "section 5.2")
POWER_RANGE = PrintedRange(0.012, 0.29, "section 5.2")
ABOVE_RANGE = Printed(0.05, "eq. 21")  # 1 - Pc
