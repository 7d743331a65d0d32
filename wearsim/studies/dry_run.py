"""Dry run: description of a run and of the inputs that it reads, in SI units and as a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from wearsim.csv_tables import column_names
from wearsim.mechanics.hertz.elasticity import combine
from wearsim.plugins import Load
from wearsim.scenario import Cylinder, RandomInput, Scenario, described_model
from wearsim.studies.automatic import with_chosen_model
from wearsim.studies.cam.turn import turn_of
from wearsim.studies.contact.single import study_contact
from wearsim.studies.plausibility import plausibility_warnings, range_90
from wearsim.studies.run.assemble import assemble_problem
from wearsim.studies.run.draws import draw, units_of
from wearsim.studies.run.groove import hardest_patch
from wearsim.studies.run.inputs import load_file, load_range
from wearsim.units import in_engineers_unit

TableRows = list[tuple[str, str]]
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
    scenario, load = with_chosen_model(scenario, is_run), scenario.load.build()
    low, high = load_range(scenario, load, scenario.total_time if is_run else 0.0)
    roller, cylinder = scenario.roller, scenario.cylinder
    pair = combine(cylinder.material, roller.material)
    patch, patch_load = hardest_patch(scenario, high)
    random = {key for item in scenario.random for key in item.keys}
    fixed_load = {} if "load.normal_force" in random else {"least_N": low, "greatest_N": high}
    data: Data = {
        "title": scenario.title,
        "file": scenario.file,
        "roller": {
            "radius_m": roller.radius,
            "crown_radius_m": roller.crown_radius,
            "width_m": roller.width,
            "edge_radius_m": roller.edge_radius,
            "chamfer_m": roller.chamfer,
            "offset_m": None if "roller.offset" in random else scenario.per_roller(roller.offset),
        },
        "cylinder": {"radius_m": cylinder.radius},
        "cam": _cam(scenario),
        "profile": profile_data(cylinder, scenario.files),
        "contact_modulus_Pa": pair.contact_modulus,
        "shear_modulus_Pa": pair.shear_modulus,
        "rolling_speed_m_per_s": scenario.rolling_speed,
        "load": {
            "kind": scenario.load.kind.removesuffix("-arm"),  # as the scenario names it
            **fixed_load,
            "stiffness_N_per_m": load.stiffness,
            "feedback": getattr(load, "feedback", None),
            "terms": [term.name for term in scenario.load.terms],
        },
        "log": _log(scenario, load),
        "friction": scenario.friction.coefficient,
        "creepage": _creepage(scenario, random),
        "random": [_random(item, units_of(scenario)) for item in scenario.random],
        "sampling": None,
        "contact_model": described_model(scenario.contact.model, scenario.text),
        "contact_model_summary": scenario.contact.spec.summary,
        "initial_patch": {
            "length_m": 2.0 * patch.a,
            "width_m": 2.0 * patch.b,
            "peak_pressure_Pa": patch.peak_pressure,
            "load_N": patch_load,
        },
    }
    if "friction.coefficient" in random:
        del data["friction"]
    if scenario.random:
        table = scenario.sampling
        data["sampling"] = {
            "plan": table.plan,
            "realisation": table.realisation,
            "correlation": table.correlation,
        }
    if is_run:
        data["test"] = _test(scenario)
    else:
        data["strips"] = study_contact(scenario).grid.strips
    return data | {"notes": scenario.notes, "warnings": plausibility_warnings(scenario)}


def _cam(scenario: Scenario) -> Data | None:
    """Return the stations of a cam's run, if there is a cam."""
    if (cam := scenario.cam) is None:
        return None
    turn = turn_of(scenario)
    stations, motion = turn.stations, cam.motion
    point = turn.at_stations(stations)
    names = [motion.segments[stations.panels[k].segment].name for k in stations.panel]
    return {
        "base_radius_m": cam.base_radius,
        "follower": cam.follower.kind,
        "groove": cam.groove,
        "stations": {
            "segment": names,
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
    driven = ("longitudinal", "", creepage.longitudinal)
    if creepage.drive == "free":
        driven = ("bearing_torque", "_N_m", creepage.bearing_torque or 0.0)
    both = ("yaw", creepage.yaw), ("tilt", creepage.tilt)
    angles = [(name, "_rad", scenario.per_roller(angle)) for name, angle in both]
    known = [item for item in (driven, *angles) if f"creepage.{item[0]}" not in random]
    return {
        "drive": creepage.drive,
        **{name + unit: value for name, unit, value in known},
        "bearing_friction": creepage.bearing_friction,
        "differential_slip": creepage.differential_slip,
    }


def _random(item: RandomInput, units: dict[str, str]) -> Data:
    ranges = range_90(item)
    return {
        "name": item.name,
        "distribution": item.kind,
        "persistence": item.persistence,
        "description": item.describe(),
        "values": [
            {"key": key, "unit": units[key], "mean": mean, "range_90": bounds}
            for key, mean, bounds in zip(item.keys, item.mean, ranges, strict=True)
        ],
    }


def _test(scenario: Scenario) -> Data:
    problem, _, stepper = assemble_problem(draw(scenario))
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


def plan(data: Data) -> TableRows:
    """Return the description from `dry_run` as rows of name and value, in engineering units."""
    roller, patch = data["roller"], data["initial_patch"]
    radii = f"radius {roller['radius_m'] * 1e3:.6g} mm"
    radii += f", crown radius {roller['crown_radius_m'] * 1e3:.6g} mm"
    if roller["width_m"] is not None:
        radii += f", width {roller['width_m'] * 1e3:.6g} mm"
    for key, name in (("edge_radius_m", "edge radius"), ("chamfer_m", "chamfer")):
        if roller[key]:
            radii += f", {name} {roller[key] * 1e3:.6g} mm"
    if any(roller["offset_m"] or ()):
        radii += ", offset " + " / ".join(f"{y * 1e3:.4g}" for y in roller["offset_m"]) + " mm"
    moduli = (
        f"contact modulus {data['contact_modulus_Pa'] / 1e9:.4g} GPa,"
        f" shear modulus {data['shear_modulus_Pa'] / 1e9:.4g} GPa"
    )
    size = (
        f"{1e3 * patch['length_m']:.4g} x {1e3 * patch['width_m']:.4g} mm,"
        f" peak pressure {patch['peak_pressure_Pa'] / 1e6:.4g} MPa at {patch['load_N']:.4g} N"
    )
    return [
        ("roller", radii),
        _body_row(data),
        *profile_rows(data["profile"]),
        ("elasticity", moduli),
        ("rolling speed", _speed_text(data)),
        ("load", _load_text(data["load"])),
        *_log_rows(data["log"]),
        *([("friction", f"{data['friction']:.4g}")] if "friction" in data else []),
        *_creepage_rows(data["creepage"]),
        *_random_rows(data),
        ("contact model", f"{data['contact_model']}: {data['contact_model_summary']}"),
        ("initial patch (Hertz)", size),
        *_test_rows(data),
    ]


def _body_row(data: Data) -> tuple[str, str]:
    """Return the row of the cylinder or the cam."""
    cam = data["cam"]
    if cam is None:
        return "cylinder", f"radius {data['cylinder']['radius_m'] * 1e3:.6g} mm"
    kind = f"{cam['follower']} follower" + (" in a groove" if cam["groove"] else "")
    count, radius = len(cam["stations"]["angle_rad"]), cam["base_radius_m"]
    return "cam", f"base radius {radius * 1e3:.6g} mm, {kind}, {count} stations"


def _speed_text(data: Data) -> str:
    if data["cam"] is None:
        return f"{data['rolling_speed_m_per_s']:.4g} m/s"
    speeds = data["cam"]["stations"]["rolling_speed_m_per_s"]
    return _range((speeds.min(), speeds.max()), "m/s", 1.0)


def station_table(data: Data) -> tuple[list[str], list[list[str]]] | None:
    """Return heads and rows of the table of a cam's stations, in engineering units."""
    stations = (data["cam"] or {}).get("stations")
    if stations is None:
        return None
    heads = ["angle [deg]", "weight [deg]", "V [m/s]", "curvature [1/mm]", "N [N]"]
    sizes = [np.degrees(1.0), np.degrees(1.0), 1.0, 1e-3, 1.0]
    columns = [values * size for values, size in zip([*stations.values()][1:], sizes, strict=True)]
    rows = [[f"{value:.4g}" for value in row] for row in zip(*columns, strict=True)]
    named = [[*row, name] for row, name in zip(rows, stations["segment"], strict=True)]
    return [*heads, "segment"], named


def _range(bounds: Sequence[float], unit: str, size: float) -> str:
    """Return the text of two values in a unit of `size` in SI."""
    low, high = (value + 0.0 for value in bounds)  # no -0
    return f"{low / size:.4g} to {high / size:.4g} {unit}"


def profile_rows(profile: Data | None) -> TableRows:
    """Return a row on a profile, from `profile_data`."""
    if profile is None:
        return []
    text = (
        f"{profile['file']}: {profile['points']} points, y {_range(profile['y_m'], 'mm', 1e-3)},"
        f" height {_range(profile['height_m'], 'um', 1e-6)} (worn is negative"
    )
    text += "; read from the column depth)" if profile["column"] == "depth" else ")"
    if profile["filter_m"] is not None:
        text += f", filtered with {profile['filter_m'] * 1e3:.4g} mm"
    return [("profile", text)]


def _load_text(load: Data) -> str:
    text = f"{load['kind']}"
    if "least_N" in load:
        low, high = load["least_N"], load["greatest_N"]
        text += f", {low:.4g} N" if low == high else f", {low:.4g} to {high:.4g} N"
    if load["stiffness_N_per_m"] > 0.0:
        text += f", less {load['stiffness_N_per_m'] / 1e3:.4g} N/mm of descent"
    if load["feedback"] is not None:
        text += f", feedback {load['feedback']}"
    return text + "".join(f", plus {term}" for term in load["terms"])


def _log_rows(log: Data | None) -> TableRows:
    if log is None:
        return []
    text = (
        f"{log['file']}: {_range(log['span_s'], 'min', 60.0)}, {log['least_N']:.4g} to"
        f" {log['greatest_N']:.4g} N, mean {log['mean_N']:.4g} N"
    )
    for name in ("gap", "pause"):
        spans = log[f"{name}s_s"]
        if len(spans):
            total = float(np.diff(spans, axis=1).sum()) / 60.0
            text += f", {len(spans)} {name}{'s' * (len(spans) > 1)} of {total:.4g} min"
    return [("log", text if len(log["gaps_s"]) else f"{text}, no gaps")]


def _creepage_rows(creepage: Data) -> TableRows:
    words = []
    if "longitudinal" in creepage:
        words.append(f"longitudinal {creepage['longitudinal']:.4g}")
    if creepage["drive"] == "free":
        torque = creepage.get("bearing_torque_N_m")
        words, friction = ["free"], creepage["bearing_friction"]
        if torque or (torque is not None and not friction):
            words.append(f"bearing torque {torque * 1e3:.4g} N mm")
        if friction:
            words.append(f"bearing friction {friction:g}")
    for name in ("yaw", "tilt"):
        angles = creepage.get(f"{name}_rad", ())
        if any(angles):
            words.append(f"{name} " + " / ".join(f"{a * 1e3:.4g}" for a in angles) + " mrad")
    words += ["differential slip"] if creepage["differential_slip"] else []
    return [("creepage", ", ".join(words))] if words else []


def _random_rows(data: Data) -> TableRows:
    """Return a row per random input and, where there are any, one for the sampling."""
    rows = []
    for item in data["random"]:
        ranges = [
            (f"{value['key'].rsplit('.', 1)[1]} " if len(item["values"]) > 1 else "")
            + " to ".join(in_engineers_unit(bound, value["unit"], 4) for bound in value["range_90"])
            for value in item["values"]
        ]
        rows.append(
            (f"random {item['name']}", f"{item['description']}; 90 % range {', '.join(ranges)}")
        )
    table = data["sampling"]
    if table is None:
        return []
    pairs = [f"{first} with {second} {rank:g}" for first, second, rank in table["correlation"]]
    words = [table["plan"], f"realisation {table['realisation']}"]
    words += [f"rank correlation of {', '.join(pairs)}"] if pairs else []
    return [*rows, ("sampling", ", ".join(words))]


def _test_rows(data: Data) -> TableRows:
    if "test" not in data:
        return [("runs as", f"one contact, {data['strips']} strips (no duration or no wear law)")]
    test = data["test"]
    identical = ", all identical" if test["rollers_solved"] == 1 < test["rollers"] else ""
    strips = (
        f"{test['strips']} of {test['strip_width_m'] * 1e3:.4g} mm,"
        f" {_range(test['y_m'], 'mm', 1e-3)}"
    )
    rollers = f"{test['rollers']} ({test['rollers_solved']} solved{identical})"
    duration = in_engineers_unit(test["duration_s"], "s")
    return [
        ("rollers", rollers if test["rollers"] > 1 else "1"),
        ("duration", f"{duration}, {test['passes']:,} roller passes"),
        ("wear law", f"{test['wear_law']} ({test['wear_law_summary']})"),
        ("strips", strips),
        ("stepper", f"{test['stepper']}, tolerance {test['tolerance']:.1e}"),
    ]
