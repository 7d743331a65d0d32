"""Consistency of contact studies and runs, and checks before a run."""

import numpy as np
import pytest

import wearsim
from tests.evolution import SCENARIOS
from wearsim.errors import ScenarioError
from wearsim.studies.dry_run import dry_run
from wearsim.studies.run.assemble import assemble_problem
from wearsim.studies.run.draws import draw


def groove(folder):
    """Write a groove that fits the roller, 48 um deep, and return its path."""
    y = np.linspace(-12.0, 12.0, 961)
    height = -np.maximum(0.0, 48.0 - y**2)  # um; y^2/(2 R_crown) is y^2 um at R_crown = 500 mm
    path = folder / "groove.csv"
    rows = "\n".join(f"{a:.6f}, {b:.6f}" for a, b in zip(y, height, strict=True))
    path.write_text("y [mm], height [um]\n" + rows)
    return str(path)


@pytest.mark.parametrize(
    "creepage",
    [
        {"longitudinal": 1e-3},
        {"longitudinal": 1e-3, "differential_slip": True},
        {"drive": "free", "bearing_torque": "50 N mm", "differential_slip": True},
    ],
)
def test_run_starts_with_contact_of_contact_study(tmp_path, creepage):
    overrides = {
        "cylinder.profile": groove(tmp_path),
        "creepage": creepage,
        "operation.passes": 1000,
        "contact.strips": 201,
        "contact.width": "22 mm",
    }
    scenario = wearsim.load_scenario(SCENARIOS / "rig-450min.toml", overrides=overrides)
    single = wearsim.solve_contact(scenario)
    result = wearsim.run(scenario)
    assert result.power[0] == pytest.approx(3.0 * single.power, rel=1e-9)
    assert result.longitudinal_creepage[0] == pytest.approx(single.longitudinal_creepage, rel=1e-9)


def test_final_record_and_history_have_the_same_load():
    scenario = wearsim.load_scenario(
        SCENARIOS / "rig-logged-load.toml", overrides={"operation.duration": "30 min"}
    )
    result = wearsim.run(scenario)
    spacing = float(np.diff(result.y)[0])
    assert result.line_load[-1].sum() * spacing == pytest.approx(result.normal_force[-1], rel=1e-8)
    assert 3.0 * result.dissipation[-1].sum() * spacing == pytest.approx(result.power[-1], rel=1e-8)


def test_log_falling_to_zero_is_refused_before_the_run(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text("time [min], load [N]\n0, 300\n100, 300\n101, -5\n102, 300\n450, 300\n")
    scenario = wearsim.load_scenario(
        SCENARIOS / "rig-450min.toml", overrides={"load": {"kind": "recorded", "file": str(log)}}
    )
    with pytest.raises(ScenarioError, match="the load falls to zero"):
        dry_run(scenario)


def test_options_without_meaning_are_refused():
    for changes, key in (
        ({"evolution.stepper": "per-pass", "evolution.step": 100}, "step"),
        ({"evolution.stepper": "implicit", "evolution.allow_unstable": True}, "allow_unstable"),
    ):
        scenario = wearsim.load_scenario(SCENARIOS / "rig-450min.toml", overrides=changes)
        with pytest.raises(ScenarioError, match=rf"\[evolution\] {key}: has no meaning"):
            assemble_problem(draw(scenario))


def test_centre_of_the_strips_can_be_set():
    scenario = wearsim.load_scenario(
        SCENARIOS / "rig-450min.toml", overrides={"contact.centre": "0.2 mm"}
    )
    solution = wearsim.solve_contact(scenario)
    assert solution.y.mean() == pytest.approx(0.2e-3)
