"""Description of the run of a scenario in engineering units, without running it."""

from __future__ import annotations

from wearsim.mechanics.hertz.elasticity import combine
from wearsim.scenario import Scenario, described_model
from wearsim.studies.contact.single import study_contact
from wearsim.studies.run.assemble import assemble_problem
from wearsim.studies.run.draws import draw
from wearsim.studies.run.grid import fresh_patch
from wearsim.studies.run.inputs import load_range

TableRows = list[tuple[str, str]]


def _creepage(scenario: Scenario) -> str:
    creepage = scenario.creepage
    if creepage.drive == "free":
        text = f"free, bearing torque {(creepage.bearing_torque or 0.0) * 1e3:.4g} N mm"
    else:
        text = f"longitudinal {creepage.longitudinal:.4g}"
    for name, value in (("yaw", creepage.yaw), ("tilt", creepage.tilt)):
        angles = scenario.per_roller(value)
        if any(angles):
            text += f", {name} " + " / ".join(f"{angle * 1e3:.4g}" for angle in angles) + " mrad"
    return text + (", differential slip" if creepage.differential_slip else "")


def _random(scenario: Scenario) -> TableRows:
    """Return a row per random input and, where there are any, one for the sampling."""
    if not scenario.random:
        return []
    table = scenario.sampling
    pairs = [f"{first} with {second} {rank:g}" for first, second, rank in table.correlation]
    words = [table.plan, f"realisation {table.realisation}"]
    words += [f"rank correlation of {', '.join(pairs)}"] if pairs else []
    rows = [(f"random {item.name}", item.describe()) for item in scenario.random]
    return [*rows, ("sampling", ", ".join(words))]


def _test(scenario: Scenario) -> TableRows:
    problem, _, stepper = assemble_problem(draw(scenario))
    grid, law = problem.grid, scenario.wear
    counts = problem.kinematics.multiplicity
    identical = ", all identical" if len(counts) == 1 and counts[0] > 1 else ""
    rollers = f"{counts.sum():.0f} ({len(counts)} solved{identical})"
    strips = (
        f"{grid.strips} of {grid.spacing * 1e3:.4g} mm,"
        f" {grid.y[0] * 1e3:.4g} to {grid.y[-1] * 1e3:.4g} mm"
    )
    return [
        ("rollers", rollers if counts.sum() > 1 else "1"),
        (
            "duration",
            f"{scenario.total_time / 60.0:.6g} min, {scenario.total_passes:,} roller passes",
        ),
        ("wear law", "" if law is None else f"{law.law} ({law.spec.summary})"),
        ("strips", strips),
        ("stepper", f"{stepper}, tolerance {scenario.evolution.tolerance:.1e}"),
    ]


def plan(scenario: Scenario) -> TableRows:
    """Return the description of a scenario's run as rows of name and value.

    Parameters
    ----------
    scenario : Scenario
        A scenario of a run or of a single contact.

    Returns
    -------
    list of (str, str)

    Raises
    ------
    ScenarioError, CapabilityError
        If it cannot run.
    """
    load, operation = scenario.load.build(), scenario.operation
    has_end = operation.duration is not None or operation.passes is not None
    is_run = has_end and scenario.wear is not None
    low, high = load_range(scenario, load, scenario.total_time if is_run else 0.0)
    values = f"{low:.4g} N" if low == high else f"{low:.4g} to {high:.4g} N"
    if load.stiffness > 0.0:
        values += f", less {load.stiffness / 1e3:.4g} N/mm of descent"
    values += "".join(f", plus {term.name}" for term in scenario.load.terms)
    roller, cylinder, choice = scenario.roller, scenario.cylinder, scenario.contact
    pair, patch = combine(cylinder.material, roller.material), fresh_patch(scenario, high)
    radii = f"radius {roller.radius * 1e3:.6g} mm, crown radius {roller.crown_radius * 1e3:.6g} mm"
    moduli = (
        f"contact modulus {pair.contact_modulus / 1e9:.4g} GPa,"
        f" shear modulus {pair.shear_modulus / 1e9:.4g} GPa"
    )
    size = (
        f"{2e3 * patch.a:.4g} x {2e3 * patch.b:.4g} mm,"
        f" peak pressure {patch.peak_pressure / 1e6:.4g} MPa"
    )
    rows = [
        ("roller", radii),
        ("cylinder", f"radius {cylinder.radius * 1e3:.6g} mm"),
        ("elasticity", moduli),
        ("rolling speed", f"{scenario.rolling_speed:.4g} m/s"),
        ("load", f"{scenario.load.kind}, {values}"),
        ("friction", f"{scenario.friction.coefficient:.4g}"),
        ("creepage", _creepage(scenario)),
        *_random(scenario),
        ("contact model", f"{described_model(choice.model, scenario.text)}: {choice.spec.summary}"),
        ("initial patch (Hertz)", size),
    ]
    if is_run:
        return rows + _test(scenario)
    strips = study_contact(scenario).grid.strips
    return [*rows, ("runs as", f"one contact, {strips} strips (no duration or no wear law)")]
