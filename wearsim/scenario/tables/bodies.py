"""The tables [roller] and [cylinder]: shapes and materials."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal, TypeAlias

from pydantic import Field, PlainValidator

from wearsim.csv_tables import read_columns
from wearsim.errors import ScenarioError
from wearsim.quantities import InputFile, Length, PerRoller, PositiveLength, PositivePressure
from wearsim.scenario.parse.mistakes import Report, Table
from wearsim.scenario.parse.validate import validate
from wearsim.types import Material, Profile
from wearsim.units import QuantityError, shown

# Handbook constants; the bronze is phosphor bronze C51000, the ductile iron follows EN 1563.
MATERIALS = {
    "steel": Material(200e9, 0.3),
    "aluminium": Material(70e9, 0.33),
    "bronze": Material(110e9, 0.34),
    "ductile-iron": Material(169e9, 0.275),
}
MaterialName: TypeAlias = Literal["steel", "aluminium", "bronze", "ductile-iron"]


class MaterialTable(Table):
    """A material by its constants."""

    youngs_modulus: PositivePressure = Field(description="Young's modulus.")
    poisson_ratio: float = Field(ge=0.0, le=0.5, description="Poisson's ratio.")
    hardness: PositivePressure | None = Field(
        default=None, description="Indentation hardness, for wear laws that need it."
    )


def _read_material(value: object) -> Material:
    expected = f"one of {', '.join(shown(name) for name in MATERIALS)} or a table of its constants"
    if isinstance(value, str):
        if value not in MATERIALS:
            raise QuantityError("unknown material", shown(value), expected)
        return MATERIALS[value]
    if not isinstance(value, dict):
        raise QuantityError("is not a material", shown(value), expected)
    table = MaterialTable.model_validate_json(json.dumps(value, default=str), strict=True)
    return Material(table.youngs_modulus, table.poisson_ratio, table.hardness)


MaterialField: TypeAlias = Annotated[
    Material,
    PlainValidator(_read_material, json_schema_input_type=MaterialName | MaterialTable),
]


class RollerTable(Table):
    """The rollers: crowned, all of one shape."""

    radius: PositiveLength | None = Field(
        default=None, description="Rolling radius; give it or the diameter."
    )
    diameter: PositiveLength | None = Field(default=None, description="Rolling diameter.")
    crown_radius: PositiveLength | None = Field(
        default=None, description="Radius of the crown across the track; or its diameter."
    )
    crown_diameter: PositiveLength | None = Field(default=None, description="Crown diameter.")
    offset: PerRoller[Length] = Field(
        default=0.0, description="Axial position of each roller's apex, one for all or a list."
    )
    material: MaterialField = Field(description="A material's name, or a table of its constants.")


class CylinderTable(Table):
    """The cylinder that the rollers run on."""

    radius: PositiveLength | None = Field(
        default=None, description="Radius; give it or the diameter."
    )
    diameter: PositiveLength | None = Field(default=None, description="Diameter.")
    material: MaterialField = Field(description="A material's name, or a table of its constants.")
    profile: InputFile | None = Field(
        default=None,
        description="CSV with columns y and height: the surface above its nominal shape at the"
        " start, worn material negative.",
    )


@dataclass(frozen=True)
class Roller:
    """The rollers.

    Parameters
    ----------
    radius, crown_radius : float
        Rolling radius, and radius of the crown across the track [m].
    offset : float or tuple of float
        Axial position of the apex, for all rollers or one per roller [m].
    material : Material
        What they are made of.
    """

    radius: float
    crown_radius: float
    offset: float | tuple[float, ...]
    material: Material


@dataclass(frozen=True)
class Cylinder:
    """The cylinder.

    Parameters
    ----------
    radius : float
        Radius [m].
    material : Material
        What it is made of.
    profile : Profile, optional
        Its surface above nominal at the start.
    """

    radius: float
    material: Material
    profile: Profile | None = None


def _radius(radius: float | None, diameter: float | None) -> float | None:
    return radius if diameter is None else 0.5 * diameter


def read_roller(raw: Mapping[str, object], report: Report) -> Roller | None:
    """Return the table [roller], or None after noting its mistakes."""
    report.exactly_one(raw, "roller", ("radius", "diameter"))
    report.exactly_one(raw, "roller", ("crown_radius", "crown_diameter"))
    table = validate(report, RollerTable, raw, "roller")
    if table is None:
        return None
    radius = _radius(table.radius, table.diameter)
    crown = _radius(table.crown_radius, table.crown_diameter)
    if radius is None or crown is None:
        return None
    return Roller(radius, crown, table.offset, table.material)


def read_cylinder(raw: Mapping[str, object], report: Report) -> Cylinder | None:
    """Return the table [cylinder], or None after noting its mistakes."""
    report.exactly_one(raw, "cylinder", ("radius", "diameter"))
    table = validate(report, CylinderTable, raw, "cylinder")
    if table is None:
        return None
    radius = _radius(table.radius, table.diameter)
    try:
        profile = read_profile(table.profile) if table.profile else None
    except ScenarioError as error:
        report.add_file(error, "cylinder", "profile")
        return None
    return None if radius is None else Cylinder(radius, table.material, profile)


def read_profile(file: InputFile) -> Profile:
    """Return the profile in a CSV with the columns y and height.

    Raises
    ------
    ScenarioError
        With every mistake in the file.
    """
    columns = read_columns(file.text, file.path, {"y": "m", "height": "m"}, rising="y")
    return Profile(columns["y"], columns["height"])
