"""View of the run of a cam: that of a cylinder, with angles and lift error added."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from wearsim.errors import WearsimError
from wearsim.report.animation import Animation
from wearsim.report.csv_files import computed
from wearsim.report.surfaces import Sampling, Surface
from wearsim.report.text import count, shown, with_error
from wearsim.report.view import Column, Columns, Row, Rows
from wearsim.studies.cam.drawing import turning
from wearsim.studies.cam.grooves import along_angle
from wearsim.studies.cam.observables import CURVE_ANGLES
from wearsim.studies.cam.surface import worn_surface
from wearsim.studies.cam.turn import unchecked_turn_of
from wearsim.studies.cam.view import CAM_EXCLUDED, loads
from wearsim.studies.run.result import Result
from wearsim.studies.run.view import RunView


class CamRunView(RunView):
    """End state of the run of a cam, with angles and lift error.

    Panels besides those of a cylinder: map of the depth, worn shape, lift error. Files: also the
    worn surface, and depth and lift error along the angle.
    """

    sheet = "wearsim.studies.cam.panels:cam_run_sheet"
    body, unit, excluded, has_angles = "cam", "turns", CAM_EXCLUDED, True

    def __init__(self, result: Result) -> None:
        self.per_unit = result.raw.kinematics["physical_rollers"]
        super().__init__(result)

    def along_angle(self) -> Rows:
        """Return rows on turns, angles and lift error."""
        final = self.result.final

        def stated(name: str, unit: str, key: str) -> str:
            error = float(np.max(final[f"{name}_error_{key}"]))
            if unit == "deg" and error >= 0.5 * math.pi:  # the angle is unknown
                return "not determined"
            return with_error(np.asarray(final[f"{name}_{key}"]), error, unit)

        arm, greatest = self._arm_length(), float(np.max(final["lift_error_m"]))
        of_arm = f", {shown(greatest / arm, 'deg', 3)} of the arm" if arm else ""
        return [
            Row("turns of the cam", count(float(np.max(final["turns"])))),
            Row("angle of the depth", stated("depth_angle", "deg", "rad")),
            Row("angle of the peak pressure", stated("peak_pressure_angle", "deg", "rad")),
            Row(
                "lift error, peak to peak",
                stated("lift_error", "um", "m") + of_arm,
                answers={"lift_error": (greatest, "um")},
            ),
            Row("angle of the least wear of the lift", stated("least_wear_angle", "deg", "rad")),
            Row(
                "angle of the greatest wear of the lift",
                stated("greatest_wear_angle", "deg", "rad"),
            ),
        ]

    def data(self) -> dict[str, Any]:
        """Return the end state in SI units, with the lift error of an arm as an angle [rad]."""
        final, arm = self.result.final, self._arm_length()
        names = ("lift_error", "station_lift_error", "station_lift_error_from_dwell")
        return {
            **super().data(),
            **{f"{n}_rad": (np.asarray(final[f"{n}_m"]) / arm).tolist() for n in names if arm},
        }

    def loads(self) -> Rows:
        """Return the loads of the cam."""
        return loads(self.result.scenario)

    def columns(self) -> Mapping[str, Columns]:
        """Return history, records, the worn surface, and depth and lift error over the angle."""
        return {
            **super().columns(),
            "worn_cam.csv": [self.surface(Sampling()).columns],
            "along_angle.csv": [self._along_angle()],
        }

    def angles(self) -> Sequence[str]:
        """Return the angles of the stations in words.

        Where a part of the turn ends, another begins at the same angle.
        """
        degrees = [f"{angle:.6g} deg" for angle in np.degrees(self.result.values("station_angle"))]
        return [
            f"before {this_angle}" if this_angle == next_angle else f"at {this_angle}"
            for this_angle, next_angle in zip(degrees, [*degrees[1:], ""], strict=True)
        ]

    def _along_angle(self) -> list[Column]:
        """Return angle, depth and lift error at every record, of an arm also its angle."""
        depth, lift_error = along_angle(self.result)
        lever = self._arm_length()
        quantities = {
            "depth": (depth, "m"),
            "lift error": (lift_error, "m"),
            **({"lift error of the arm": (lift_error / lever, "rad")} if lever else {}),
        }
        return [
            computed("angle", CURVE_ANGLES, "rad"),
            *(
                computed(f"{name} at {passes:.12g} passes", column, unit)
                for name, (values, unit) in quantities.items()
                for passes, column in zip(self.result.record_passes, values.T, strict=True)
            ),
        ]

    def _arm_length(self) -> float | None:
        """Return the length of the arm [m]; None of another follower."""
        try:
            follower = unchecked_turn_of(self.result.scenario).cam.follower
        except WearsimError:  # a plugin of the scenario is not installed
            return None
        return follower.arm_length if follower.swings else None

    def surface(self, sampling: Sampling) -> Surface:
        """Return the surface of the cam, unworn and worn."""
        return worn_surface(self.result, sampling)

    def animation(self) -> Animation:
        """Return the turn of the worn cam with its follower."""
        return turning(self.result)
