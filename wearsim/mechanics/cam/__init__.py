"""Cams: motion of the follower, kinematics of the roller on the cam, stations along the angle."""

from wearsim.mechanics.cam.extremes import Extreme, greatest, greatest_value, integral_error
from wearsim.mechanics.cam.follower import Follower, RollerKinematics
from wearsim.mechanics.cam.motion import Motion, Panel, Segment, motion_mistakes
from wearsim.mechanics.cam.outline import angles_by_chord, angles_by_number
from wearsim.mechanics.cam.shapes import (
    Arc,
    Line,
    eccentric_cam,
    shape_motion,
    tangent_cam,
    three_arc_cam,
)
from wearsim.mechanics.cam.skid import Rolling, SkidArc, skid_arcs
from wearsim.mechanics.cam.stations import (
    Quantity,
    Stations,
    choose_stations,
    extreme,
    extremes,
    moved_stations,
)
from wearsim.mechanics.cam.surface import surface_points

__all__ = [
    "Arc",
    "Extreme",
    "Follower",
    "Line",
    "Motion",
    "Panel",
    "Quantity",
    "RollerKinematics",
    "Rolling",
    "Segment",
    "SkidArc",
    "Stations",
    "angles_by_chord",
    "angles_by_number",
    "choose_stations",
    "eccentric_cam",
    "extreme",
    "extremes",
    "greatest",
    "greatest_value",
    "integral_error",
    "motion_mistakes",
    "moved_stations",
    "shape_motion",
    "skid_arcs",
    "surface_points",
    "tangent_cam",
    "three_arc_cam",
]
