"""Worn profiles of a cam at angles, and changes of its lift, from the states of wear tests."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from wearsim.evolution.observables import lift_errors
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.scenario import Scenario
from wearsim.studies.cam.observables import CURVE_ANGLES
from wearsim.studies.cam.turn import turn_of
from wearsim.types import FloatArray

LIFT = "lift"


@dataclass(frozen=True)
class Wanted:
    """Size of a groove, or of a change of the lift, that wear tests must cover.

    Parameters
    ----------
    surface : str
        "roller", "lift", or a name of the cam's surface at an angle.
    passes : float
        At which it was measured.
    low, high : float
        Least and greatest depth, or peak to peak of the lift [m].
    """

    surface: str
    passes: float
    low: float
    high: float


class CylinderView:
    """Worn profile of one test's cylinder, as `CamView` has those of a cam."""

    def profiles(self, depth: FloatArray, _fall: FloatArray) -> dict[str, FloatArray]:
        """Return the worn profile from that of the station [m]."""
        return {"cylinder": depth[0]}


@dataclass(frozen=True)
class CamView(CylinderView):
    """Interpolation between the stations of one test's cam.

    Parameters
    ----------
    angles : mapping of str to float
        Angle of the cam of each surface [rad].
    at_angles : ndarray, shape (angles, stations)
    along : ndarray, shape (curve angles, stations)
        At `CURVE_ANGLES`.
    """

    angles: Mapping[str, float]
    at_angles: FloatArray
    along: FloatArray

    @classmethod
    def of(cls, scenario: Scenario, angles: Mapping[str, float]) -> CamView:
        """Return the interpolation for the stations of a scenario's run."""
        stations = turn_of(scenario).stations
        eye = np.eye(stations.count)
        turned = np.mod(list(angles.values()), 2.0 * np.pi)
        rows = [stations.values_at_angles(eye, np.array([angle]))[0] for angle in turned]
        at_angles = np.array(rows).reshape(len(rows), stations.count)
        return cls(angles, at_angles, stations.values_at_angles(eye, CURVE_ANGLES))

    def profiles(self, depth: FloatArray, fall: FloatArray) -> dict[str, FloatArray]:
        """Return the worn profile of each surface, and the fall of the lift over the angle [m].

        Parameters
        ----------
        depth : ndarray, shape (stations, strips)
        fall : ndarray, shape (stations,)
        """
        depths = np.maximum(self.at_angles @ depth, 0.0)
        return {**dict(zip(self.angles, depths, strict=True)), LIFT: self.along @ fall}


def view_of(scenario: Scenario, angles: Mapping[str, float]) -> CylinderView:
    """Return the view of a scenario's test; angles as of `CamView`."""
    return CylinderView() if scenario.cam is None else CamView.of(scenario, angles)


def falls_of_lift(problem: WearProblem, state: WearState) -> FloatArray:
    """Return how far the lift has fallen by wear, shape (stations of the unworn cam, tests) [m].

    It is the mean over the rollers.
    """
    return -problem.kinematics.track.at_unworn(lift_errors(problem, state).mean(axis=1))


def size_of(surface: str, profiles: FloatArray) -> FloatArray:
    """Return the depth of grooves, or the peak to peak of changes of the lift, last axis."""
    greatest = profiles.max(axis=-1)
    return np.asarray(greatest - profiles.min(axis=-1) if surface == LIFT else greatest)
