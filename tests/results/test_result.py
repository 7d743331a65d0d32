"""Properties and final state of a run's result."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from run_examples import some_run

from wearsim.results.io.files import write_results
from wearsim.scenario import load_scenario
from wearsim.studies.opening import open_results
from wearsim.studies.run.result import Result
from wearsim.studies.run.schema import VARIABLES

SCENARIOS = Path(__file__).parents[2] / "scenarios"


def test_axes_of_length_one_are_dropped() -> None:
    result = Result(some_run(steps=5, records=3, strips=7))
    assert result.depth.shape == result.normal_force.shape == result.passes.shape == (5,)
    assert result.profiles.shape == result.roller_profiles.shape == (3, 7)
    assert result.line_load.shape == result.dissipation.shape == (3, 7)
    assert result.y.shape == (7,)
    batch = Result(some_run(rollers=2, realisations=4))
    assert batch.depth.shape == (5, 4)
    assert batch.normal_force.shape == (5, 2, 4)
    assert batch.line_load.shape == (3, 2, 4, 7)


def test_axes_of_step_record_and_y_are_kept() -> None:
    result = Result(some_run(steps=1, records=1, strips=1))
    assert result.depth.shape == result.time.shape == (1,)
    assert result.profiles.shape == (1, 1)


def test_result_properties_return_their_variables() -> None:
    result = Result(some_run(seed=3, rollers=2))
    variables = {"profiles": "cylinder_depth_profile", "roller_profiles": "roller_depth_profile"}
    for name in (*VARIABLES, *variables):
        if hasattr(Result, name):
            np.testing.assert_array_equal(
                getattr(result, name), result.raw.variables[variables.get(name, name)].squeeze()
            )
    assert len([name for name in VARIABLES if hasattr(Result, name)]) == 32
    np.testing.assert_array_equal(
        result.values("half_length"), result.raw.records["half_length"].squeeze()
    )


def test_final_state_is_ready_for_json() -> None:
    result = Result(some_run(rollers=3))
    final = json.loads(json.dumps(result.final, allow_nan=False))
    assert final == result.final
    assert final["depth_m"] == result.depth[-1]
    assert final["passes"] == 4000.0
    assert final["peak_pressure_Pa"] == result.peak_pressure[-1].max()
    deepest = max(result.depth[-1], np.max(result.roller_depth[-1]))
    assert final["relative_depth_error"] == result.depth_error[-1] / deepest
    rollers = np.sum(result.raw.static["multiplicity"] * result.roller_worn_volume[-1])
    total = result.worn_volume[-1] + rollers
    assert final["relative_volume_error"] == pytest.approx(result.volume_error[-1] / total)


def test_final_state_of_several_realisations_has_lists() -> None:
    result = Result(some_run(rollers=3, realisations=2))
    assert result.final["depth_m"] == result.depth[-1].tolist()
    assert result.final["peak_pressure_Pa"] == result.peak_pressure[-1].max(axis=0).tolist()
    assert isinstance(result.final["time_s"], float)


def test_relative_error_without_wear_is_zero() -> None:
    data = some_run()
    data.history["depth"][:] = 0.0
    data.history["depth_error"][:] = 0.0
    assert Result(data).final["relative_depth_error"] == 0.0


def test_steps_are_the_accepted_steps() -> None:
    assert Result(some_run()).steps == 17
    assert Result(some_run(checkpoint={})).steps == 4


def test_scenario_is_parsed_from_the_results_file_alone(tmp_path: Path) -> None:
    scenario = load_scenario(SCENARIOS / "rig-logged-load.toml", {"friction.coefficient": 0.2})
    data = some_run(
        scenario_text=scenario.text, scenario_file=scenario.file, files=dict(scenario.files)
    )
    write_results(tmp_path / "run.h5", data)
    result = open_results(tmp_path / "run.h5")
    assert result.scenario.sha256 == scenario.sha256
    assert result.scenario is result.scenario
    assert result.path == tmp_path / "run.h5"


def test_attributes_of_a_result_are_read_only() -> None:
    result = Result(some_run(notes=["a"], warnings=["b"]))
    assert (result.notes, result.warnings, result.path) == (("a",), ("b",), None)
    assert (result.model, result.stepper, result.finished) == ("slender", "implicit", False)
    with pytest.raises(AttributeError):
        result.depth = result.width  # type: ignore[misc]


def test_repr_of_run() -> None:
    result = Result(some_run())
    depth = result.depth[-1] * 1e6
    assert repr(result) == f"<Result 'a rig': 4000 of 1350000 roller passes, depth {depth:.4g} um>"
    assert repr(Result(some_run(finished=True, total_passes=4000.0))) == (
        f"<Result 'a rig': 4000 roller passes, depth {depth:.4g} um>"
    )


def test_drawn_values_are_returned_by_scenario_key() -> None:
    drawn = {"creepage.yaw": {"values": [1e-3, 2e-3], "unit": "rad"}}
    assert Result(some_run(drawn=drawn)).drawn == {"creepage.yaw": (1e-3, 2e-3)}
    assert Result(some_run()).drawn == {}
