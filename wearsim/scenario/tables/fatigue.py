"""Table [fatigue]: rolling-contact fatigue of the bodies beside wear."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import Field

from wearsim.plugins import BODIES, Body, FatigueLaw, FatigueLawSpec, Options, registry
from wearsim.plugins.checked_laws import CheckedFatigueLaw
from wearsim.plugins.manager import built_plugin
from wearsim.quantities import PositivePressure, Quantity
from wearsim.scenario.parse.mistakes import Mistakes
from wearsim.scenario.parse.random_inputs import choose, validate
from wearsim.units import AREA, as_written, in_engineers_unit


class FatigueTable(Options):
    """Rolling-contact fatigue beside wear; without this table nothing of it is computed."""

    slope: float = Field(
        gt=0.0,
        description="Weibull slope of the lives: 10/9 in point and 9/8 in line contact after"
        " Lundberg and Palmgren, 3/2 in ISO 281.",
    )
    scatter: Literal["common", "weakest-link"] = Field(
        default="common",
        description="What the scatter of the lives belongs to: the body, whose most damaged place"
        " decides, or its places, each as much as its area.",
    )
    reference_area: Annotated[float, Quantity(AREA, "positive")] | None = Field(
        default=None,
        description="Area that was stressed in the tests of the constants, with"
        ' scatter = "weakest-link".',
    )
    probability: float = Field(
        default=0.1,
        gt=0.0,
        lt=1.0,
        description="Probability of pitting at the life that the laws give; 0.1 of an L10 life.",
    )
    remove: bool = Field(
        default=False,
        description="Whether worn-off material takes its damage with it; the damage is then spread"
        " evenly over a layer of 0.786 half-lengths.",
    )
    cylinder: dict[str, object] | None = Field(
        default=None, description="Fatigue of the cylinder or the cam; by default it does not pit."
    )
    roller: dict[str, object] | None = Field(
        default=None, description="Fatigue of each roller; by default rollers do not pit."
    )


class FatigueOfBody(Options):
    """Fatigue of a body; the other keys are constants of the law."""

    law: str = Field(description="Name of the fatigue law.")
    source: str = Field(
        min_length=1, description="Where the constants are from; outputs repeat it."
    )
    valid_pressure: tuple[PositivePressure, PositivePressure] | None = Field(
        default=None, description="Least and greatest pressure for which the constants hold."
    )


@dataclass(frozen=True)
class FatigueLawChoice:
    """A fatigue law with its options, their source and the pressures for which they hold."""

    law: str
    options: Options
    source: str
    valid_pressure: tuple[float, float] | None = None

    def build(self, contact_modulus: float) -> FatigueLaw:
        """Return a new fatigue law for bodies with the contact modulus E* [Pa]."""
        spec = registry().get(FatigueLawSpec, self.law)
        return built_plugin(spec, FatigueLaw, CheckedFatigueLaw, self.options, contact_modulus)


@dataclass(frozen=True)
class FatigueChoice:
    """Fatigue of the bodies.

    Parameters
    ----------
    laws : mapping of body to FatigueLawChoice
        Those of the bodies that may pit.
    slope : float
        Weibull slope of the lives.
    probability : float
        Probability of pitting at a damage of 1.
    reference_area : float, optional
        Area with this probability, with ``scatter = "weakest-link"`` [m^2].
    remove : bool
        Whether worn-off material takes its damage with it.
    """

    laws: Mapping[Body, FatigueLawChoice]
    slope: float
    probability: float = 0.1
    reference_area: float | None = None
    remove: bool = False


def read_fatigue(mistakes: Mistakes, raw: Mapping[str, object]) -> FatigueChoice | None:
    """Return the fatigue of the bodies, or None after adding the mistakes of [fatigue]."""
    table = validate(mistakes, FatigueTable, raw, "fatigue")
    bodies = {body: raw[body] for body in BODIES if isinstance(raw.get(body), dict)}
    by_body = {body: _read_body(mistakes, f"fatigue.{body}", keys) for body, keys in bodies.items()}
    laws = {body: law for body, law in by_body.items() if law is not None}
    if table is None:
        return None
    if not bodies:
        mistakes.add(
            "fatigue",
            " or ".join(BODIES),
            "is needed",
            "none",
            "a table with law, its constants and their source",
        )
    weakest, area = table.scatter == "weakest-link", table.reference_area
    if weakest and area is None:
        mistakes.add(
            "fatigue",
            "reference_area",
            'is needed with scatter = "weakest-link"',
            None,
            AREA.expected("positive"),
        )
    elif not weakest and area is not None:
        got, remedy = in_engineers_unit(area, "m^2"), 'scatter = "weakest-link"'
        mistakes.add("fatigue", "reference_area", "has no meaning without it", got, remedy)
    if len(laws) < max(len(bodies), 1):
        return None
    return FatigueChoice(laws, table.slope, table.probability, area, table.remove)


def _read_body(mistakes: Mistakes, place: str, raw: Any) -> FatigueLawChoice | None:
    """Return the fatigue law of a body, or None after adding mistakes."""
    table, spec, rest = choose(mistakes, FatigueOfBody, "law", FatigueLawSpec, raw, place)
    options = validate(mistakes, spec.options, rest, place, FatigueOfBody) if spec else None
    if table is None or options is None:
        return None
    valid = table.valid_pressure
    if valid is not None and valid[0] >= valid[1]:
        mistakes.add(
            place,
            "valid_pressure",
            "is not a range of pressures",
            as_written([in_engineers_unit(value, "Pa") for value in valid]),
            "the least and then the greatest pressure",
        )
    return FatigueLawChoice(table.law, options, table.source, valid)
