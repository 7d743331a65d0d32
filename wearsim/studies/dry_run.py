"""Dry run: description of a run, of the inputs that it reads, and its forecast, in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from wearsim.csv_tables import column_names
from wearsim.evolution.problem import WearProblem
from wearsim.plugins import Load
from wearsim.scenario import Cylinder, RandomInput, Scenario, described_model
from wearsim.scenario.tables.axial import described_form
from wearsim.studies.automatic import with_chosen_model
from wearsim.studies.cam.turn import turn_of
from wearsim.studies.contact.single import study_contact
from wearsim.studies.effort import forecast_data
from wearsim.studies.fatigue.unworn import unworn_data
from wearsim.studies.plausibility import plausibility_warnings, range_90
from wearsim.studies.run.assemble import assemble_problem
from wearsim.studies.run.draws import draw, units_of
from wearsim.studies.run.grid import start_of_run
from wearsim.studies.run.inputs import load_file
from wearsim.studies.run.setup import Setup

Data = dict[str, Any]


def dry_run(scenario: Scenario) -> Data:
    """Return the description of a scenario's run, without running it.

    Parameters
    ----------
    scenario : Scenario
        A scenario of a run or of a single contact.

    Returns
    -------
    dict of str to object
        Inputs and settings in SI units, for JSON. Inputs that are random are under "random" only.

    Raises
    ------
    ScenarioError, CapabilityError
        If it cannot run.
    SolverError
        If its first contact, or the contact of the predicted groove, has no solution.

    Examples
    --------
    >>> import wearsim
    >>> from wearsim.scenario.examples import starter_scenario
    >>> from wearsim.scenario import parse_scenario
    >>> data = dry_run(parse_scenario(starter_scenario(), "rig.toml", str))
    >>> data["contact_model"]
    'slender'
    """
    is_run = scenario.has_length and scenario.wear is not None
    scenario = with_chosen_model(scenario, is_run)
    load, means = scenario.load.built, Setup(scenario)
    low, high = means.load_range(scenario.total_time if is_run else 0.0)
    roller, cylinder = scenario.roller, scenario.cylinder
    crowned = roller.axial_profile.form == "crown"
    patch, patch_load = means.hardest_patch(high)
    random = {key for item in scenario.random for key in item.keys}
    force, friction = (
        {"least_N": low, "greatest_N": high},
        {"friction": scenario.friction.coefficient},
    )
    data: Data = {
        "title": scenario.title,
        "file": scenario.file,
        "roller": {
            "radius_m": roller.radius,
            "crown_radius_m": roller.crown_radius if crowned else None,
            "axial_profile": None if crowned else described_form(roller.axial_profile),
            "width_m": roller.width,
            "edge_radius_m": roller.edge_radius,
            "chamfer_m": roller.chamfer,
            "offset_m": None if "roller.offset" in random else scenario.per_roller(roller.offset),
        },
        "cylinder": {
            "radius_m": cylinder.radius,
            "axial_profile": described_form(cylinder.axial_profile)
            if scenario.axial_gap.has_crowned_cylinder
            else None,
        },
        "cam": _cam(scenario),
        "profile": profile_data(cylinder, scenario.files),
        "contact_modulus_Pa": scenario.pair.contact_modulus,
        "shear_modulus_Pa": scenario.pair.shear_modulus,
        "rolling_speed_m_per_s": scenario.rolling_speed,
        "load": {
            "kind": scenario.load.kind.removesuffix("-arm"),  # as the scenario names it
            **({} if "load.normal_force" in random else force),
            "stiffness_N_per_m": load.stiffness,
            "feedback": getattr(load, "feedback", None),
            "terms": [term.name for term in scenario.load.terms],
        },
        "log": _log(scenario, load),
        **({} if "friction.coefficient" in random else friction),
        "creep_factor": scenario.friction.creep_factor,
        "creepage": _creepage(scenario, random),
        "random": [_random(item, units_of(scenario)) for item in scenario.random],
        "sampling": dict(scenario.sampling) if scenario.random else None,
        "contact_model": described_model(scenario.contact.model, scenario.text),
        "contact_model_summary": scenario.contact.spec.summary,
        "initial_patch": {
            "length_m": 2.0 * patch.a,
            "width_m": 2.0 * patch.b,
            "peak_pressure_Pa": patch.peak_pressure,
            "load_N": patch_load,
        },
    }
    warnings = plausibility_warnings(means)
    if is_run:
        setup = draw(scenario)
        problem, _, stepper = assemble_problem(setup, start_of_run(scenario, setup))
        data["test"] = _test(scenario, problem, stepper)
        if scenario.fatigue is not None:
            data["pitting_without_wear"] = unworn_data(scenario, problem)
        data["forecast"], further = forecast_data(setup.scenario, problem, stepper)
        warnings += further
    else:
        data["strips"] = study_contact(scenario).grid.strips
    return data | {"notes": scenario.notes, "warnings": warnings}


def _cam(scenario: Scenario) -> Data | None:
    """Return the stations of a cam's run, if there is a cam."""
    if (cam := scenario.cam) is None:
        return None
    turn = turn_of(scenario)
    stations, point = turn.stations, turn.at_stations(turn.stations)
    return {
        "base_radius_m": cam.base_radius,
        "follower": cam.follower.kind,
        "groove": cam.groove,
        "stations": {
            "segment": [
                cam.motion.segments[stations.panels[k].segment].name for k in stations.panel
            ],
            "angle_rad": point.angle,
            "weight_rad": stations.weight,
            "rolling_speed_m_per_s": turn.speed * point.kinematics.travel,
            "curvature_per_m": point.kinematics.curvature,
            "normal_force_N": point.normal_force,
        },
    }


