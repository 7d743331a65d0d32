"""Warnings of inputs that are valid but hardly meant, such as a load in the wrong unit."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from wearsim.models.loads import FollowerLoad, gap_text
from wearsim.scenario import RandomInput, Scenario
from wearsim.scenario.tables.fatigue import FatigueChoice
from wearsim.studies.cam.checks import cam_warnings, skids_of
from wearsim.studies.cam.turn import turn_of
from wearsim.studies.roller_ends import (
    LEAST_PER_EDGE,
    STRIPS_BEYOND,
    edge_in_contact,
    strips_of_roller,
)
from wearsim.studies.run.inputs import load_file
from wearsim.studies.run.setup import Setup
from wearsim.types import FloatArray

# peak pressure over yield stress in shear, beyond which a surface never shakes down; with a
# friction coefficient above 1/4 in full slip it is the inverse of that (Johnson, section 9.2)
SHAKEDOWN = 4.0
SURFACE_YIELDS = 0.3  # friction in full slip, above which the greatest shear is at the surface
GREATEST_CREEPAGE = 0.05
GREATEST_FRICTION = 1.0
ELASTIC_PART = 0.04  # of the contact modulus; 4.4 GPa with steel, which hardened steel just bears
WIDEST = 2.0  # half-width of a patch over the radius of the roller
_PROBABILITIES = np.array([0.05, 0.95])


def range_90(item: RandomInput) -> list[tuple[float, float]]:
    """Return the 5 % and 95 % quantile of each value that a random input sets [SI]."""
    if item.role == "joint":
        draws = item.values(np.random.default_rng(0).random((2**16, item.dimension)))
        low, high = np.quantile(draws, _PROBABILITIES, axis=0).tolist()
        return list(zip(low, high, strict=True))
    low, high = item.scalar.quantile(_PROBABILITIES).tolist()
    return [(low, high)]


def plausibility_warnings(setup: Setup) -> list[str]:
    """Return warnings of implausible pressures, creepages, friction, logs and contact widths.

    Also of an automatically chosen contact model, if its error may exceed the tolerance.

    Parameters
    ----------
    setup : Setup
        Of a run or of a single contact.

    Returns
    -------
    list of str
        Each begins with a different name of what is implausible, and a colon.
    """
    scenario, force = setup.scenario, greatest_load(setup.scenario)
    friction = _greatest(scenario, "friction.coefficient", scenario.friction.coefficient)
    return [
        *(_of_pressure(setup, force, friction) if force > 0.0 else ()),
        *_of_slip(scenario, friction),
        *_of_width(setup, force),
        *(_of_shape(setup, force) if force > 0.0 else ()),
        *_of_log(scenario),
        *_of_cam(scenario),
        *_of_model(scenario),
    ]


def greatest_load(scenario: Scenario) -> float:
    """Return the greatest load of the test, or of the start of a single contact [N]."""
    load = scenario.load.built
    if isinstance(load, FollowerLoad):
        return turn_of(scenario).normal_range[1]
    return load.extremes(0.0, scenario.total_time if scenario.has_length else 0.0)[1]


def _greatest(scenario: Scenario, key: str, value: float | tuple[float, ...]) -> float:
    """Return the greatest magnitude of an input, with 90 % probability where it is random."""
    for item in scenario.random:
        ranges = dict(zip(item.keys, range_90(item), strict=True))
        if key in ranges:
            return max(map(abs, ranges[key]))
    return float(np.abs(value).max())


def _of_pressure(setup: Setup, load: float, friction: float) -> Iterator[str]:
    scenario, (patch, force) = setup.scenario, setup.hardest_patch(load)
    pressure = patch.peak_pressure
    text = f"the peak pressure of {pressure / 1e6:.4g} MPa at {force:.6g} N"
    for name, body in ("roller", scenario.roller), (scenario.cylinder.name, scenario.cylinder):
        strength, limit, what = body.material.yield_stress, body.material.hardness, "its hardness"
        if strength is not None:
            factor = min(SHAKEDOWN, 1.0 / friction if friction > 0.0 else SHAKEDOWN)
            limit = factor * strength / math.sqrt(3.0)
            what = f"its shakedown limit, {factor:.3g} times the yield stress in shear,"
        if limit is not None and pressure > limit:
            yield (
                f"{name}.material: {text} exceeds {what} of {limit / 1e6:.4g} MPa;"
                " the model is elastic"
            )
    if pressure > ELASTIC_PART * scenario.pair.contact_modulus:
        file = load_file(scenario)
        remedy = f"is the unit of the load in {file[1]} right?" if file else "is the load right?"
        yield (
            f"load: {text} exceeds {100.0 * ELASTIC_PART:g} % of the contact modulus, more than"
            f" metals bear; {remedy} A thousandth of it gives {pressure / 1e7:.4g} MPa"
        )
    if scenario.fatigue is not None:
        yield from _of_fatigue(scenario.fatigue, pressure, friction, text)


def _of_fatigue(
    choice: FatigueChoice, pressure: float, friction: float, text: str
) -> Iterator[str]:
    """Yield warnings of friction by which the surface yields first, and of unfit constants."""
    if friction > SURFACE_YIELDS:
        yield (
            f"fatigue, friction: with a coefficient of {friction:.3g}, above {SURFACE_YIELDS:g}, a"
            " surface in full slip yields first, at the surface and not below it"
        )
    for body_name, law in choice.laws.items():
        valid = law.valid_pressure
        if valid is not None and not valid[0] <= pressure <= valid[1]:
            yield (
                f"fatigue.{body_name}: {text} is outside the {valid[0] / 1e6:.4g} to"
                f" {valid[1] / 1e6:.4g} MPa for which the constants hold ({law.source})"
            )


def _of_slip(scenario: Scenario, friction: float) -> Iterator[str]:
    for key in ("longitudinal", "yaw"):
        size = _greatest(scenario, f"creepage.{key}", getattr(scenario.creepage, key) or 0.0)
        if size > GREATEST_CREEPAGE:
            yield (
                f"creepage.{key}: a creepage of {size:.3g} exceeds {GREATEST_CREEPAGE:.0%}; it is"
                " assumed to be small, and 0.1 % is written 0.001"
            )
    if friction > GREATEST_FRICTION:
        yield f"friction.coefficient: {friction:.3g} exceeds {GREATEST_FRICTION:g}"


def _of_width(setup: Setup, force: float) -> Iterator[str]:
    scenario = setup.scenario
    if scenario.roller.width is not None:
        yield from _of_edge(setup, force)
    if scenario.contact.width or scenario.roller.width or force <= 0.0:
        return
    half_width, crown = setup.widest_patch(force).b, scenario.roller.crown_radius
    if half_width > WIDEST * scenario.roller.radius:
        form = "" if math.isnan(crown) else f" of {crown * 1e3:.4g} mm"
        key = "axial_profile" if math.isnan(crown) else "crown_radius"
        yield (
            f"roller.{key}: a crown{form} makes a"
            f" contact {2e3 * half_width:.4g} mm wide, and nothing ends it; set roller.width"
        )


def _of_shape(setup: Setup, force: float) -> Iterator[str]:
    patch = setup.widest_patch(force)
    if setup.scenario.contact.model == "slender" and patch.a > patch.b:
        yield (
            f"contact.model: the unworn contact, {2e3 * patch.a:.4g} x {2e3 * patch.b:.4g} mm along"
            " and across rolling, is longer than wide, and 'slender' assumes the opposite;"
            " 'semi-hertzian' or 'halfspace' does not"
        )


def _of_edge(setup: Setup, force: float) -> Iterator[str]:
    scenario = setup.scenario
    roller, choice = scenario.roller, scenario.contact
    width, edge = roller.width or 0.0, edge_in_contact(scenario, force)
    strips = choice.strips or strips_of_roller(scenario, 0, force)
    spacing = (choice.width / strips) if choice.width else width / (strips - 2 * STRIPS_BEYOND)
    if edge >= LEAST_PER_EDGE * spacing or setup.widest_patch(force).b < 0.5 * width:
        return
    key = "edge_radius" if roller.edge_radius else "chamfer" if roller.chamfer else "width"
    shape = f"the edge is in contact over about {edge * 1e3:.2g} mm" if edge else "a sharp edge"
    yield (
        f"roller.{key}: {shape}, which the strips do not resolve: the peak pressure at the ends of"
        " the roller depends on their number"
    )


def _of_cam(scenario: Scenario) -> list[str]:
    if scenario.cam is None:
        return []
    turn = turn_of(scenario)
    return cam_warnings(turn, skids_of(turn))


def _of_log(scenario: Scenario) -> Iterator[str]:
    gaps: FloatArray = scenario.load.built.gaps
    if scenario.has_length:
        gaps = gaps[gaps[:, 0] < scenario.total_time]
    file = load_file(scenario)
    if file and len(gaps):
        how = getattr(scenario.load.options, "gaps", "interpolate")
        done = "the last value is held" if how == "hold" else "the load is interpolated"
        yield (f'{file[1]}: {gap_text(gaps)}; {done} (load.gaps = "{how}")')


def _of_model(scenario: Scenario) -> Iterator[str]:
    auto = scenario.contact.auto
    if auto is not None and auto.chosen is not None and auto.chosen.warning:
        yield auto.chosen.warning
