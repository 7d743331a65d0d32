"""What a page shows first of a cam: its picture before wear, and its loads."""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.cam import extreme
from wearsim.report.panels import Panel
from wearsim.report.text import shown
from wearsim.report.view import Row, Rows
from wearsim.scenario import Scenario
from wearsim.studies.cam.study import peak_pressures
from wearsim.studies.cam.turn import CamTurn

#: what wear tests of cams do not contain, beside what is not in those of cylinders
CAM_EXCLUDED = ("vibration of the follower", "uneven wear around the roller")


def loads(scenario: Scenario) -> Rows:
    """Return speed, force, torque and pressure of a cam before wear."""
    turn = CamTurn(scenario)
    least, greatest = turn.normal_range
    pressure, theta = extreme(turn.panels, lambda p, x: peak_pressures(scenario, turn.at(p, x)))
    torque, _ = extreme(turn.panels, lambda p, x: np.abs(turn.at(p, x).drive_torque))
    return [
        Row("speed", turn.speed, "rpm"),
        Row("normal force", f"{shown(least, 'N', 3)} to {shown(greatest, 'N', 3)}"),
        Row("peak pressure, new", f"{shown(pressure, 'MPa', 3)} at {turn.place(theta)}"),
        Row("drive torque", f"up to {shown(torque, 'N m', 3)}, without losses"),
    ]


def picture(scenario: Scenario) -> Panel:
    """Return the cam before wear with its follower."""
    from wearsim.studies.cam.panels import shape_panel  # noqa: PLC0415  (only of pages)

    return shape_panel(CamTurn(scenario))
