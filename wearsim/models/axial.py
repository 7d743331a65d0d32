"""Forms of rollers, cylinders and cams along their axis.

Lundberg's profile carries a uniform line load q over its length l,

    z(y) = q/(pi E*) ln 1/(1 - (2 y/l)^2),

which is infinite at the ends. Johns and Gohar keep it finite: its end drop is
(q/(pi E*)) (ln(l/a) + 1/2), the displacement of the centre less that of the end under a uniform
strip load, with a the half-length along rolling at the design load. Fujiwara and Kawase generalise
it to

    z(s) = A ln 1/(1 - (1 - exp(-z_m/A)) (s/l_c)^2),   A = K1 q/(pi E*),   l_c = K2 l/2,

where s is the distance from the inner end of the crowned part and z_m the drop at the end. With
K1 = K2 = 1 and the end drop of Johns and Gohar it is their profile. All drops are those of both
bodies together, for a straight counterpart.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field

from wearsim.plugins import AxialPair, AxialProfile, AxialProfileSpec, Options
from wearsim.profiles import ProfileChoice, read_profile
from wearsim.quantities import InputFile, PositiveForce, PositiveLength, Quantity
from wearsim.types import FloatArray
from wearsim.units import LENGTH

if TYPE_CHECKING:
    from scipy.interpolate import PchipInterpolator

_SINGULAR = 1e-12  # least value of 1 - (2 y/l)^2, at the ends of Lundberg's profile
_LUNDBERG = "Lundberg, G., Forschung auf dem Gebiete des Ingenieurwesens 10 (1939) 201-211"
_GOHAR = "Johns, P. M., Gohar, R., Tribology International 14 (1981) 131-136"
_FUJIWARA = "Fujiwara, H., Kawase, T., NTN Technical Review 75 (2007) 140-148"


class StraightOptions(Options):
    """A body without a crown has no options."""


class CrownOptions(Options):
    """Options of a circular crown."""

    radius: PositiveLength = Field(description="Radius of the crown across the track.")


class PartialCrownOptions(Options):
    """Options of a straight body with round ends."""

    straight: Annotated[float, Quantity(LENGTH, "not negative")] = Field(
        description="Length of the straight part in the middle."
    )
    radius: PositiveLength = Field(
        description="Radius of the arcs on both sides, tangential to the straight part."
    )


class LogarithmicOptions(Options):
    """Options of a logarithmic profile."""

    design_load: PositiveForce = Field(
        description="Normal force of a roller for which the profile is designed."
    )
    length: PositiveLength | None = Field(
        default=None, description="Length of the profile; by default roller.width."
    )
    variant: Literal["johns-gohar", "lundberg"] = Field(
        default="johns-gohar",
        description="Finite drop at the ends, or Lundberg's profile, which is singular there.",
    )
    k1: float = Field(
        default=1.0, gt=0.0, description="K1 of Fujiwara and Kawase: curvature of the crowned part."
    )
    k2: float = Field(
        default=1.0,
        gt=0.0,
        le=1.0,
        description="K2 of Fujiwara and Kawase: crowned part over half the length.",
    )
    drop: PositiveLength | None = Field(
        default=None, description="Drop at the ends, z_m; by default that of Johns and Gohar."
    )


class TableOptions(Options):
    """Options of a profile given by points."""

    file: InputFile = Field(
        description="CSV file with columns y and height, or depth, of the form along the axis."
    )
    columns: tuple[str, str] | None = Field(
        default=None, description="Names of the columns of position and height."
    )
    units: tuple[str, str] | None = Field(
        default=None, description="Units of these columns where the header has none."
    )


class Straight(AxialProfile):
    """A body without a crown."""

    crown_radius = math.inf

    def __init__(self, options: StraightOptions, pair: AxialPair) -> None:
        pass

    def drop(self, s: FloatArray) -> FloatArray:
        """Return zeros [m]."""
        return np.zeros_like(s)


class Crown(AxialProfile):
    """A circular crown, z = s^2/(2 R)."""

    def __init__(self, options: CrownOptions, pair: AxialPair) -> None:
        self.crown_radius: float = options.radius

    def drop(self, s: FloatArray) -> FloatArray:
        """Return s^2/(2 R) [m]."""
        return np.asarray(s * s / (2.0 * self.crown_radius))


class PartialCrown(AxialProfile):
    """A straight part with an arc of a circle on each side."""

    def __init__(self, options: PartialCrownOptions, pair: AxialPair) -> None:
        self._half, self._radius = 0.5 * options.straight, options.radius

    def drop(self, s: FloatArray) -> FloatArray:
        """Return R - (R^2 - d^2)^(1/2) at a distance d from the straight part [m].

        Beyond a quarter of the circle it increases further, so that the contact ends before.
        """
        away = np.maximum(np.abs(s) - self._half, 0.0)
        inside = np.minimum(away, self._radius)
        arc = inside**2 / (self._radius + np.sqrt(self._radius**2 - inside**2))
        return np.asarray(arc + (away - inside))


class Logarithmic(AxialProfile):
    """Profile of Lundberg, of Johns and Gohar, or of Fujiwara and Kawase.

    Parameters
    ----------
    options : LogarithmicOptions
    pair : AxialPair

    Raises
    ------
    ValueError
        If no length is given, or a roller is wider than the profile.
    """

    def __init__(self, options: LogarithmicOptions, pair: AxialPair) -> None:
        length = options.length or pair.width
        if length is None:
            raise ValueError('length is needed, or roller.width, such as length = "10 mm"')
        if options.variant == "lundberg" and options.drop is not None:
            raise ValueError(
                'drop has no meaning with variant = "lundberg", which is singular at the ends'
            )
        self.length = length
        self._start = 0.5 * length * (1.0 - options.k2)
        self._crowned = 0.5 * length * options.k2
        unit = options.design_load / length / (math.pi * pair.contact_modulus)
        self.scale = options.k1 * unit
        self.end_drop = math.inf
        if options.variant == "johns-gohar":
            half_length = math.sqrt(4.0 * unit / pair.curvature)
            if half_length >= length:
                raise ValueError(
                    f"the contact at the design load is {2e3 * half_length:.4g} mm long along"
                    f" rolling, more than the profile, {1e3 * length:.4g} mm, is long; a smaller"
                    " design_load"
                )
            self.end_drop = unit * (math.log(length / half_length) + 0.5)
        if options.drop is not None:
            self.end_drop = options.drop
        self._part = -math.expm1(-self.end_drop / self.scale)

    def drop(self, s: FloatArray) -> FloatArray:
        """Return the drop of the profile; beyond its ends that of the ends [m]."""
        part = np.clip((np.abs(s) - self._start) / self._crowned, 0.0, 1.0)
        # near the middle, log1p keeps digits that 1 - (...) would lose
        return np.asarray(
            -self.scale * np.log1p(-np.minimum(self._part * part**2, 1.0 - _SINGULAR))
        )


class TableProfile(AxialProfile):
    """Profile through given points, by monotone cubic interpolation.

    Parameters
    ----------
    options : TableOptions
    pair : AxialPair

    Raises
    ------
    ValueError
        If the file does not reach both sides of y = 0.
    """

    def __init__(self, options: TableOptions, pair: AxialPair) -> None:
        profile = read_profile(
            options.file.text, options.file.path, ProfileChoice(options.columns, options.units)
        )
        half = float(min(-profile.y[0], profile.y[-1]))
        if half <= 0.0:
            raise ValueError(
                f"{options.file.path}: the positions must reach both sides of 0, the middle of the"
                f" body; they are {1e3 * profile.y[0]:.6g} to {1e3 * profile.y[-1]:.6g} mm"
            )
        self.length = 2.0 * half
        self._y, self._depth = profile.y, profile.height.max() - profile.height
        self._curve: PchipInterpolator | None = None

    def drop(self, s: FloatArray) -> FloatArray:
        """Return the interpolated drop; beyond the ends of the table that of the ends [m]."""
        if self._curve is None:
            from scipy.interpolate import PchipInterpolator  # noqa: PLC0415  (slow to load)

            self._curve = PchipInterpolator(self._y, self._depth)
        # not negative by round-off
        return np.maximum(self._curve(np.clip(s, self._y[0], self._y[-1])), 0.0)


def _spec(
    name: str,
    factory: Callable[[Any, AxialPair], AxialProfile],
    options: type[Options],
    summary: str,
    *references: str,
) -> AxialProfileSpec:
    return AxialProfileSpec(name, options, summary, references, factory=factory, protocol=2)


SPECS = (
    _spec("crown", Crown, CrownOptions, "circular crown"),
    _spec(
        "logarithmic",
        Logarithmic,
        LogarithmicOptions,
        "logarithmic profile of Lundberg, of Johns and Gohar, or of Fujiwara and Kawase",
        _LUNDBERG,
        _GOHAR,
        _FUJIWARA,
    ),
    _spec("partial-crown", PartialCrown, PartialCrownOptions, "straight, with round ends"),
    _spec("straight", Straight, StraightOptions, "straight, without a crown"),
    _spec("table", TableProfile, TableOptions, "profile given by points"),
)