def profile_data(cylinder: Cylinder, files: Mapping[str, str]) -> Data | None:
    """Return file, size and sign of the initial profile, if there is any.

    Parameters
    ----------
    cylinder : Cylinder
    files : mapping of str to str
        Content of CSV files by name.
    """
    profile = cylinder.profile
    if profile is None:
        return None
    names = set(column_names(files.get(cylinder.profile_file, "")))
    return {
        "file": cylinder.profile_file,
        "points": len(profile.y),
        "y_m": [profile.y[0], profile.y[-1]],
        "height_m": [profile.height.min(), profile.height.max()],
        "column": "depth" if "depth" in names and not names & {"height", "z"} else "height",
        "filter_m": cylinder.profile_filter,
    }


def _log(scenario: Scenario, load: Load) -> Data | None:
    """Return span, values, gaps and pauses of the log that the load reads."""
    if load.span is None:
        return None
    least, greatest = load.extremes(*load.span)
    return {
        "file": file[1] if (file := load_file(scenario)) else None,
        "span_s": load.span,
        "least_N": least,
        "mean_N": load.mean(*load.span),
        "greatest_N": greatest,
        "gaps_s": load.gaps,
        "pauses_s": load.pauses,
    }


def _creepage(scenario: Scenario, random: set[str]) -> Data:
    """Return the creepages that are not random."""
    creepage = scenario.creepage
    driven = (
        ("bearing_torque", "_N_m", creepage.bearing_torque or 0.0)
        if creepage.drive == "free"
        else ("longitudinal", "", creepage.longitudinal)
    )
    angles = (
        (name, "_rad", scenario.per_roller(getattr(creepage, name))) for name in ("yaw", "tilt")
    )
    return {
        "drive": creepage.drive,
        **{
            name + unit: value
            for name, unit, value in (driven, *angles)
            if f"creepage.{name}" not in random
        },
        "bearing_friction": creepage.bearing_friction,
        "differential_slip": creepage.differential_slip,
    }


def _random(item: RandomInput, units: dict[str, str]) -> Data:
    return {
        "name": item.name,
        "distribution": item.kind,
        "persistence": item.persistence,
        "description": item.describe(),
        "values": [
            {"key": key, "unit": units[key], "mean": mean, "range_90": bounds}
            for key, mean, bounds in zip(item.keys, item.mean, range_90(item), strict=True)
        ],
    }


def _test(scenario: Scenario, problem: WearProblem, stepper: str) -> Data:
    grid, law, counts = problem.grid, scenario.wear, problem.kinematics.multiplicity
    return {
        "rollers": int(counts.sum()),
        "rollers_solved": len(counts),
        "duration_s": scenario.total_time,
        "passes": scenario.total_passes,
        "wear_law": None if law is None else law.law,
        "wear_law_summary": None if law is None else law.spec.summary,
        "strips": grid.strips,
        "strip_width_m": grid.spacing,
        "y_m": [grid.y[0], grid.y[-1]],
        "stepper": stepper,
        "tolerance": scenario.evolution.tolerance,
    }
