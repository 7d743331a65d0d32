"""Key axial_profile of [roller], [cylinder] and [cam]: the form of a body along its axis."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

from pydantic import Field

from wearsim.errors import ScenarioError
from wearsim.mechanics.hertz.elasticity import ElasticPair, combine
from wearsim.plugins import AxialPair, AxialProfile, AxialProfileSpec, Options, registry
from wearsim.plugins.checked_laws import CheckedAxialProfile
from wearsim.plugins.manager import built_plugin
from wearsim.scenario.axial_gap import AxialGap
from wearsim.scenario.parse.mistakes import Mistakes, key_of_file
from wearsim.scenario.parse.random_inputs import choose, validate
from wearsim.units import QuantityError, in_engineers_unit

if TYPE_CHECKING:
    from wearsim.scenario.tables.bodies import Cylinder, Roller

_WIDER = 1.0 + 1e-9
AxialKey: TypeAlias = dict[str, object] | str

DESCRIPTION = (
    "Form along the axis: a table whose key form names it, a form without options, or the name of"
    " a CSV file."
)


class AxialTable(Options):
    """Form of a body along its axis; the other keys are its options."""

    form: str = Field(description="Name of the form.")


@dataclass(frozen=True)
class AxialChoice:
    """A form along the axis with its options.

    Parameters
    ----------
    form : str
        Name of the form.
    options : Options
        Its options.
    given : mapping of str to object
        The options that a scenario gives, as it writes them.
    """

    form: str
    options: Options
    given: Mapping[str, Any] = field(default_factory=dict, compare=False)

    def build(self, pair: AxialPair) -> AxialProfile:
        """Return the profile for a pair of bodies."""
        spec = registry().get(AxialProfileSpec, self.form)
        return built_plugin(spec, AxialProfile, CheckedAxialProfile, self.options, pair)


def crown(radius: float) -> AxialChoice:
    """Return a circular crown."""
    options: Any = registry().get(AxialProfileSpec, "crown").options
    return AxialChoice(
        "crown", options.model_construct(radius=radius), {"radius": in_engineers_unit(radius, "m")}
    )


def straight() -> AxialChoice:
    """Return a body without a crown."""
    return AxialChoice("straight", registry().get(AxialProfileSpec, "straight").options())


def read_axial(mistakes: Mistakes, key: AxialKey | None, table: str) -> AxialChoice | None:
    """Return the form of a body, or None after adding its mistakes; straight without a key.

    Parameters
    ----------
    mistakes : Mistakes
    key : dict or str, optional
        The key `axial_profile`.
    table : str
        Table of the body, "roller".
    """
    if key is None:
        return straight()
    if isinstance(key, str):
        forms = registry().names(AxialProfileSpec)
        key = {"form": key} if key in forms else {"form": "table", "file": key}
    place = f"{table}.axial_profile"
    named, spec, rest = choose(mistakes, AxialTable, "form", AxialProfileSpec, key, place)
    options = validate(mistakes, spec.options, rest, place, AxialTable) if spec else None
    return None if options is None else AxialChoice(named.form, options, rest)


def pair_of(roller: Roller, cylinder: Cylinder, elastic: ElasticPair) -> AxialPair:
    """Return the pair for which axial profiles are designed."""
    return AxialPair(
        roller.width, elastic.contact_modulus, 1.0 / cylinder.radius + 1.0 / roller.radius
    )


def combine_bodies(mistakes: Mistakes, sections: Mapping[str, Any]) -> dict[str, Any]:
    """Return fields of a scenario that follow from both bodies; none after mistakes in a form.

    Parameters
    ----------
    mistakes : Mistakes
    sections : mapping of str to object
        The tables that have been read; None after mistakes in them.

    Returns
    -------
    dict of str to object
        `pair`, `axial_gap`, and the roller with the width of its form.
    """
    roller, cylinder = sections["roller"], sections["cylinder"]
    if roller is None or cylinder is None or not (roller.radius and cylinder.radius):
        return {}
    elastic = combine(cylinder.material, roller.material)
    profile = _built(mistakes, "roller", roller.axial_profile, pair_of(roller, cylinder, elastic))
    if profile is not None and math.isfinite(profile.length):
        width, length = roller.width, profile.length
        if width is None:
            roller = roller.model_copy(update={"width": length})
        elif width > _WIDER * length:
            mistakes.add(
                "roller",
                "width",
                "exceeds its profile",
                f"{1e3 * width:.6g} mm",
                f"at most {1e3 * length:.6g} mm, the length of roller.axial_profile",
            )
    other = _built(
        mistakes, cylinder.name, cylinder.axial_profile, pair_of(roller, cylinder, elastic)
    )
    if profile is None or other is None:
        return {}
    gap = AxialGap(profile, other, roller.width, roller.radius)
    return {"roller": roller, "pair": elastic, "axial_gap": gap}


def _built(
    mistakes: Mistakes, table: str, choice: AxialChoice, pair: AxialPair
) -> AxialProfile | None:
    """Return a profile, or None after adding the mistakes of its options."""
    place = f"{table}.axial_profile"
    try:
        return choice.build(pair)
    except ScenarioError as error:
        mistakes.add_file(error, place, key_of_file(dict(choice.options), error.file))
    except QuantityError as error:
        mistakes.add(place, "", error.what, error.got, error.expected)
    except ValueError as error:
        mistakes.add(place, "", str(error))
    return None


def described_form(choice: AxialChoice) -> str:
    """Return a form in words: its name and the options that are given, without random ones."""
    texts = [
        f"{key.replace('_', ' ')} {value}"
        for key, value in sorted(choice.given.items())
        if not isinstance(value, Mapping)
    ]
    return ", ".join([choice.form, *texts])
