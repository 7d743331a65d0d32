"""Random cams: stepped in batches, equal to each cam by itself."""

from __future__ import annotations

import numpy as np
import pytest
from cam_text import SCENARIOS

import wearsim
from wearsim.evolution.observables import peak_to_peak
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.ensemble.api import parse_target
from wearsim.studies.ensemble.batch import batch_groups, joined_problem
from wearsim.studies.ensemble.realisation import RealisationRunner, profile_axis
from wearsim.studies.opening import export_csv

RANDOM = {
    "coefficient = 0.1": 'coefficient = {distribution = "uniform", low = 0.08, high = 0.12}',
    'yaw = "1 mrad"': 'yaw = {distribution = "normal", mean = "0 mrad", std = "1 mrad", '
    'persistence = "per-roller"}',
    "turns = 1_350_000": "turns = 20_000",
}


def runner(name: str, **changes: str) -> RealisationRunner:
    text = (SCENARIOS / f"cam-{name}.toml").read_text()
    for old, new in (RANDOM | changes).items():
        assert old in text
        text = text.replace(old, new)
    scenario = wearsim.Scenario.from_toml(f"{text}\n[contact]\nstrips = 41\n")
    return RealisationRunner(scenario, "monte-carlo", 4, profile_axis(scenario))


@pytest.mark.parametrize("name", ["cycloidal", "swinging"])
def test_cam_in_a_batch_equals_the_cam_alone(name):
    run = runner(name)
    groups = batch_groups([run.prepare(number, {}) for number in range(3)])
    assert [len(group) for group in groups] == [3]
    together = run(range(3))
    for number, outcome in enumerate(together):
        assert not outcome.error
        alone = run([number])[0]
        for key, value in alone.values.items():
            assert np.array_equal(outcome.values[key], value), key


def test_cams_with_other_skids_are_stepped_alone():
    run = runner("cycloidal", **{'inertia = "2.94e-5 kg m^2"': 'inertia = "3e-3 kg m^2"'})
    groups = batch_groups([run.prepare(number, {}) for number in range(3)])
    assert [len(group) for group in groups] == [1, 1, 1]


def test_lift_error_does_not_depend_on_the_batch():
    run = runner("cycloidal")
    problems = [run.prepare(number, {}).problem for number in range(3)]
    together = joined_problem(problems)
    errors = np.random.default_rng(3).normal(size=(len(together.kinematics.track.angle), 1, 3))
    spread = peak_to_peak(together.kinematics.track, errors)
    for number, problem in enumerate(problems):
        own = peak_to_peak(problem.kinematics.track, errors[..., [number]])
        assert (spread[:, [number]] == own).all()


@pytest.fixture(scope="module")
def tests_of_cams(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cams")
    scenario = runner("cycloidal").scenario
    return wearsim.ensemble(scenario, 3, folder / "cams.h5", scheduler="serial")


def test_ensemble_has_lift_error_with_angles_and_curves(tests_of_cams):
    result = tests_of_cams
    curves = result.kept_values("lift_error_curve")
    error = result.at_end("lift_error")
    assert curves.shape == (3, 361)
    np.testing.assert_allclose(np.ptp(curves, axis=1), error, rtol=2e-3)
    assert (error <= result.at_end("roller_depth") + result.at_end("depth")).all()
    # the curve is that of a run with the same draws
    runs = runner("cycloidal")
    run = wearsim.run(runs.drawer.draw(1).scenario)
    along = np.degrees(run.raw.static["station_angle"])
    final = np.asarray(run.raw.records["lift_error_curve"])[-1, :, 0, 0]
    moving = np.diff(along) > 1e-9
    places = np.flatnonzero(np.append(moving, True))
    stored = np.interp(along[places], np.arange(361.0), curves[1])
    np.testing.assert_allclose(stored, final[places], rtol=2e-2, atol=2e-2 * error[1])
    angle = result.at_end("lift_error_angle")
    nearest = np.degrees(angle).round().astype(int)
    worst = np.abs(curves).max(axis=1)
    found = np.abs(curves[np.arange(3), nearest])
    np.testing.assert_allclose(found, worst, rtol=2e-2)
    for name in ("depth_angle", "peak_pressure_angle"):
        assert ((result.at_end(name) >= 0.0) & (result.at_end(name) <= 2.0 * np.pi)).all()


def test_ensemble_of_cams_is_exported_and_reported(tests_of_cams, tmp_path):
    files = {path.name: path.read_text() for path in export_csv(tests_of_cams, tmp_path)}
    lines = files["lift_error.csv"].splitlines()
    assert lines[0].startswith("angle [deg],lift error mean [um]")
    assert len(lines) == 362
    assert "lift_error [um]" in files["realisations.csv"].splitlines()[0]
    assert "lift_error mean [um]" in files["courses.csv"].splitlines()[0]
    stored = tests_of_cams.to_xarray()
    assert stored["lift_error_mean"].shape == stored["depth_mean"].shape
    np.testing.assert_allclose(
        stored["lift_error_curve_mean"], stored["lift_error_curve"].mean("kept")
    )


def test_precision_may_be_that_of_the_lift_error_of_cams_only():
    assert parse_target("lift_error.mean 5%").observable == "lift_error"
    with pytest.raises(ValueError, match="not an observable"):
        parse_target("lift_error.mean 5%", shipped_scenario("rig-450min"))
