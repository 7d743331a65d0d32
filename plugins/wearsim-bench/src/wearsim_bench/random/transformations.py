"""Scenarios that have a known relation to a given one: other units, a mirror image, more load."""

from __future__ import annotations

import csv
import io
import math
import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from wearsim.scenario import Scenario, parse_scenario
from wearsim.units import measure

QUANTITY = re.compile(r"([-+]?[0-9_.]+(?:[eE][-+]?[0-9]+)?)\s+(\S.*)")
HEADER = re.compile(r"(.*)\[(.+)\]\s*")
BODIES, WEARING = ("roller", "cylinder", "cam"), ("cylinder", "roller")
_TO_ONE_SIDE = ("offset", "yaw", "tilt", "centre")  # change their sign in a mirror


@dataclass(frozen=True)
class UnitSystem:
    """Factors of all lengths, masses and times.

    Parameters
    ----------
    length, mass, time : float
        Factors, powers of two so that no digit is lost.
    """

    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0

    def factor(self, unit: str) -> float:
        """Return the factor of a quantity in a unit."""
        powers = {name.strip("[]"): int(power) for name, power in measure(unit)[1]}
        factors = {"length": self.length, "mass": self.mass, "time": self.time, "angle": 1.0}
        return math.prod(factors[name] ** power for name, power in powers.items())

    def changed(self, text: str) -> str:
        """Return a quantity such as "30 mm" in these units; other texts remain."""
        match = QUANTITY.fullmatch(text)
        if match is None:
            return text
        try:
            factor = self.factor(match[2])
        except ValueError:
            return text
        return text if factor == 1.0 else f"{float(match[1]) * factor!r} {match[2]}"


#: twice the length at the same pressures, twice the forces at the same lengths, half the time
SYSTEMS = {
    "length": UnitSystem(length=2.0, mass=2.0),
    "force": UnitSystem(mass=2.0),
    "time": UnitSystem(time=0.5, mass=0.25),
}


def in_units(scenario: Scenario, units: UnitSystem) -> Scenario:
    """Return a scenario whose lengths, masses and times all have other sizes.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    units : UnitSystem
        The factors.
    """
    document = tomllib.loads(scenario.text)
    for body in BODIES:
        if body in document:
            document[body]["material"] = _constants(scenario, body)
    threshold = f"{scenario.outputs.width_threshold!r} m"
    document.setdefault("outputs", {}).setdefault("width_threshold", threshold)
    for body in WEARING:  # defaults with a dimension
        options = getattr(scenario.wear and scenario.wear.options, body, None)
        if (density := getattr(options, "density", None)) is not None:
            document["wear"][body].setdefault("density", f"{density!r} kg/m^3")
    changed = _mapped(document, lambda _key, value: _in(units, value))
    files = {name: _columns(text, units.factor) for name, text in scenario.files.items()}
    return _parsed(changed, scenario, files)


def mirrored(scenario: Scenario) -> Scenario:
    """Return the mirror image of a scenario in the plane of the cylinder's or cam's middle."""

    def reflected(key: str, value: Any) -> Any:
        if key not in _TO_ONE_SIDE:
            return value
        if isinstance(value, list):
            return [reflected(key, item) for item in value]
        if isinstance(value, str):
            return value[1:] if value.startswith("-") else f"-{value}"
        return -value if isinstance(value, float | int) else value

    document = tomllib.loads(scenario.text)
    changed = _mapped(document, reflected)
    if "follower" in changed and "offset" in document["follower"]:  # in the plane of the cam
        changed["follower"]["offset"] = document["follower"]["offset"]
    files = {
        name: _columns(text, lambda unit: 1.0, mirror=True) for name, text in scenario.files.items()
    }
    return _parsed(changed, scenario, files)


def has_mirror_image(scenario: Scenario) -> bool:
    """Return whether all directions of a scenario are plain values, which a mirror can turn."""
    tables = tomllib.loads(scenario.text)
    creepage = tables.get("creepage", {})
    return "misalignment" not in creepage and not any(
        isinstance(creepage.get(key), dict) for key in ("yaw", "tilt")
    )


def _constants(scenario: Scenario, body: str) -> dict[str, object]:
    """Return the table of the constants of a body's material."""
    material = (scenario.roller if body == "roller" else scenario.cylinder).material
    constants: dict[str, object] = {
        "youngs_modulus": f"{material.youngs_modulus!r} Pa",
        "poisson_ratio": material.poisson_ratio,
    }
    for name in ("hardness", "yield_stress"):
        if (value := getattr(material, name)) is not None:
            constants[name] = f"{value!r} Pa"
    return constants


def _in(units: UnitSystem, value: Any) -> Any:
    if isinstance(value, str):
        return units.changed(value)
    return [_in(units, item) for item in value] if isinstance(value, list) else value


def _mapped(table: Mapping[str, Any], change: Callable[[str, Any], Any]) -> dict[str, Any]:
    """Return a table with every value changed that is not a table, also in lists of tables."""

    def value_of(key: str, value: Any) -> Any:
        if isinstance(value, Mapping):
            return _mapped(value, change)
        if isinstance(value, list) and any(isinstance(item, Mapping) for item in value):
            return [value_of(key, item) for item in value]
        return change(key, value)

    return {key: value_of(key, value) for key, value in table.items()}


def _columns(text: str, factor: Callable[[str], float], *, mirror: bool = False) -> str:
    """Return a CSV file with each column multiplied by the factor of its unit, or mirrored."""
    lines = (line for line in io.StringIO(text) if not line.startswith("#"))
    head, *rows = csv.reader(lines)
    factors = []
    for name in head:
        match = HEADER.fullmatch(name)
        factors.append(1.0 if match is None else factor(match[2]))
        if mirror and name.split("[")[0].strip() == "y":
            factors[-1] = -1.0
    numbers = [
        [repr(float(cell) * by) for cell, by in zip(row, factors, strict=True)] for row in rows
    ]
    if mirror and -1.0 in factors:
        numbers.reverse()  # positions increase
    return "\n".join(",".join(row) for row in [head, *numbers])


def _parsed(document: Mapping[str, Any], scenario: Scenario, files: Mapping[str, str]) -> Scenario:
    import tomlkit  # noqa: PLC0415  (slow to import)

    return parse_scenario(tomlkit.dumps(document), scenario.file, files.__getitem__)
