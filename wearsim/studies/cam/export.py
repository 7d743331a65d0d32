"""Table of the worn cam: its surface before and after wear."""

from __future__ import annotations

import numpy as np

from wearsim.mechanics.cam import Stations, surface_points
from wearsim.studies.cam.turn import CamTurn
from wearsim.studies.run.result import Result
from wearsim.types import FloatArray

_POINTS = 61  # of a panel


def worn_cam(result: Result) -> dict[str, FloatArray]:
    """Return the surface of a cam at the end of a run, by the titles of a table.

    Parameters
    ----------
    result : Result
        Run of a cam.
    """
    turn = CamTurn(result.scenario)
    stations = turn.stations
    deepest = np.asarray(result.raw.history["station_depth"])[-1, :, 0]
    places = 0.5 - 0.5 * np.cos(np.pi * np.arange(_POINTS) / (_POINTS - 1))
    depth = stations.values_between(deepest, places)
    point = turn.at_stations(Stations(stations.panels, (_POINTS,) * len(stations.panels)))
    follower, found = turn.cam.follower, point.kinematics
    fresh = surface_points(follower, found, point.angle)[1]
    worn = surface_points(follower, found, point.angle, depth)[1]
    return {
        "angle [deg]": np.degrees(point.angle),
        "x unworn [mm]": 1e3 * fresh[0],
        "y unworn [mm]": 1e3 * fresh[1],
        "x worn [mm]": 1e3 * worn[0],
        "y worn [mm]": 1e3 * worn[1],
        "depth [um]": 1e6 * depth,
    }
