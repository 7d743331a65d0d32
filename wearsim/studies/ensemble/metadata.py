"""What the file of an ensemble says before its first realisation."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np

from wearsim.errors import CapabilityError, Mistake
from wearsim.results import EnsembleData
from wearsim.scenario import Scenario
from wearsim.studies.ensemble.control_variate import control_of
from wearsim.studies.ensemble.designs import BASE_PLANS, EnsemblePlan
from wearsim.studies.run.assemble import assemble_problem
from wearsim.studies.run.draws import Drawer, units_of
from wearsim.studies.run.output_schedule import RecordSchedule
from wearsim.studies.run.provenance import origin_of
from wearsim.types import FloatArray, Grid
from wearsim.uq.estimation.stopping_rule import Target


def header_of(
    scenario: Scenario,
    plan: EnsemblePlan,
    count: int,
    target: Target | None,
    grid: Grid,
) -> EnsembleData:
    """Return what an ensemble's file says before the first realisation.

    Parameters
    ----------
    scenario : Scenario
    plan : str
    count : int
        Realisations at most.
    target : Target, optional
        What ends the ensemble before that.
    grid : Grid
        Strips that its members share.

    Raises
    ------
    ScenarioError, CapabilityError
        If the scenario cannot run, or the plan has no control variate for it.
    """
    drawer = Drawer(scenario, BASE_PLANS[plan], count)
    averaged = tuple(item for item in scenario.random if item.name not in drawer.groups)
    # what cannot run is refused before anything is written
    _, _, stepper = assemble_problem(replace(scenario, random=averaged), grid)
    return EnsembleData(
        **origin_of(scenario),
        finished=False,
        wall_seconds=0.0,
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        notes=list(scenario.notes),
        stepper=stepper,
        tolerance=scenario.evolution.tolerance,
        width_threshold=scenario.outputs.width_threshold,
        total_passes=float(scenario.total_passes),
        total_time=scenario.total_time,
        strip_width=grid.spacing,
        plan=plan,
        asked=count,
        until="" if target is None else str(target),
        inputs=_inputs(scenario, drawer),
        groups=[
            {
                "name": item.name,
                "role": item.role,
                "persistence": item.persistence,
                "text": item.describe(),
            }
            for item in scenario.random
            if item.name in drawer.groups
        ],
        control=_control(drawer, plan),
    )


def _inputs(scenario: Scenario, drawer: Drawer) -> list[dict[str, str]]:
    """Return key, unit and random input of every value that a realisation draws."""
    units = units_of(scenario)
    return [
        {
            "key": key,
            "unit": units[key],
            "input": item.name,
            "rollers": "each" if item.persistence == "per-roller" else "",
        }
        for item in scenario.random
        if item.name in drawer.groups
        for key in item.keys
    ]


def _control(drawer: Drawer, plan: EnsemblePlan) -> dict[str, float]:
    """Return what is known of the control variate; nothing where the plan has none."""
    if plan != "control-variate":
        return {}
    known = control_of(drawer)
    if known is None:
        raise CapabilityError(
            f"{drawer.scenario.file}: the control variate is a depth in closed form, which takes a"
            " wear law linear in the dissipation; choose another plan, such as monte-carlo"
        )
    return {"mean": known.mean, "std": known.std, "draws": known.draws}


def static_of(scenario: Scenario, grid: Grid) -> dict[str, FloatArray]:
    """Return what all realisations have in common."""
    stop = float(scenario.total_passes)
    passes = RecordSchedule.of(scenario, stop).all_records(
        stop, scenario.evolution.stepper == "per-pass"
    )
    return {
        "y": grid.y,
        "multiplicity": np.ones(scenario.operation.rollers),
        "record_passes": passes,
        "record_time": passes / scenario.pass_rate,
    }


def nothing_random(scenario: Scenario) -> Mistake:
    """Return what is wrong with a scenario whose tests would all be the same."""
    what = "no random input tells one test from another"
    if scenario.random:
        what += ': those drawn anew at every pass average out, but with stepper = "per-pass"'
    expected = (
        "a distribution in the place of a value, such as friction.coefficient ="
        ' {distribution = "maxent", support = [0, "inf"], mean = 0.1, std = 0.02}'
    )
    return Mistake("", "", what, None, expected)
