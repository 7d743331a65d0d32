"""Observables of a worn track: of a cam extremes over the angle and their angles, and curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from wearsim.evolution.observables import (
    extremes,
    lift_errors,
    peak_to_peak,
    volume_error_by_stations,
)
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.quantities import CamStations
from wearsim.evolution.state import WearState
from wearsim.scenario import Scenario
from wearsim.studies.cam.turn import turn_of
from wearsim.types import FloatArray

CURVE_ANGLES = np.linspace(0.0, 2.0 * np.pi, 361)  # rad, of the lift error of an ensemble


@dataclass(frozen=True)
class CylinderObservables:
    """Observables that depend on the track of a test: of a cylinder the worn profile alone.

    Parameters
    ----------
    problem : WearProblem
    """

    problem: WearProblem

    def columns(self) -> dict[str, FloatArray]:
        """Return the columns of the stations in the results file."""
        return {}

    def history(self, _state: WearState) -> dict[str, FloatArray]:
        """Return the further observables after a step."""
        return {}

    def record(self, _state: WearState) -> dict[str, FloatArray]:
        """Return the further variables of a record."""
        return {}

    def of_ensemble(
        self, _state: WearState, _row: Mapping[str, FloatArray]
    ) -> dict[str, FloatArray]:
        """Return the further observables of an ensemble, shape (realisations,).

        Parameters
        ----------
        state : WearState
        row : mapping of str to ndarray
            Observables of the run, those of `history` among them.
        """
        return {}

    def curves(self, state: WearState, _scenarios: Sequence[Scenario]) -> list[dict[str, Any]]:
        """Return the curves of `RunObservations` of every realisation, by scenario of each."""
        return [{"depth_profile": depth} for depth in state.cylinder_depth[0, 0]]


@dataclass(frozen=True)
class CamObservables(CylinderObservables):
    """Observables of a cam: extremes over the angle, curves along it and where it is worn deepest.

    Parameters
    ----------
    problem : WearProblem
    track : CamStations
        Its track.
    """

    track: CamStations

    def columns(self) -> dict[str, FloatArray]:
        """Return angle, weight, length, segment and pressure angle of the stations."""
        stations = self.track.along
        return {
            "station_angle": stations.angle.ravel(),
            "station_weight": 2.0 * np.pi * stations.time_share.ravel(),
            "station_length": stations.length.ravel(),
            "station_segment": stations.segment.ravel(),
            "pressure_angle": stations.pressure_angle.ravel(),
        }

    def history(self, state: WearState) -> dict[str, FloatArray]:
        """Return turns, depth and damage at the stations, extremes and their errors."""
        problem, at_extremes = self.problem, extremes(self.problem, state)
        least, greatest = at_extremes["least_wear"], at_extremes["greatest_wear"]
        history = {
            "turns": state.passes / problem.kinematics.physical_rollers,
            "station_depth": at_every_station(problem, state.cylinder_depth[:, 0].max(axis=-1)),
            "peak_pressure": at_extremes["peak_pressure"].value,
            "lift_error": least.value + greatest.value,
            **{f"{name}_angle": extreme.angle for name, extreme in at_extremes.items()},
            "depth_error_by_stations": at_extremes["depth"].error,
            "volume_error_by_stations": volume_error_by_stations(problem, state),
            "peak_pressure_error_by_stations": at_extremes["peak_pressure"].error,
            "lift_error_error_by_stations": least.error + greatest.error,
            **{f"{n}_angle_error_by_stations": e.angle_error for n, e in at_extremes.items()},
        }
        if state.damage is not None:
            damage = state.damage[0, : problem.shape[0]].max(axis=-1)
            angle = self.track.greatest(damage).angle
            history |= {"station_damage": at_every_station(problem, damage), "damage_angle": angle}
        return history

    def record(self, state: WearState) -> dict[str, FloatArray]:
        """Return the curve of the lift error."""
        return {"lift_error_curve": self.track.at_unworn(lift_errors(self.problem, state))}

    def of_ensemble(self, state: WearState, row: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return lift error, and the angles of its greatest value, of depth and pressure."""
        errors, first = lift_errors(self.problem, state), row["peak_pressure"].argmax(axis=0)[None]
        return {
            "lift_error": row["lift_error"].max(axis=0),
            "lift_error_angle": self.track.greatest(np.abs(errors).max(axis=1)).angle,
            "depth_angle": row["depth_angle"],
            "peak_pressure_angle": np.take_along_axis(row["peak_pressure_angle"], first, axis=0)[0],
        }

    def curves(self, state: WearState, scenarios: Sequence[Scenario]) -> list[dict[str, Any]]:
        """Return the worn profile where it is deepest, and lift error and damage over the angle.

        Of several rollers it is the lift error of the roller with which it varies most. The damage
        across the track is that where it is greatest.
        """
        problem, track, errors = self.problem, self.track, lift_errors(self.problem, state)
        stations = [turn_of(scenario).stations for scenario in scenarios]
        roller = peak_to_peak(track, errors).argmax(axis=0)
        lifts = track.at_unworn(errors)

        def deepest(values: FloatArray) -> list[FloatArray]:
            pairs = enumerate(track.greatest(values.max(axis=-1)).angle.tolist())
            return [np.maximum(track.at_angle(values[:, v], angle), 0.0) for v, angle in pairs]

        curves: list[dict[str, Any]] = [
            {
                "depth_profile": depth,
                "lift_error_curve": test_stations.values_at_angles(
                    lifts[:, roller[v], v], CURVE_ANGLES
                ),
            }
            for v, (depth, test_stations) in enumerate(
                zip(deepest(state.cylinder_depth[:, 0]), stations, strict=True)
            )
        ]
        if state.damage is not None:
            damage = state.damage[0, : problem.shape[0]]
            along, across = at_every_station(problem, damage.max(axis=-1)), deepest(damage)
            for v, test_stations in enumerate(stations):
                at_angles = np.maximum(
                    test_stations.values_at_angles(along[:, v], CURVE_ANGLES), 0.0
                )
                curves[v] |= {"cylinder_damage_profile": across[v], "damage_curve": at_angles}
        return curves


def observables_of_track(problem: WearProblem) -> CylinderObservables:
    """Return the observables of a problem that depend on its track."""
    track = problem.kinematics.track
    return (
        CamObservables(problem, track)
        if isinstance(track, CamStations)
        else CylinderObservables(problem)
    )


def at_every_station(problem: WearProblem, values: FloatArray) -> FloatArray:
    """Return values of the stations, first axis, along the angle of the unworn cam.

    They are not negative where they have been interpolated to its stations.
    """
    track = problem.kinematics.track
    at_stations = track.at_unworn(values)
    return at_stations if track.recorded is None else np.maximum(at_stations, 0.0)
