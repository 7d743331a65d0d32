"""Verb cam: motion, loads and fresh contact of a cam along its angle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from wearsim.cli.shared import (
    Figure,
    Force,
    Json,
    ScenarioFile,
    Settings,
    check_figure,
    checking,
    note,
    read_scenario,
    write_json,
    write_list,
    write_notes,
    write_table,
)

if TYPE_CHECKING:
    from wearsim.studies.cam.study import CamStudy
    from wearsim.types import FloatArray

AtAngles = Annotated[
    str | None,
    typer.Option(
        "--at",
        metavar="ANGLES",
        help="Angles of the cam instead of the stations of a run: '10 deg,80 deg'.",
        show_default=False,
    ),
]


def cam(
    scenario: ScenarioFile,
    at: AtAngles = None,
    settings: Settings = None,
    figure: Figure = None,
    json: Json = False,
    force: Force = False,
) -> None:
    """Show motion, loads and fresh contact of a cam along its angle."""
    check_figure(figure, force)
    loaded = read_scenario(scenario, settings)
    import numpy as np

    from wearsim.cli.progress import Display
    from wearsim.quantities import quantity
    from wearsim.results import refuse_inputs
    from wearsim.studies.cam.study import study_cam
    from wearsim.studies.kernels import kernels_of

    if figure is not None:
        refuse_inputs(figure, loaded.paths)
    angles = None
    if at is not None:
        with checking("--at"):
            angles = np.array([quantity(text, "rad") for text in at.split(",")])
    with Display(quiet=False, kernels=lambda: kernels_of(loaded, "contacts"), transient=True):
        study = study_cam(loaded, angles)
    if json:
        write_json({**_data(study), "notes": study.notes, "figure": figure})
    else:
        write_table(loaded.title, _summary(study))
        write_list(*_stations_table(study))
    if figure is not None:
        from wearsim.report.figures.cam import cam_figure
        from wearsim.report.parts import save_figure

        save_figure(cam_figure(study, loaded.title), figure)
    if not json:
        write_notes(study.notes, study.warnings)
        if figure:
            note(f"figure: {figure}")


def _columns(study: CamStudy) -> dict[str, Any]:
    """Return the values at the stations by their keys, in SI units."""
    point, unit = study.point, study.turn.cam.lift_unit
    found = point.kinematics
    columns: dict[str, Any] = {
        "angle_rad": point.angle,
        f"lift_{unit}": found.lift,
        f"lift_per_rad_{unit}": found.lift_per_rad,
        f"lift_per_rad2_{unit}": found.lift_per_rad2,
        "pressure_angle_rad": found.pressure_angle,
        "curvature_per_m": found.curvature,
        "rolling_speed_m_per_s": study.turn.speed * found.travel,
        "roller_speed_ratio": found.spin,
        "normal_force_N": point.normal_force,
        "peak_pressure_Pa": study.peak_pressure,
        "drive_torque_N_m": point.drive_torque,
        "patch_length_m": study.patch_length,
        "patch_width_m": study.patch_width,
        "longitudinal_creepage": study.contacts.longitudinal_creepage,
        "power_W": study.contacts.power,
    }
    if study.weight is not None:
        columns["weight_rad"] = study.weight
    lubricant = study.turn.scenario.lubricant
    if lubricant is not None and study.film is not None:
        columns["film_thickness_m"] = study.film
        if lubricant.roughness is not None:
            columns["film_ratio"] = study.film / lubricant.roughness
    if study.turn.cam.groove:
        columns["inner_flank"] = point.inner
    return columns


def _data(study: CamStudy) -> dict[str, Any]:
    """Return the study in SI units."""
    from wearsim.studies.cam.checks import harmonic_depth

    motion, measured = study.turn.cam.motion, study.turn.cam.measured
    smoothing = {}
    if measured is not None:
        unit = measured.unit
        smoothing["smoothing"] = {
            "file": measured.file,
            "quantity": measured.quantity,
            f"noise_{unit}": measured.noise,
            "scatter_of_acceleration_per_rad2": measured.scatter,
            "error_of_acceleration_per_rad2": measured.error,
            "angle_rad": measured.angle,
            f"residual_{unit}": measured.residual,
        }
    return {
        "title": study.turn.scenario.title,
        "perimeter_m": study.perimeter,
        "load_integral_N_m": study.load_integral,
        "max_pressure_angle_rad": study.max_pressure_angle[0],
        "max_pressure_angle_at_rad": study.max_pressure_angle[1],
        "min_radius_of_curvature_m": study.min_radius_of_curvature,
        "harmonic_limit": study.harmonic_limit,
        "harmonic_limit_depth_m": harmonic_depth(study.turn),
        "jump_speed_rad_per_s": study.jump_speed,
        "winding_number": study.winding_number,
        "winding_ratio": study.winding_ratio,
        "sweeps": study.sweeps,
        "segments": [
            {"name": part.name, "start_rad": float(start), "angle_rad": part.angle}
            for part, start in zip(motion.segments, motion.starts, strict=False)
        ],
        "skids": [
            {"start_rad": skid.start, "stop_rad": skid.stop, "energy_J": skid.energy}
            for skid in study.skids
        ],
        **smoothing,
        "stations": _columns(study),
        "warnings": study.warnings,
    }


def _summary(study: CamStudy) -> list[tuple[str, str]]:
    """Return the numbers of the turn in engineering units."""
    import numpy as np

    from wearsim.report.text import NOTHING, shown
    from wearsim.studies.cam.checks import harmonic_depth

    turn, (angle, theta) = study.turn, study.max_pressure_angle
    least, greatest = turn.normal_range
    depth = shown(harmonic_depth(turn), "um", 2)
    p, q = study.winding_ratio
    sweeps = "" if study.sweeps is None else f", {study.sweeps:.4g} sweeps around the roller"
    skids = sum(skid.energy for skid in study.skids)
    rows = [
        ("perimeter", shown(study.perimeter, "mm", 6)),
        ("integral of N ds", shown(study.load_integral, "N m", 6)),
        ("normal force", f"{shown(least, 'N')} to {shown(greatest, 'N')}"),
        ("greatest pressure angle", f"{shown(angle, 'deg')} at {turn.place(theta)}"),
        ("least radius of curvature", shown(study.min_radius_of_curvature, "mm")),
        ("speed at which the follower jumps", shown(study.jump_speed, "rpm")),
        (f"harmonic limit at {depth} of wear", shown(study.harmonic_limit, "1", 3)),
        ("winding number", f"{study.winding_number:.6g}, nearest ratio {p}/{q}{sweeps}"),
    ]
    if turn.free:
        arcs = f"{len(study.skids)} arc{'s' * (len(study.skids) > 1)}"
        text = f"{arcs}, {shown(skids, 'J', 3)} per turn" if skids else NOTHING
        rows.append(("skids of the roller", text))
    if study.weight is not None:
        rows.append(("stations", f"{len(study.weight)} of a run"))
    if measured := turn.cam.measured:
        away, unit = np.abs(measured.residual), "um" if measured.unit == "m" else "mrad"
        rms = shown(float(np.sqrt((away**2).mean())), unit, 3)
        most, noise = shown(float(away.max()), unit, 3), shown(measured.noise, unit, 3)
        place = shown(float(measured.angle[away.argmax()]), "deg")
        words = f"rms {rms}, at most {most} at {place}; noise {noise}"
        rows.append((f"residuals of the {measured.quantity}", words))
    return rows


def _stations_table(study: CamStudy) -> tuple[list[str], list[list[str]]]:
    """Return heads and rows of the table of stations, in engineering units."""
    from wearsim.report.text import in_unit

    point, swings = study.point, study.turn.cam.follower.swings
    found, lift = point.kinematics, "deg" if swings else "mm"
    columns = [
        ("angle [deg]", point.angle, "deg"),
        (f"lift [{lift}]", found.lift, lift),
        ("pressure angle [deg]", found.pressure_angle, "deg"),
        ("V [m/s]", study.turn.speed * found.travel, "m/s"),
        ("roller/cam", found.spin, "1"),
        ("N [N]", point.normal_force, "N"),
        ("p0 [MPa]", study.peak_pressure, "MPa"),
        ("creepage", study.contacts.longitudinal_creepage, "1"),
        ("power [W]", study.contacts.power, "W"),
    ]
    if study.film is not None:
        columns.append(("film [um]", study.film, "um"))
    cells = [[in_unit(v, unit) for v in _without_rounding(values)] for _, values, unit in columns]
    rows, segments = zip(*cells, strict=True), study.turn.cam.motion.segments
    names = [segments[k].name for k in _segments(study)]
    return (
        [*(head for head, *_ in columns), "segment"],
        [[*row, name] for row, name in zip(rows, names, strict=True)],
    )


def _without_rounding(values: FloatArray) -> list[float]:
    """Return values, with 0 for those that are zero to the rounding of the greatest."""
    import numpy as np

    size = np.abs(values)
    return [float(v) for v in np.where(size > 1e-11 * size.max(), values, 0.0)]


def _segments(study: CamStudy) -> list[int]:
    """Return the number of the segment of each station."""
    if study.weight is None:
        return [int(k) for k in study.turn.cam.motion.segment_at(study.point.angle)]
    stations = study.turn.stations
    return [stations.panels[k].segment for k in stations.panel.tolist()]
