"""Optima against closed forms and root finding; fronts, lists, failures and resumption."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import wearsim
from wearsim.errors import Interrupted, WearsimError
from wearsim.results.io.files import write_results
from wearsim.scenario.examples import shipped_scenario
from wearsim.testing import study_kind_tests
from wearsim_optimise.api import optimise, resume_optimise
from wearsim_optimise.kind import wearsim_study_kinds
from wearsim_optimise.result import OptimisationResult

CONTACT = {"contact.strips": 41, "operation.rollers": 1}
CROWN = ["roller.crown_radius=300mm:900mm"]
LIMIT = "peak_pressure < 650 MPa"
ALONE: dict[str, Any] = {
    "operation.rollers": 1,
    "wear.cylinder.k_over_h": {
        "distribution": "lognormal",
        "median": "1.1e-11 1/Pa",
        "factor": 1.5,
    },
    "limit.depth": "50 um",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("optimise")


@cache
def of_contact(path: Any) -> OptimisationResult:
    """Return the crown radius of the least power within a limit of the pressure."""
    scenario = shipped_scenario("rig-450min", CONTACT)
    options: dict[str, Any] = {"minimise": "contact.power", "subject_to": [LIMIT], "starts": 2}
    options |= {"tolerance": ["roller.crown_radius=5mm"], "evaluations": 20, "force": True}
    return optimise(scenario, CROWN, path, scheduler="serial", **options)


def test_active_limit_is_where_root_finding_has_it(folder):
    found = of_contact(folder / "contact.h5")
    scenario = shipped_scenario("rig-450min", CONTACT)

    def excess(radius: float) -> float:
        tried = scenario.changed({"roller.crown_radius": f"{radius!r} mm"})
        return wearsim.solve_contact(tried).peak_pressure - 650e6

    assert found.best.numbers[0] == pytest.approx(brentq(excess, 300.0, 900.0), rel=1e-3)
    assert found.best.values["peak_pressure"] < 650e6
    assert found.raw.converged
    (active,) = found.raw.active
    assert active["constraint"] == LIMIT
    # p ~ R^-0.25 or less steep: 1 % more pressure allows a smaller radius, and less power
    relaxed = brentq(lambda radius: excess(radius) - 6.5e6, 300.0, 900.0)
    power = wearsim.solve_contact(
        scenario.changed({"roller.crown_radius": f"{relaxed!r} mm"})
    ).power
    gain = power / found.best.values["contact.power"] - 1.0
    assert active["gain"] == pytest.approx(gain, rel=0.1)
    assert found.raw.robustness is not None
    assert LIMIT in found.raw.robustness["violated"]


def test_sqrt_law_of_the_crown_radius_gives_the_closed_form():
    scenario = shipped_scenario("rig-450min", ALONE)
    options: dict[str, Any] = {"maximise": "life.b10", "realisations": 1, "starts": 1}
    options |= {"subject_to": ["life.width < 14 mm"], "evaluations": 10, "confirm": False}
    found = optimise(scenario, ["roller.crown_radius=300mm:900mm"], scheduler="serial", **options)
    closed = 14e-3**2 / (8.0 * (50e-6 - scenario.outputs.width_threshold))
    # the bodies are elastic
    assert 1e-3 * found.best.numbers[0] == pytest.approx(closed, rel=0.01)
    # the width is as the root of the radius, which is then within 0.1 % of the crossing
    assert found.best.values["life.width"] == pytest.approx(14e-3, rel=5e-4)


def test_search_that_does_not_converge_says_so_and_states_the_best_of_all():
    found = optimise(
        shipped_scenario("rig-450min", CONTACT),
        CROWN,
        minimise="peak_pressure",
        evaluations=3,
        starts=1,
        scheduler="serial",
    )
    assert not found.raw.converged
    assert not found.view.data()["converged"]
    assert "not converged" in found.view.line()
    assert "--evaluations 6" in found.warnings[0]
    assert any(row.label == "search" and "--evaluations 6" in row.text for row in found.view.rows())
    # the pressure falls up to the bound: of each optimum a neighbour is better
    assert found.best is min(found.designs, key=lambda design: design.loss)
    assert found.best.purpose == "sensitivity"


def test_cams_that_cannot_be_followed_guide_the_search():
    fast = shipped_scenario("cam-cycloidal", {"operation.speed": "1900 rpm"})
    found = optimise(
        fast,
        ["operation.speed=500rpm:1900rpm"],
        minimise="peak_pressure",
        subject_to=["jump_speed > 1000 rpm", "perimeter < 1 m"],
        evaluations=12,
        starts=2,
        scheduler="serial",
    )
    assert found.designs[0].status == "infeasible"
    assert found.designs[0].outcome["margins"]["least_normal_force"] < 0.0
    assert found.best.outcome["margins"]["least_normal_force"] > 0.0
    assert not [design for design in found.designs if design.status == "failed"]
    assert found.raw.gains[0]["why"].startswith("the first design")


def test_list_of_motion_laws_is_searched_by_the_evolution_strategy():
    scenario = shipped_scenario("cam-cycloidal")
    laws = ["cycloidal", "modified-sine", "modified-trapezoid"]
    pytest.importorskip("cmaes")
    found = optimise(
        scenario,
        [f"cam.motion.2.law+cam.motion.4.law={','.join(laws)}", "cam.base_radius=25mm:30mm"],
        minimise="pressure_angle",
        evaluations=14,
        scheduler="serial",
    )
    changed = [{f"cam.motion.{n}.law": law for n in (2, 4)} for law in laws]
    angles = [
        wearsim.study_cam(
            scenario.changed({**laws_of, "cam.base_radius": "30 mm"})
        ).max_pressure_angle[0]
        for laws_of in changed
    ]
    assert found.best_values["cam.motion.2.law"] == laws[int(np.argmin(angles))]
    assert found.best.values["pressure_angle"] == pytest.approx(min(angles), rel=0.02)


def test_front_of_two_objectives_is_not_surpassed():
    found = optimise(
        shipped_scenario("cam-cycloidal"),
        ["cam.base_radius=22mm:60mm"],
        minimise=["outer_radius", "pressure_angle"],
        evaluations=24,
        scheduler="serial",
    )
    values = np.array([[d.values["outer_radius"], d.values["pressure_angle"]] for d in found.front])
    assert len(values) > 6
    assert (np.diff(values[:, 0]) > 0.0).all()
    assert (np.diff(values[:, 1]) < 0.0).all()
    # both ends of the bounds: a small cam is steep
    assert values[0, 0] == pytest.approx(30e-3, rel=1e-3)
    assert values[-1, 0] == pytest.approx(68e-3, rel=1e-3)


def test_second_choice_stays_within_one_per_cent_of_the_best():
    # the power hardly depends on the radius, the pressure does
    found = optimise(
        shipped_scenario("rig-450min", CONTACT),
        CROWN,
        minimise="contact.power",
        then="peak_pressure",
        evaluations=18,
        starts=1,
        scheduler="serial",
    )
    least = min(d.values["contact.power"] for d in found.designs if d.is_feasible)
    assert least < found.best.values["contact.power"] <= 1.01 * least
    near = [d for d in found.designs if d.values["contact.power"] <= 1.01 * least]
    assert found.best.values["peak_pressure"] == min(d.values["peak_pressure"] for d in near)


def test_failed_designs_are_kept_with_their_reason():
    found = optimise(
        shipped_scenario("cam-cycloidal"),
        ["creepage.bearing_torque=1 N mm:5000 N mm"],
        minimise="skid_energy",
        evaluations=8,
        starts=2,
        scheduler="serial",
    )
    failed = [design for design in found.designs if design.status == "failed"]
    assert failed
    assert "the roller rolls nowhere" in failed[0].outcome["reason"]
    assert any("designs failed" in text for text in found.warnings)


def test_stopped_and_resumed_equals_unbroken(folder):
    whole = of_contact(folder / "contact.h5")
    calls: list[int] = []

    def stop() -> bool:
        calls.append(1)
        return len(calls) > 12

    path = folder / "stopped.h5"
    options: dict[str, Any] = {"minimise": "contact.power", "subject_to": [LIMIT], "starts": 2}
    options |= {"tolerance": ["roller.crown_radius=5mm"], "evaluations": 20}
    scenario = shipped_scenario("rig-450min", CONTACT)
    with pytest.raises(Interrupted, match="resume_optimise"):
        optimise(scenario, CROWN, path, scheduler="serial", stop_requested=stop, **options)
    assert not wearsim.open_results(path).finished
    assert same(resume_optimise(path, scheduler="serial"), whole)


def test_any_outcomes_in_a_file_lead_to_the_same_designs(folder):
    whole = of_contact(folder / "contact.h5")
    kept = list(whole.raw.outcomes.items())[::3]
    path = folder / "part.h5"
    part = replace(whole.raw, outcomes=dict(kept), finished=False, best=0, front=[])
    write_results(path, part)
    assert same(resume_optimise(path, scheduler="serial"), whole)


def same(found: OptimisationResult, other: OptimisationResult) -> bool:
    """Return whether two optimisations have equal designs and answers."""
    data = [result.view.data() for result in (found, other)]
    for item in data:
        del item["wall_seconds"], item["output"]
    return data[0] == data[1]


def test_gain_is_stated_with_fresh_draws():
    quick: dict[str, Any] = {"evolution.tolerance": 1e-2, "evolution.strip_error": False}
    force = {"distribution": "lognormal", "median": "300 N", "factor": 1.1}
    quick |= {"load": {"kind": "constant", "normal_force": force}, "limit.depth": "20 um"}
    scenario = shipped_scenario("rig-life", {**CONTACT, **quick})
    found = optimise(
        scenario,
        ["roller.crown_radius=500mm:600mm"],
        maximise="life.b10",
        evaluations=3,
        starts=1,
        realisations=8,
        scheduler="serial",
    )
    (gain,) = found.raw.gains
    assert gain["fresh"]
    assert gain["low"] < gain["ratio"] < gain["high"]
    # life grows as the root of the crown radius
    assert gain["ratio"] == pytest.approx((found.best.numbers[0] / 500.0) ** 0.5, rel=0.02)
    assert gain["values"][0] != found.best.values["life.b10"]


def test_no_feasible_design_names_the_nearest_constraint():
    with pytest.raises(
        WearsimError, match=r"'peak_pressure < 100 MPa', with \d+.* at roller"
    ) as error:
        optimise(
            shipped_scenario("rig-450min", CONTACT),
            CROWN,
            minimise="contact.power",
            subject_to=["peak_pressure < 100 MPa"],
            evaluations=6,
            starts=1,
            scheduler="serial",
        )
    assert "relax it" in str(error.value)


small = next(iter(wearsim_study_kinds()))


@pytest.fixture(scope="module", autouse=True)
def _files(folder):
    FOLDER[:] = [folder]


FOLDER: list[Any] = []
test_optimisation_in_every_display = study_kind_tests(
    small, lambda: of_contact(FOLDER[0] / "contact.h5")
)
