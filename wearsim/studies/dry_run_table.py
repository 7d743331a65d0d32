"""Table of a dry run in engineering units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from wearsim.report.text import PER_SI, lapse, limit_unit, shown
from wearsim.studies.dry_run import Data
from wearsim.studies.fatigue.unworn import unworn_text
from wearsim.units import in_engineers_unit

TableRows = list[tuple[str, str]]
_RADII = ("radius_m", "crown_radius_m", "width_m", "edge_radius_m", "chamfer_m")
_UNITS = {"_m": ("mm", 1e-3), "_Pa": ("GPa", 1e9), "_rad": ("mrad", 1e-3)}  # by ends of keys


class _Cylinder:
    """Texts on a test of a cylinder, from `dry_run`."""

    name, unit, per_unit = "cylinder", "passes", 1.0

    def __init__(self, data: Data) -> None:
        self.data = data

    def body(self) -> list[str]:
        """Return radius and form."""
        return _fields(self.data["cylinder"], "radius_m", digits=6) + _form(self.data["cylinder"])

    def speed(self) -> str:
        """Return the rolling speed."""
        return f"{self.data['rolling_speed_m_per_s']:.4g} m/s"


class _Cam(_Cylinder):
    """Texts on a test of a cam."""

    name, unit = "cam", "turns"

    def __init__(self, data: Data) -> None:
        super().__init__(data)
        self.cam, self.per_unit = data["cam"], float(data.get("test", {}).get("rollers", 1))

    def body(self) -> list[str]:
        """Return radius, form, follower and number of stations."""
        radius, form = _fields(self.cam, "base_radius_m", digits=6), _form(self.data["cylinder"])
        return [
            *radius,
            *form,
            f"{self.cam['follower']} follower" + (" in a groove" if self.cam["groove"] else ""),
            f"{len(self.cam['stations']['angle_rad'])} stations",
        ]

    def speed(self) -> str:
        """Return the range of the rolling speed."""
        speeds = self.cam["stations"]["rolling_speed_m_per_s"]
        return _range((speeds.min(), speeds.max()), "m/s", 1.0)


def plan(data: Data) -> TableRows:
    """Return the description from `dry_run` as rows of name and value, in engineering units."""
    roller, patch = data["roller"], data["initial_patch"]
    track = _Cylinder(data) if data["cam"] is None else _Cam(data)
    radii = [*_fields(roller, *_RADII, digits=6), *_fields(roller, "offset_m"), *_form(roller)]
    size = (
        f"{1e3 * patch['length_m']:.4g} x {1e3 * patch['width_m']:.4g} mm,"
        f" peak pressure {patch['peak_pressure_Pa'] / 1e6:.4g} MPa at {patch['load_N']:.4g} N"
    )
    return [
        ("roller", ", ".join(radii)),
        (track.name, ", ".join(track.body())),
        *profile_rows(data["profile"]),
        ("elasticity", ", ".join(_fields(data, "contact_modulus_Pa", "shear_modulus_Pa"))),
        ("rolling speed", track.speed()),
        ("load", _load_text(data["load"])),
        *_log_rows(data["log"]),
        *([("friction", f"{data['friction']:.4g}")] if "friction" in data else []),
        *([("creep factor", f"{factor:.4g}")] if (factor := data["creep_factor"]) < 1.0 else []),
        *_creepage_rows(data["creepage"]),
        *_random_rows(data),
        ("contact model", f"{data['contact_model']}: {data['contact_model_summary']}"),
        ("initial patch (Hertz)", size),
        *_test_rows(track),
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
    heads = ["angle [deg]", "weight [deg]", "V [m/s]", "curvature [1/mm]", "N [N]", "segment"]
    sizes = [np.degrees(1.0), np.degrees(1.0), 1.0, 1e-3, 1.0]
    columns = [values * size for values, size in zip([*stations.values()][1:], sizes, strict=True)]
    rows = [[f"{value:.4g}" for value in row] for row in zip(*columns, strict=True)]
    return heads, [[*row, name] for row, name in zip(rows, stations["segment"], strict=True)]


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
        torque: Any = creepage.get("bearing_torque_N_m")
        friction = creepage["bearing_friction"]
        stated = torque or (torque is not None and not friction)
        words = [
            "free",
            *([f"bearing torque {torque * 1e3:.4g} N mm"] if stated else []),
            *([f"bearing friction {friction:g}"] if friction else []),
        ]
    words += _fields(creepage, "yaw_rad", "tilt_rad")
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
    words = [
        table["plan"],
        f"realisation {table['realisation']}",
        *([f"rank correlation of {', '.join(pairs)}"] if pairs else []),
    ]
    return [*rows, ("sampling", ", ".join(words))]


def _test_rows(track: _Cylinder) -> TableRows:
    data = track.data
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
        *_forecast_rows(data["forecast"]),
        *_pitting_rows(track),
        *_limit_rows(track),
    ]


def _pitting_rows(track: _Cylinder) -> TableRows:
    """Return rows on pitting without wear; none of a scenario without fatigue."""
    pitting = track.data.get("pitting_without_wear")
    if pitting is None:
        return []
    names = {"cylinder": track.name, "roller": "rollers"}
    sources = [(f"fatigue of the {names[body]}", text) for body, text in pitting["sources"].items()]
    text = unworn_text(pitting, track.name, track.unit, track.per_unit)
    return [("pitting without wear", text), *sources]


def _rounded(value: float) -> str:
    """Return a number to two digits, without an exponent."""
    return f"{float(f'{value:.2g}'):,.12g}"


def _forecast_rows(forecast: Data) -> TableRows:
    """Return rows on the forecast wear at the end of a run, and on its time, memory and file size.

    Values have two digits: forecast depths are within 12 % of those of the test.
    """
    depths = f"{_rounded(forecast['depth_m'] * 1e6)} um"
    if forecast["roller_depth_m"]:
        depths += f", roller {_rounded(forecast['roller_depth_m'] * 1e6)} um"
    wear = (
        f"depth {depths}, groove {_rounded(forecast['width_m'] * 1e3)} mm wide, peak pressure"
        f" {_rounded(forecast['peak_pressure_Pa'] / 1e6)} MPa, energy"
        f" {_rounded(forecast['dissipated_energy_J'])} J"
    )
    if forecast["lift_error_m"] is not None:
        wear += f", lift error {_rounded(forecast['lift_error_m'] * 1e6)} um"
    if "damage" in forecast:
        wear += f", damage {_rounded(forecast['damage'])}, probability of pitting"
        wear += f" {shown(forecast['pitting'], '%', 2)}"
    time = lapse(float(f"{forecast['wall_time_s']:.2g}"))
    effort = (
        f"{_rounded(forecast['steps'])} steps, {time},"
        f" {_rounded(forecast['memory_bytes'] / 1e6)} MB of memory, file of"
        f" {_rounded(forecast['file_bytes'] / 1e6)} MB (within a factor of 3)"
    )
    return [("forecast", wear), ("takes about", effort)]


def _limit_rows(track: _Cylinder) -> TableRows:
    """Return a row for each limit of [limit], as forecast."""
    rows, test = [], track.data["test"]
    for item in track.data["forecast"]["limits"]:
        unit = limit_unit(item["quantity"])
        size = 1.0 / PER_SI[unit]
        name = f"limit of {item['quantity'].replace('_', ' ')}"
        ratio = f"{_rounded(item['at_end'] / size)} of {item['limit'] / size:.4g}"
        ratio += "" if unit == "1" else f" {unit}"
        text = f"not reached: about {ratio} at the end"
        if item["reached_at_passes"] is not None:
            passes = item["reached_at_passes"]
            seconds = passes / test["passes"] * test["duration_s"]
            when = f"{_rounded(seconds / 60.0)} min"
            length = f"{_rounded(passes / track.per_unit)} {track.unit}"
            text = f"reached after about {length}, {when}: about {ratio} at the end"
        rows.append((name, text))
    return rows
