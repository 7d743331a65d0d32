"""Table of a dry run in engineering units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from wearsim.report.text import PER_SI, lapse, limit_unit, shown, with_unit
from wearsim.studies.dry_run import Data
from wearsim.studies.fatigue.unworn import unworn_text
from wearsim.units import in_engineers_unit

TableRows = list[tuple[str, str]]
_RADII = ("radius_m", "crown_radius_m", "width_m", "edge_radius_m", "chamfer_m")
_UNITS = {"_m": ("mm", 1e-3), "_Pa": ("GPa", 1e9), "_rad": ("mrad", 1e-3)}  # by ends of keys


class _Track(NamedTuple):
    """Texts on the body with the track: its name, unit of its life, form, and rolling speed."""

    name: str
    unit: str
    per_unit: float
    body: list[str]
    speed: str


def _track(data: Data) -> _Track:
    """Return the texts on a cylinder or a cam, from `dry_run`."""
    cylinder, cam = data["cylinder"], data["cam"]
    if cam is None:
        return _Track(
            "cylinder",
            "passes",
            1.0,
            [*_fields(cylinder, "radius_m", digits=6), *_form(cylinder)],
            f"{data['rolling_speed_m_per_s']:.4g} m/s",
        )
    speeds = cam["stations"]["rolling_speed_m_per_s"]
    return _Track(
        "cam",
        "turns",
        float(data.get("test", {}).get("rollers", 1)),
        [
            *_fields(cam, "base_radius_m", digits=6),
            *_form(cylinder),
            f"{cam['follower']} follower" + (" in a groove" if cam["groove"] else ""),
            f"{len(cam['stations']['angle_rad'])} stations",
        ],
        _range((speeds.min(), speeds.max()), "m/s", 1.0),
    )


def plan(data: Data) -> TableRows:
    """Return the description from `dry_run` as rows of name and value, in engineering units."""
    roller, patch, track = data["roller"], data["initial_patch"], _track(data)
    radii = [*_fields(roller, *_RADII, digits=6), *_fields(roller, "offset_m"), *_form(roller)]
    size = (
        f"{1e3 * patch['length_m']:.4g} x {1e3 * patch['width_m']:.4g} mm,"
        f" peak pressure {patch['peak_pressure_Pa'] / 1e6:.4g} MPa at {patch['load_N']:.4g} N"
    )
    return [
        ("roller", ", ".join(radii)),
        (track.name, ", ".join(track.body)),
        *profile_rows(data["profile"]),
        ("elasticity", ", ".join(_fields(data, "contact_modulus_Pa", "shear_modulus_Pa"))),
        ("rolling speed", track.speed),
        ("load", _load_text(data["load"])),
        *_log_rows(data["log"]),
        *([("friction", f"{data['friction']:.4g}")] if "friction" in data else []),
        *([("creep factor", f"{factor:.4g}")] if (factor := data["creep_factor"]) < 1.0 else []),
        *_creepage_rows(data["creepage"]),
        *_random_rows(data),
        ("contact model", f"{data['contact_model']}: {data['contact_model_summary']}"),
        ("initial patch (Hertz)", size),
        *_test_rows(data, track),
    ]


def _fields(data: Data, *keys: str, digits: int = 4) -> list[str]:
    """Return fields with the names and units that their keys state, "crown radius 400 mm".

    Fields that are not given or zero are left out; of values per roller each is stated.
    """
    texts = []
    for key in keys:
        ending = key[key.rindex("_") :]
        unit, size = _UNITS[ending]
        values = np.ravel(data.get(key) or 0.0)
        if values.any():
            numbers = " / ".join(f"{value / size:.{digits}g}" for value in values)
            texts.append(f"{key.removesuffix(ending).replace('_', ' ')} {numbers} {unit}")
    return texts


def _form(body: Data) -> list[str]:
    """Return the form along the axis of a body whose crown radius does not say it."""
    return [f"axial profile {body['axial_profile']}"] if body["axial_profile"] else []


def station_table(stations: Data) -> tuple[list[str], list[list[str]]]:
    """Return heads and rows of the table of a cam's stations, in engineering units."""
    names, *columns = stations.values()
    sizes = [np.degrees(1.0), np.degrees(1.0), 1.0, 1e-3, 1.0]
    shown_columns = [
        [f"{value:.4g}" for value in values * size]
        for values, size in zip(columns, sizes, strict=True)
    ]
    heads = ["angle [deg]", "weight [deg]", "V [m/s]", "curvature [1/mm]", "N [N]", "segment"]
    return heads, [list(row) for row in zip(*shown_columns, names, strict=True)]


