"""View of a cam before wear: numbers of the turn, and motion, loads and contact at stations."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from wearsim.mechanics.cam import extreme, surface_points
from wearsim.report.text import NOTHING, PER_SI, count, count_of, in_unit, shown
from wearsim.report.view import Column, Columns, Frame, Row, Rows, Table, View
from wearsim.scenario import Scenario
from wearsim.studies.cam.checks import harmonic_depth
from wearsim.studies.cam.study import peak_pressures
from wearsim.studies.cam.turn import unchecked_turn_of
from wearsim.studies.fatigue.unworn import lives_at, stresses_below
from wearsim.studies.fatigue.view import source_rows, with_sources
from wearsim.studies.run.setup import Setup
from wearsim.types import FloatArray

if TYPE_CHECKING:
    from wearsim.report.surfaces import Sampling, Surface


#: effects that wear tests of cams neglect, besides those neglected on cylinders
CAM_EXCLUDED = ("vibration of the follower", "uneven wear around the roller")
#: heads of the columns at the stations, names of their values, and units
_TABLE = (
    ("angle [deg]", "angle_rad", "deg"),
    ("lift [mm]", "lift_m", "mm"),
    ("lift [deg]", "lift_rad", "deg"),
    ("pressure angle [deg]", "pressure_angle_rad", "deg"),
    ("V [m/s]", "rolling_speed_m_per_s", "m/s"),
    ("roller/cam", "roller_speed_ratio", "1"),
    ("N [N]", "normal_force_N", "N"),
    ("p0 [MPa]", "peak_pressure_Pa", "MPa"),
    ("creepage", "longitudinal_creepage", "1"),
    ("power [W]", "power_W", "W"),
    ("film [um]", "film_thickness_m", "um"),
    ("pitting [turns]", "pitting_life_turns", "1"),
    ("orthogonal shear [MPa]", "orthogonal_shear_Pa", "MPa"),
    ("at depth [um]", "orthogonal_shear_depth_m", "um"),
    ("von Mises [MPa]", "von_mises_Pa", "MPa"),
    ("at depth [um]", "von_mises_depth_m", "um"),
)
#: titles of the columns of the motion table, names of their values, and units
_MOTION = (
    ("angle", "angle_rad", "deg"),
    ("lift of the arm", "lift_rad", "deg"),
    ("lift", "roller_lift_m", "mm"),
    ("velocity", "velocity_m_per_s", "m/s"),
    ("acceleration", "acceleration_m_per_s2", "m/s^2"),
    ("jerk", "jerk_m_per_s3", "m/s^3"),
    ("pressure angle", "pressure_angle_rad", "deg"),
    ("radius of curvature", "radius_of_curvature_m", "mm"),
    ("normal force", "normal_force_N", "N"),
    ("drive torque", "drive_torque_N_m", "N m"),
    ("rolling speed", "rolling_speed_m_per_s", "m/s"),
    ("peak pressure", "peak_pressure_Pa", "MPa"),
    ("x", "x_m", "mm"),
    ("y", "y_m", "mm"),
    ("film", "film_thickness_m", "um"),
    ("pitting life", "pitting_life_turns", "turns"),
)


class CamView(View):
    """Greatest pressure angle, loads, jump speed and skids of a cam.

    Panels: shape, motion, pressure angle, loads, speeds. The table of pandas has the stations.
    """

    sheet = "wearsim.studies.cam.panels:cam_sheet"
    question = "Which motion, loads and contact does the cam have along its angle?"

    def rows(self) -> Rows:
        """Return the numbers of the turn."""
        study, turn = self.result, self.result.turn

        def place(name: str, label: str, unit: str, value: float, theta: float) -> Row:
            return Row(
                label,
                f"{shown(value, unit)} at {turn.place(theta)}",
                answers={name: (value, unit)},
            )

        def stated(name: str, label: str, value: float | None, unit: str, digits: int = 4) -> Row:
            return Row(label, shown(value, unit, digits), answers={name: (value, unit)})

        least, greatest = turn.normal_range
        p, q = study.winding_ratio
        sweeps = "" if study.sweeps is None else f", {study.sweeps:.4g} sweeps around the roller"
        rows = [
            stated("perimeter", "perimeter", study.perimeter, "mm", 6),
            stated("load_integral", "integral of N ds", study.load_integral, "N m", 6),
            Row(
                "normal force",
                f"{shown(least, 'N')} to {shown(greatest, 'N')}",
                answers={
                    "least_normal_force": (least, "N"),
                    "greatest_normal_force": (greatest, "N"),
                },
            ),
            place("peak_pressure", "greatest pressure", "MPa", *study.max_peak_pressure),
            place("pressure_angle", "greatest pressure angle", "deg", *study.max_pressure_angle),
            place("outer_radius", "outer radius", "mm", *study.max_radius),
            Row(
                "least radius of curvature",
                shown(study.min_radius_of_curvature, "mm"),
                answers={"undercut_margin": (turn.margins["undercut_margin"], "mm")},
            ),
            Row(
                "speed at which the follower jumps",
                shown(study.jump_speed, "rpm"),
                answers={
                    "jump_speed": (
                        math.inf if study.jump_speed is None else study.jump_speed,
                        "rpm",
                    )
                },
            ),
            Row(
                f"harmonic limit at {shown(harmonic_depth(turn), 'um', 2)} of wear",
                shown(study.harmonic_limit, "1", 3),
            ),
            Row(
                "winding number",
                f"{study.winding_number:.6g}, nearest ratio {p}/{q}{sweeps}",
                answers={"winding_number": (study.winding_number, "1")},
            ),
            *self._film_rows(),
        ]
        if turn.free:
            energy = sum(skid.energy for skid in study.skids)
            text = (
                f"{count_of(len(study.skids), 'arc')}, {shown(energy, 'J', 3)} per turn"
                if energy
                else NOTHING
            )
            rows.append(Row("skids of the roller", text, answers={"skid_energy": (energy, "J")}))
        lives = lives_at(turn.scenario, np.array(study.max_peak_pressure[:1]))
        if lives is not None:
            turns = float(lives[0]) / turn.scenario.operation.rollers
            text = count(float(f"{turns:.3g}")) if np.isfinite(turns) else "infinite"
            text += f" turns at {turn.place(study.max_peak_pressure[1])}, which decides"
            rows += [Row("pitting of the cam without wear", text), *source_rows(turn.scenario)]
        if study.weight is not None:
            rows.append(Row("stations", f"{len(study.weight)} of a run"))
        if measured := turn.cam.measured:
            away, unit = np.abs(measured.residual), "um" if measured.unit == "m" else "mrad"
            rms, most, noise = (
                shown(float(size), unit, 3)
                for size in (np.sqrt((away**2).mean()), away.max(), measured.noise)
            )
            where = shown(float(measured.angle[away.argmax()]), "deg")
            rows.append(
                Row(
                    f"residuals of the {measured.quantity}",
                    f"rms {rms}, at most {most} at {where}; noise {noise}",
                )
            )
        return rows

    def _film_rows(self) -> Rows:
        """Return the least film of the turn and its ratio to the roughness, with a lubricant."""
        film, lubricant = self.result.film, self.result.turn.scenario.lubricant
        if film is None or lubricant is None:
            return []
        least = float(film.min())
        answers: dict[str, tuple[float | None, str]] = {"film_thickness": (least, "um")}
        text = shown(least, "um")
        if lubricant.roughness is not None:
            answers["film_ratio"] = (least / lubricant.roughness, "1")
            text += f", {shown(least / lubricant.roughness, '1')} times the roughness"
        return [Row("least film thickness", text, answers=answers)]

    def tables(self) -> list[Table]:
        """Return motion, loads and contact at the stations, in engineering units."""
        values = self._columns()
        shown_columns = [column for column in _TABLE if column[1] in values]
        cells = [
            [in_unit(value, unit) for value in _without_rounding(key, values[key][1])]
            for _, key, unit in shown_columns
        ]
        return [
            Table(
                "",
                [list(row) for row in zip(*cells, self._segment_names(), strict=True)],
                [*(head for head, *_ in shown_columns), "segment"],
            )
        ]

    def _segment_names(self) -> list[str]:
        """Return the name of the segment of each station."""
        study, motion = self.result, self.result.turn.cam.motion
        numbers = motion.segment_at(study.point.angle).tolist()
        if study.weight is not None:
            stations = study.turn.stations
            numbers = [stations.panels[k].segment for k in stations.panel.tolist()]
        return [motion.segments[number].name for number in numbers]

    def _columns(self) -> dict[str, tuple[str, Any]]:
        """Return the values at the stations by their keys: unit and numbers in SI."""
        study, point, turn = self.result, self.result.point, self.result.turn
        kinematics, unit = point.kinematics, turn.cam.lift_unit
        x, y = surface_points(turn.cam.follower, kinematics, point.angle)[1]
        jerk = turn.cam.motion.jerk(point.angle)
        # of the roller's centre along its path
        travel = turn.cam.follower.lever * np.stack(
            [kinematics.lift, kinematics.lift_per_rad, kinematics.lift_per_rad2, jerk]
        )
        with np.errstate(divide="ignore"):
            radius = 1.0 / kinematics.curvature
        columns: dict[str, tuple[str, Any]] = {
            "angle_rad": ("rad", point.angle),
            f"lift_{unit}": (unit, kinematics.lift),
            f"lift_per_rad_{unit}": (unit, kinematics.lift_per_rad),
            f"lift_per_rad2_{unit}": (unit, kinematics.lift_per_rad2),
            f"lift_per_rad3_{unit}": (unit, jerk),
            "roller_lift_m": ("m", travel[0]),
            "velocity_m_per_s": ("m/s", turn.speed * travel[1]),
            "acceleration_m_per_s2": ("m/s^2", turn.speed**2 * travel[2]),
            "jerk_m_per_s3": ("m/s^3", turn.speed**3 * travel[3]),
            "pressure_angle_rad": ("rad", kinematics.pressure_angle),
            "curvature_per_m": ("1/m", kinematics.curvature),
            "radius_of_curvature_m": ("m", radius),
            "x_m": ("m", x),
            "y_m": ("m", y),
            "rolling_speed_m_per_s": ("m/s", turn.speed * kinematics.travel),
            "roller_speed_ratio": ("1", kinematics.spin),
            "normal_force_N": ("N", point.normal_force),
            "peak_pressure_Pa": ("Pa", study.peak_pressure),
            "drive_torque_N_m": ("N m", point.drive_torque),
            "patch_length_m": ("m", study.patch_length),
            "patch_width_m": ("m", study.patch_width),
            "longitudinal_creepage": ("1", study.contacts.longitudinal_creepage),
            "power_W": ("W", study.contacts.power),
            **({} if study.weight is None else {"weight_rad": ("rad", study.weight)}),
        }
        lubricant = turn.scenario.lubricant
        if lubricant is not None and study.film is not None:
            columns["film_thickness_m"] = ("m", study.film)
            if lubricant.roughness is not None:
                columns["film_ratio"] = ("1", study.film / lubricant.roughness)
        if turn.cam.groove:
            columns["inner_flank"] = ("1", point.inner)
        if (lives := lives_at(turn.scenario, study.peak_pressure)) is not None:
            columns["pitting_life_turns"] = "1", lives / turn.scenario.operation.rollers
            columns |= stresses_below(turn.scenario, study.peak_pressure, 0.5 * study.patch_length)
        return columns

    def data(self) -> dict[str, Any]:
        """Return the study in SI units."""
        study, cam = self.result, self.result.turn.cam
        motion, measured = cam.motion, cam.measured
        return {
            "title": self.title,
            "perimeter_m": study.perimeter,
            "load_integral_N_m": study.load_integral,
            "max_radius_m": study.max_radius[0],
            "max_radius_at_rad": study.max_radius[1],
            "max_peak_pressure_Pa": study.max_peak_pressure[0],
            "max_peak_pressure_at_rad": study.max_peak_pressure[1],
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
            **(
                {
                    "smoothing": {
                        "file": measured.file,
                        "quantity": measured.quantity,
                        f"noise_{measured.unit}": measured.noise,
                        "scatter_of_acceleration_per_rad2": measured.scatter,
                        "error_of_acceleration_per_rad2": measured.error,
                        "angle_rad": measured.angle,
                        f"residual_{measured.unit}": measured.residual,
                    }
                }
                if measured
                else {}
            ),
            "stations": {name: values for name, (_, values) in self._columns().items()},
            "warnings": study.warnings,
            "notes": study.notes,
        }

    def columns(self) -> Mapping[str, Columns]:
        """Return the motion table, one row for each station."""
        values = self._columns()
        table = [
            *(
                Column(title, values[key][1], unit, 1.0 / PER_SI[unit])
                for title, key, unit in _MOTION
                if key in values
            ),
            Column("segment", self._segment_names()),
        ]
        return {"motion.csv": [with_sources(table, self.result.turn.scenario)]}

    def surface(self, sampling: Sampling) -> Surface:
        """Return the surface of the cam before wear."""
        from wearsim.studies.cam.surface import unworn_surface  # noqa: PLC0415  (only of files)

        return unworn_surface(self.result.turn, sampling)

    def frame(self) -> Frame:
        """Return the stations, one row each."""
        return Frame(
            [(name, unit, values) for name, (unit, values) in self._columns().items()],
            "station",
            range(len(self.result.point.angle)),
        )


def _without_rounding(key: str, values: FloatArray) -> list[float]:
    """Return values, with 0 for those that are zero to the rounding of the greatest."""
    if key == "pitting_life_turns":  # a high power of the pressure, often infinite
        return [float(value) for value in values]
    size = np.abs(values)
    return [float(value) for value in np.where(size > 1e-11 * size.max(), values, 0.0)]


def loads(scenario: Scenario) -> Rows:
    """Return speed, force, torque and pressure of a cam before wear."""
    turn, setup = unchecked_turn_of(scenario), Setup(scenario)
    least, greatest = turn.normal_range
    pressure, theta = extreme(turn.panels, lambda p, x: peak_pressures(setup, turn.at(p, x)))
    torque, _ = extreme(turn.panels, lambda p, x: np.abs(turn.at(p, x).drive_torque))
    return [
        Row("speed", turn.speed, "rpm"),
        Row("normal force", f"{shown(least, 'N', 3)} to {shown(greatest, 'N', 3)}"),
        Row("peak pressure, new", f"{shown(pressure, 'MPa', 3)} at {turn.place(theta)}"),
        Row("drive torque", f"up to {shown(torque, 'N m', 3)}, without losses"),
    ]
