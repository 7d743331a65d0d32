"""Tables [roller] and [cylinder]: shapes and materials."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal, TypeAlias

from pydantic import Field, PlainValidator

from wearsim.csv_tables import read_columns
from wearsim.errors import ScenarioError
from wearsim.plugins import Options
from wearsim.quantities import InputFile, Length, PerRoller, PositiveLength, PositivePressure
from wearsim.scenario.parse.mistakes import Mistakes
from wearsim.scenario.parse.random_inputs import validate
from wearsim.types import Material, Profile
from wearsim.units import QuantityError, shown

#: Handbook constants: phosphor bronze C51000, ductile iron of EN 1563.
MATERIALS = {
    "steel": Material(200e9, 0.3),
    "aluminium": Material(70e9, 0.33),
    "bronze": Material(110e9, 0.34),
    "ductile-iron": Material(169e9, 0.275),
}
MaterialName: TypeAlias = Literal["steel", "aluminium", "bronze", "ductile-iron"]


class MaterialTable(Options):
    """Elastic constants of a material."""

    youngs_modulus: PositivePressure = Field(description="Young's modulus.")
    poisson_ratio: float = Field(ge=0.0, le=0.5, description="Poisson's ratio.")
    hardness: PositivePressure | None = Field(
        default=None, description="Indentation hardness, for wear laws that need it."
    )


def _read_material(value: object) -> Material:
    expected = f"one of {', '.join(shown(name) for name in MATERIALS)} or a table of its constants"
    if isinstance(value, str) and value in MATERIALS:
        return MATERIALS[value]
    if not isinstance(value, dict):
        raise QuantityError(
            "unknown material" if isinstance(value, str) else "is not a material",
            shown(value),
            expected,
        )
    table = MaterialTable.model_validate_json(json.dumps(value, default=str), strict=True)
    return Material(table.youngs_modulus, table.poisson_ratio, table.hardness)


MaterialField: TypeAlias = Annotated[
    Material,
    PlainValidator(_read_material, json_schema_input_type=MaterialName | MaterialTable),
]


class RollerTable(Options):
    """Rollers: crowned, all of the same shape."""

    radius: PositiveLength | None = Field(
        default=None, description="Rolling radius; either it or the diameter is needed."
    )
    diameter: PositiveLength | None = Field(default=None, description="Rolling diameter.")
    crown_radius: PositiveLength | None = Field(
        default=None,
        description="Radius of the crown across the track; or give its diameter.",
    )
    crown_diameter: PositiveLength | None = Field(default=None, description="Crown diameter.")
    offset: PerRoller[Length] = Field(
        default=0.0,
        description="Axial position of the apex: one value for all rollers or one per roller.",
    )
    material: MaterialField = Field(description="Name of a material, or a table of its constants.")


class CylinderTable(Options):
    """Cylinder on which the rollers run."""

    radius: PositiveLength | None = Field(
        default=None, description="Radius; either it or the diameter is needed."
    )
    diameter: PositiveLength | None = Field(default=None, description="Diameter.")
    material: MaterialField = Field(description="Name of a material, or a table of its constants.")
    profile: InputFile | None = Field(
        default=None,
        description="CSV file with columns y and height: initial height of the surface above its"
        " nominal shape, negative where material is worn.",
    )


class Roller(Options):
    """Geometry and material of the rollers."""

    radius: float = Field(description="Rolling radius [m].")
    crown_radius: float = Field(description="Radius of the crown across the track [m].")
    offset: PerRoller[Length] = Field(
        description="Axial position of the apex, one for all rollers or one per roller [m]."
    )
    material: Material = Field(description="Material of the rollers.")


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
    """

    radius: float
    material: Material
    profile: Profile | None = None


def _radius(radius: float | None, diameter: float | None) -> float:
    """Return the radius that one of the two gives; without both, a mistake has been added."""
    return radius or 0.5 * (diameter or 0.0)


def read_roller(mistakes: Mistakes, raw: Mapping[str, object]) -> Roller | None:
    """Return the rollers, or None after adding the mistakes of the table [roller]."""
    table = validate(mistakes, RollerTable, raw, "roller")
    if table is None:
        return None
    return Roller.model_construct(
        radius=_radius(table.radius, table.diameter),
        crown_radius=_radius(table.crown_radius, table.crown_diameter),
        offset=table.offset,
        material=table.material,
    )


def read_cylinder(mistakes: Mistakes, raw: Mapping[str, object]) -> Cylinder | None:
    """Return the cylinder, or None after adding the mistakes of the table [cylinder]."""
    table = validate(mistakes, CylinderTable, raw, "cylinder")
    if table is None:
        return None
    try:
        profile = read_profile(table.profile) if table.profile else None
    except ScenarioError as error:
        mistakes.add_file(error, "cylinder", "profile")
        return None
    return Cylinder(_radius(table.radius, table.diameter), table.material, profile)


def read_profile(file: InputFile) -> Profile:
    """Return the profile of a CSV file with the columns y and height.

    Raises
    ------
    ScenarioError
        With all mistakes of the file.
    """
    columns = read_columns(file.text, file.path, {"y": "m", "height": "m"}, rising="y")
    return Profile(columns["y"], columns["height"])