def _range(bounds: Sequence[float], unit: str, size: float) -> str:
    """Return the text of two values in a unit of `size` in SI."""
    low, high = (value + 0.0 for value in bounds)  # no -0
    return f"{low / size:.4g} to {high / size:.4g} {unit}"


def profile_rows(profile: Data | None) -> TableRows:
    """Return a row on a profile, from `profile_data`."""
    if profile is None:
        return []
    column = "; read from the column depth" if profile["column"] == "depth" else ""
    text = (
        f"{profile['file']}: {profile['points']} points, y {_range(profile['y_m'], 'mm', 1e-3)},"
        f" height {_range(profile['height_m'], 'um', 1e-6)} (worn is negative{column})"
    )
    if profile["filter_m"] is not None:
        text += f", filtered with {profile['filter_m'] * 1e3:.4g} mm"
    return [("profile", text)]


def _load_text(load: Data) -> str:
    low, high = load.get("least_N", 0.0), load.get("greatest_N", 0.0)
    force = f"{low:.4g} N" if low == high else f"{low:.4g} to {high:.4g} N"
    stiffness, feedback = load["stiffness_N_per_m"] / 1e3, load["feedback"]
    return ", ".join(
        [
            load["kind"],
            *([force] if "least_N" in load else []),
            *([f"less {stiffness:.4g} N/mm of descent"] if stiffness > 0.0 else []),
            *([f"feedback {feedback}"] if feedback is not None else []),
            *(f"plus {term}" for term in load["terms"]),
        ]
    )


def _log_rows(log: Data | None) -> TableRows:
    if log is None:
        return []
    parts = [
        f"{log['file']}: {_range(log['span_s'], 'min', 60.0)}",
        f"{log['least_N']:.4g} to {log['greatest_N']:.4g} N",
        f"mean {log['mean_N']:.4g} N",
        *(
            f"{len(spans)} {name}{'s' * (len(spans) > 1)} of"
            f" {float(np.diff(spans, axis=1).sum()) / 60.0:.4g} min"
            for name, spans in (("gap", log["gaps_s"]), ("pause", log["pauses_s"]))
            if len(spans)
        ),
        *([] if len(log["gaps_s"]) else ["no gaps"]),
    ]
    return [("log", ", ".join(parts))]


def _creepage_rows(creepage: Data) -> TableRows:
    if creepage["drive"] == "free":
        torque: Any = creepage.get("bearing_torque_N_m")
        friction = creepage["bearing_friction"]
        stated = torque or (torque is not None and not friction)
        drive = [
            "free",
            *([f"bearing torque {torque * 1e3:.4g} N mm"] if stated else []),
            *([f"bearing friction {friction:g}"] if friction else []),
        ]
    else:
        along = creepage.get("longitudinal")
        drive = [] if along is None else [f"longitudinal {along:.4g}"]
    words = [
        *drive,
        *_fields(creepage, "yaw_rad", "tilt_rad"),
        *(["differential slip"] if creepage["differential_slip"] else []),
    ]
    return [("creepage", ", ".join(words))] if words else []


def _random_rows(data: Data) -> TableRows:
    """Return a row per random input and, where there are any, one for the sampling."""
    rows, table = [], data["sampling"]
    if table is None:
        return []
    for item in data["random"]:
        ranges = [
            (f"{value['key'].rsplit('.', 1)[1]} " if len(item["values"]) > 1 else "")
            + " to ".join(in_engineers_unit(bound, value["unit"], 4) for bound in value["range_90"])
            for value in item["values"]
        ]
        rows.append(
            (f"random {item['name']}", f"{item['description']}; 90 % range {', '.join(ranges)}")
        )
    pairs = [f"{first} with {second} {rank:g}" for first, second, rank in table["correlation"]]
    words = [
        table["plan"],
        f"realisation {table['realisation']}",
        *([f"rank correlation of {', '.join(pairs)}"] if pairs else []),
    ]
    return [*rows, ("sampling", ", ".join(words))]


