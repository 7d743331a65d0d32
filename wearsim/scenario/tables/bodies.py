"""Tables [roller] and [cylinder]: geometry, materials and the initial profile."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal, TypeAlias

import numpy as np
from pydantic import Field, PlainValidator

from wearsim.errors import ScenarioError
from wearsim.mechanics.hertz.elasticity import ElasticPair
from wearsim.plugins import Options
from wearsim.profiles import (
    ROW_CHOICES,
    ProfileChoice,
    gaussian_filtered,
    name_of_rows,
    read_profile,
    sign_note,
)
from wearsim.quantities import (
    InputFile,
    Length,
    PerRoller,
    PositiveLength,
    PositivePressure,
    Quantity,
)
from wearsim.scenario.parse.mistakes import Mistakes
from wearsim.scenario.parse.random_inputs import validate
from wearsim.scenario.tables.axial import (
    DESCRIPTION,
    AxialChoice,
    AxialKey,
    crown,
    read_axial,
    straight,
)
from wearsim.scenario.tables.plugin import ContactChoice
from wearsim.scenario.tables.start_profiles import StartSurface, read_roller_profiles
from wearsim.types import FloatArray, Material, Profile
from wearsim.units import ANGLE, INERTIA, QuantityError, as_written

_ROUNDING = 1e-9
DUNDURS_LIMIT = 0.01
COUPLING_PRESSURE = 500e6  # Pa, for which a note gives the size of the coupling

#: Handbook constants: phosphor bronze C51000, ductile iron of EN 1563.
MATERIALS = {
    "steel": Material(200e9, 0.3),
    "aluminium": Material(70e9, 0.33),
    "bronze": Material(110e9, 0.34),
    "ductile-iron": Material(169e9, 0.275),
}


class MaterialTable(Options):
    """Elastic constants of a material."""

    youngs_modulus: PositivePressure = Field(description="Young's modulus.")
    poisson_ratio: float = Field(ge=0.0, le=0.5, description="Poisson's ratio.")
    hardness: PositivePressure | None = Field(
        default=None, description="Indentation hardness, for wear laws and warnings."
    )
    yield_stress: PositivePressure | None = Field(
        default=None, description="Yield stress, for a warning of plastic deformation."
    )


def _read_material(value: object) -> Material:
    expected = (
        f"one of {', '.join(as_written(name) for name in MATERIALS)} or a table of its constants"
    )
    if isinstance(value, str) and value in MATERIALS:
        return MATERIALS[value]
    if not isinstance(value, dict):
        raise QuantityError(
            "unknown material" if isinstance(value, str) else "is not a material",
            as_written(value),
            expected,
        )
    table = MaterialTable.model_validate_json(json.dumps(value, default=str), strict=True)
    return Material(table.youngs_modulus, table.poisson_ratio, table.hardness, table.yield_stress)


MaterialField: TypeAlias = Annotated[
    Material,
    PlainValidator(
        _read_material,
        json_schema_input_type=Literal["steel", "aluminium", "bronze", "ductile-iron"]
        | MaterialTable,
    ),
]


class RollerTable(Options):
    """Rollers, all of the same shape before wear."""

    radius: PositiveLength | None = Field(
        default=None, description="Rolling radius; either it or the diameter is needed."
    )
    diameter: PositiveLength | None = Field(default=None, description="Rolling diameter.")
    crown_radius: PositiveLength | None = Field(
        default=None,
        description="Radius of the crown across the track; or give its diameter.",
    )
    crown_diameter: PositiveLength | None = Field(default=None, description="Crown diameter.")
    axial_profile: AxialKey | None = Field(
        default=None, description=f"{DESCRIPTION} Instead of a crown."
    )
    profile: PerRoller[InputFile] | None = Field(
        default=None,
        description="Start profile, measured or worn: a CSV file with columns y, from the apex, and"
        " height, or depth; one for all rollers or one per roller.",
    )
    offset: PerRoller[Length] = Field(
        default=0.0,
        description="Axial position of the apex: one value for all rollers or one per roller.",
    )
    width: PositiveLength | None = Field(
        default=None,
        description="Width across the track, where contact ends; by default the contact ends by the"
        " crown alone.",
    )
    edge_radius: PositiveLength | None = Field(
        default=None, description="Radius of the rounded edges; needs width."
    )
    chamfer: PositiveLength | None = Field(
        default=None, description="Width of the chamfers at both edges; needs width."
    )
    chamfer_angle: Annotated[float, Quantity(ANGLE, "positive")] = Field(
        default=math.radians(45.0), description="Angle of the chamfers to the axis, up to 90 deg."
    )
    material: MaterialField = Field(description="Name of a material, or a table of its constants.")
    inertia: Annotated[float, Quantity(INERTIA, "not negative")] = Field(
        default=0.0, description="Moment of inertia about its pin, for a free roller on a cam."
    )


class CylinderTable(Options):
    """Cylinder on which the rollers run."""

    radius: PositiveLength | None = Field(
        default=None, description="Radius; either it or the diameter is needed."
    )
    diameter: PositiveLength | None = Field(default=None, description="Diameter.")
    material: MaterialField = Field(description="Name of a material, or a table of its constants.")
    axial_profile: AxialKey | None = Field(
        default=None, description=f"{DESCRIPTION} By default straight."
    )
    profile: InputFile | None = Field(
        default=None,
        description="Initial surface: a CSV file with columns y and height above the nominal shape,"
        " negative where material is worn, or depth; or a surface in SDF or X3P.",
    )
    profile_columns: tuple[str, str] | None = Field(
        default=None, description="Names of the columns of position and height."
    )
    profile_units: tuple[str, str] | None = Field(
        default=None, description="Units of these columns where the header has none."
    )
    profile_row: int | None = Field(
        default=None, ge=0, description="Number of a row of a surface, counted from 0."
    )
    profile_mean_rows: tuple[int, int] | None = Field(
        default=None, description="First row of a mean, and the row after the last."
    )
    profile_at: Length | None = Field(
        default=None, description="Position of a row across the rows of a surface."
    )
    profile_filter: PositiveLength | None = Field(
        default=None,
        description="Cutoff wavelength of the Gaussian filter that removes roughness.",
    )


class Roller(Options):
    """Geometry and material of the rollers."""

    radius: float = Field(description="Rolling radius [m].")
    axial_profile: AxialChoice = Field(description="Form along the axis.")
    offset: PerRoller[Length] = Field(
        description="Axial position of the apex, one for all rollers or one per roller [m]."
    )
    material: Material = Field(description="Material of the rollers.")
    width: float | None = Field(None, description="Width across the track [m].")
    edge_radius: float = Field(0.0, description="Radius of the rounded edges, or 0 [m].")
    chamfer: float = Field(0.0, description="Width of the chamfers, or 0 [m].")
    chamfer_angle: float = Field(0.0, description="Angle of the chamfers to the axis [rad].")
    inertia: float = Field(0.0, description="Moment of inertia about its pin [kg m^2].")
    profiles: tuple[Profile, ...] = Field(
        (), description="Start profiles: none, one for all rollers or one per roller."
    )

    @property
    def crown_radius(self) -> float:
        """Radius of a circular crown across the track [m]; not a number of other forms."""
        form = self.axial_profile
        return (
            float(getattr(form.options, "radius", math.nan)) if form.form == "crown" else math.nan
        )

    @property
    def edge(self) -> float:
        """Width of the edges, of their rounding or chamfer [m]."""
        return max(self.edge_radius, self.chamfer)

    def edge_drop(self, from_apex: FloatArray) -> FloatArray | float:
        """Return the distance of the surface below the crown at the edges [m].

        Parameters
        ----------
        from_apex : ndarray
            Axial distance from the apex [m].

        Returns
        -------
        ndarray or float
            Same shape; the roller's radius beyond its ends, and 0 for a roller without width.
        """
        if self.width is None:
            return 0.0
        into = np.abs(from_apex) - (0.5 * self.width - self.edge)
        inside = np.clip(into, 0.0, self.edge)
        if self.edge_radius:
            drop = self.edge_radius - np.sqrt(self.edge_radius**2 - inside**2)
        else:
            drop = inside * math.tan(self.chamfer_angle)
        ended = into > self.edge * (1.0 + _ROUNDING) + _ROUNDING * self.width
        return np.where(ended, self.radius, drop)


@dataclass(frozen=True)
class Cylinder:
    """Geometry and material of the cylinder.

    Parameters
    ----------
    radius : float
        Radius [m].
    material : Material
        Material of the cylinder.
    profile : Profile, optional
        Initial height of the surface above its nominal shape.
    profile_file : str
        Name of the file that it was read from, as in `Scenario.files`.
    profile_filter : float, optional
        Cutoff wavelength of the filter that has been applied to it [m].
    axial_profile : AxialChoice
        Form along the axis.
    start_surface : StartSurface, optional
        Initial height of a cam's surface above its nominal shape.
    name : str
        "cylinder", or "cam" for the base circle of a cam.
    """

    radius: float
    material: Material
    profile: Profile | None = None
    profile_file: str = ""
    profile_filter: float | None = None
    axial_profile: AxialChoice = field(default_factory=straight)
    start_surface: StartSurface | None = None
    name: str = "cylinder"


def _radius(radius: float | None, diameter: float | None) -> float:
    """Return the radius that one of the two gives; without both, a mistake has been added."""
    return radius or 0.5 * (diameter or 0.0)


def read_roller(mistakes: Mistakes, raw: Mapping[str, object]) -> Roller | None:
    """Return the rollers, or None after adding the mistakes of the table [roller]."""
    table = validate(mistakes, RollerTable, raw, "roller")
    if table is None:
        return None
    radius = _radius(table.radius, table.diameter)
    _check_edges(mistakes, table, radius)
    profiles, given = read_roller_profiles(mistakes, table.profile), table.axial_profile
    crowned = crown(_radius(table.crown_radius, table.crown_diameter))
    form = crowned if given is None else read_axial(mistakes, given, "roller")
    if form is None:
        return None
    return Roller.model_construct(
        radius=radius,
        axial_profile=form,
        profiles=profiles,
        offset=table.offset,
        material=table.material,
        width=table.width,
        edge_radius=table.edge_radius or 0.0,
        chamfer=table.chamfer or 0.0,
        chamfer_angle=table.chamfer_angle if table.chamfer else 0.0,
        inertia=table.inertia,
    )


def _check_edges(mistakes: Mistakes, table: RollerTable, radius: float) -> None:
    """Add the mistakes of width, edge radius and chamfer."""
    edges = {"edge_radius": table.edge_radius, "chamfer": table.chamfer}
    given = {key: size for key, size in edges.items() if size is not None}
    for key, size in given.items():
        text = f"{size * 1e3:.6g} mm"
        if table.width is None:
            mistakes.add("roller", key, "needs the width of the roller", text, 'width = "10 mm"')
        elif size > 0.5 * table.width:
            mistakes.add(
                "roller",
                key,
                "the edges meet",
                text,
                f"at most {0.5e3 * table.width:.6g} mm, half the width",
            )
        elif size > radius:
            mistakes.add(
                "roller",
                key,
                "is too great",
                text,
                f"at most {1e3 * radius:.6g} mm, the radius of the roller",
            )
    if len(given) > 1:
        mistakes.add("roller", "chamfer", "an edge is rounded or chamfered", None, "one of them")
    if table.chamfer_angle >= 0.5 * math.pi:
        mistakes.add(
            "roller",
            "chamfer_angle",
            "is too great",
            f"{math.degrees(table.chamfer_angle):.6g} deg",
            "less than 90 deg",
        )
    if "chamfer_angle" in table.model_fields_set and table.chamfer is None:
        mistakes.add("roller", "chamfer_angle", "has no meaning without chamfer")


def read_cylinder(mistakes: Mistakes, raw: Mapping[str, object]) -> Cylinder | None:
    """Return the cylinder, or None after adding the mistakes of the table [cylinder]."""
    rows = {key: raw[f"profile_{key}"] for key in ROW_CHOICES if f"profile_{key}" in raw}
    if rows and isinstance(raw.get("profile"), str):
        # one name for one profile: results keep the chosen rows as the content of this file
        raw = {**raw, "profile": name_of_rows(str(raw["profile"]), rows)}
    table = validate(mistakes, CylinderTable, raw, "cylinder")
    if table is None:
        return None
    form = read_axial(mistakes, table.axial_profile, "cylinder")
    if form is None:
        return None
    radius = _radius(table.radius, table.diameter)
    if table.profile is None:
        for key in raw:
            if key.startswith("profile_"):
                mistakes.add("cylinder", key, "has no meaning without profile")
        return Cylinder(radius, table.material, axial_profile=form)
    choice = ProfileChoice(table.profile_columns, table.profile_units)
    try:
        profile = read_profile(table.profile.text, table.profile.path, choice)
        if table.profile_filter is not None:
            profile = gaussian_filtered(profile, table.profile_filter)
    except ScenarioError as error:
        mistakes.add_file(error, "cylinder", "profile")
        return None
    except ValueError as error:
        mistakes.add("cylinder", "profile_filter", str(error))
        return None
    if sign := sign_note(profile, choice, table.profile.path):
        mistakes.notes.append(sign)
    return Cylinder(radius, table.material, profile, table.profile.path, table.profile_filter, form)


def dundurs_note(pair: ElasticPair, contact: ContactChoice) -> list[str]:
    """Return a note if the coupling of pressure and traction is neglected but not negligible.

    In line contact a pressure p changes the slip by 2 beta p/E*, with Dundurs' constant beta.
    """
    if getattr(contact.options, "coupling", False) or abs(pair.dundurs) <= DUNDURS_LIMIT:
        return []
    slip = 2.0 * abs(pair.dundurs) * COUPLING_PRESSURE / pair.contact_modulus
    return [
        (
            f"the materials' Dundurs constant is {pair.dundurs:.3g}: a pressure of"
            f" {COUPLING_PRESSURE / 1e6:.0f} MPa changes the slip by {slip:.1e} in line contact,"
            " which is neglected; contact.model = 'halfspace' with coupling = true includes it"
        )
    ]