def _test_rows(data: Data, track: _Track) -> TableRows:
    if "test" not in data:
        return [("runs as", f"one contact, {data['strips']} strips (no duration or no wear law)")]
    test = data["test"]
    identical = ", all identical" if test["rollers_solved"] == 1 < test["rollers"] else ""
    rollers = f"{test['rollers']} ({test['rollers_solved']} solved{identical})"
    duration = in_engineers_unit(test["duration_s"], "s")
    strips = f"{test['strips']} of {test['strip_width_m'] * 1e3:.4g} mm"
    return [
        ("rollers", rollers if test["rollers"] > 1 else "1"),
        ("duration", f"{duration}, {test['passes']:,} roller passes"),
        ("wear law", f"{test['wear_law']} ({test['wear_law_summary']})"),
        ("strips", f"{strips}, {_range(test['y_m'], 'mm', 1e-3)}"),
        ("stepper", f"{test['stepper']}, tolerance {test['tolerance']:.1e}"),
        *_forecast_rows(data["forecast"]),
        *_pitting_rows(data.get("pitting_without_wear"), track),
        *(_limit_row(item, test, track) for item in data["forecast"]["limits"]),
    ]


def _pitting_rows(pitting: Data | None, track: _Track) -> TableRows:
    """Return rows on pitting without wear; none of a scenario without fatigue."""
    if pitting is None:
        return []
    names = {"cylinder": track.name, "roller": "rollers"}
    return [
        ("pitting without wear", unworn_text(pitting, track.name, track.unit, track.per_unit)),
        *((f"fatigue of the {names[body]}", source) for body, source in pitting["sources"].items()),
    ]


def _rounded(value: float) -> str:
    """Return a number to two digits, without an exponent."""
    return f"{float(f'{value:.2g}'):,.12g}"


def _forecast_rows(forecast: Data) -> TableRows:
    """Return rows on the forecast wear at the end of a run, and on its time, memory and file size.

    Values have two digits: forecast depths are within 12 % of those of the test.
    """
    roller, lift_error = forecast["roller_depth_m"], forecast["lift_error_m"]
    wear = [
        f"depth {_rounded(forecast['depth_m'] * 1e6)} um",
        *([f"roller {_rounded(roller * 1e6)} um"] if roller else []),
        f"groove {_rounded(forecast['width_m'] * 1e3)} mm wide",
        f"peak pressure {_rounded(forecast['peak_pressure_Pa'] / 1e6)} MPa",
        f"energy {_rounded(forecast['dissipated_energy_J'])} J",
        *([f"lift error {_rounded(lift_error * 1e6)} um"] if lift_error is not None else []),
    ]
    if "damage" in forecast:
        chance = shown(forecast["pitting"], "%", 2)
        wear += [f"damage {_rounded(forecast['damage'])}", f"probability of pitting {chance}"]
    effort = [
        f"{_rounded(forecast['steps'])} steps",
        lapse(float(f"{forecast['wall_time_s']:.2g}")),
        f"{_rounded(forecast['memory_bytes'] / 1e6)} MB of memory",
        f"file of {_rounded(forecast['file_bytes'] / 1e6)} MB (within a factor of 3)",
    ]
    return [("forecast", ", ".join(wear)), ("takes about", ", ".join(effort))]


def _limit_row(item: Data, test: Data, track: _Track) -> tuple[str, str]:
    """Return the row of a limit of [limit], as forecast."""
    unit, passes = limit_unit(item["quantity"]), item["reached_at_passes"]
    size = 1.0 / PER_SI[unit]
    ratio = with_unit(f"{_rounded(item['at_end'] / size)} of {item['limit'] / size:.4g}", unit)
    text = "not reached"
    if passes is not None:
        seconds = passes / test["passes"] * test["duration_s"]
        when = f"{_rounded(passes / track.per_unit)} {track.unit}, {_rounded(seconds / 60.0)} min"
        text = f"reached after about {when}"
    return f"limit of {item['quantity'].replace('_', ' ')}", f"{text}: about {ratio} at the end"
