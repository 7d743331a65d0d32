"""Identification of K/H from grooves at angles of a cam, and from its lift before and after."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import wearsim
from tests.studies.cam.cam_text import cam
from tests.studies.identify.grooves import NOISE, write
from wearsim.errors import CapabilityError, ScenarioError
from wearsim.scenario import Scenario
from wearsim.studies.cam.cam_wear import LIFT, Wanted
from wearsim.studies.cam.turn import turn_of
from wearsim.studies.identify.analysis import Identified, identified, kernel_of
from wearsim.studies.identify.api import identify
from wearsim.studies.identify.measurements import Measurement, read_tests
from wearsim.studies.identify.planning import plan_tests
from wearsim.studies.identify.pooling import specimens_of
from wearsim.studies.identify.traces import Trace, level
from wearsim.studies.identify.trajectories import Grower, Trajectories
from wearsim.studies.run.result import Result

K = 1.5e-11
ANGLES = (45.0, 112.0, 225.0)
RANDOM = {
    "friction.coefficient": {"distribution": "lognormal", "median": 0.1, "factor": 1.2},
    "creepage.longitudinal": {"distribution": "lognormal", "median": 1e-3, "factor": 1.3},
}


def scenario(**changes: object) -> Scenario:
    """Return a cycloidal cam with a prescribed creepage, whose roller does not wear."""
    given = {
        "creepage": {"drive": "creepage", "longitudinal": 1e-3},
        "wear": {
            "law": "archard-dissipation",
            "cylinder": {"k_over_h": "1.1e-11 1/Pa"},
            "roller": {"k_over_h": "0 1/Pa"},
        },
        "evolution.tolerance": 1e-2,
    }
    return cam("cycloidal").changed({**given, **changes})


@pytest.fixture(scope="module")
def worn() -> Result:
    """Return the run of the true wear factor."""
    return wearsim.run(scenario(**{"wear.cylinder.k_over_h": f"{K} 1/Pa"}))


def groove_at(result: Result, degrees: float, y: np.ndarray) -> np.ndarray:
    """Return the worn depth at an angle of the cam [m]."""
    stations = turn_of(result.scenario).stations
    depth = np.asarray(result.raw.records["cylinder_depth_profile"])[-1]
    rows = depth.reshape(stations.count, -1)
    return np.interp(y, result.y, stations.values_at_angles(rows, np.radians([degrees]))[0])


def write_grooves(folder: Path, result: Result) -> Path:
    """Write noisy traces at three angles and a tests file."""
    rng, y, tables = np.random.default_rng(4), np.arange(-11e-3, 11e-3, 80e-6), []
    for degrees in ANGLES:
        noise = NOISE.sample(y, rng.standard_normal((2, len(y))))
        height = 3e-6 + 2e-4 * y - groove_at(result, degrees, y - 0.2e-3) + noise
        write(folder / f"{degrees:g}.csv", y, height)
        tables.append(
            f'[[test]]\nprofile = "{degrees:g}.csv"\nangle = "{degrees:g} deg"\ngroup = "cam 1"\n'
        )
    (folder / "tests.toml").write_text("\n".join(tables))
    return folder / "tests.toml"


def write_lifts(folder: Path, result: Result) -> Path:
    """Write noisy lifts before and after wear, at different angles, and a tests file."""
    rng, turn = np.random.default_rng(4), turn_of(result.scenario)
    curve = np.asarray(result.raw.records["lift_error_curve"])[-1].ravel()
    for name, degrees in (("new", np.arange(0.0, 360.0)), ("worn", np.arange(0.0, 360.0, 0.75))):
        theta = np.radians(degrees)
        lift = turn.cam.motion.lift(theta)[0] + 1e-6 * rng.standard_normal(len(theta))
        if name == "worn":
            lift = lift + turn.stations.values_at_angles(curve, theta) + 4e-6
        rows = np.stack([degrees, 1e3 * lift], axis=1)
        head = "angle [deg],lift [mm]"
        np.savetxt(
            folder / f"{name}.csv", rows, delimiter=",", header=head, comments="", fmt="%.7f"
        )
    (folder / "lift.toml").write_text('[[test]]\nlift = "worn.csv"\nbefore = "new.csv"\n')
    return folder / "lift.toml"


def test_grooves_at_angles_of_a_cam_share_its_wear_factor(tmp_path, worn):
    result = identify(scenario(), write_grooves(tmp_path, worn))
    assert result.raw.specimens == ["cam 1"]
    for test, degrees in zip(result.tests, ANGLES, strict=True):
        k = test["k_over_h_per_Pa"]
        assert k["low"] < K < k["high"]
        assert math.degrees(test["angle_rad"]) == pytest.approx(degrees)
        depth = groove_at(worn, degrees, worn.y).max()
        assert test["depth_m"] == pytest.approx(depth, rel=0.04)
    median = result.summary["k_over_h_median_per_Pa"]["value"]
    assert median == pytest.approx(K, rel=0.02)
    # one test of three grooves is known better than by each of them
    assert result.summary["exponents"] == {}
    each = [test["k_over_h_per_Pa"] for test in result.tests]
    widths = [math.log(k["high"] / k["low"]) / 3.92 for k in each]
    assert result.summary["scatter_from_inputs"] < min(widths)
    energy = worn.values("dissipated_energy")[-1]
    for test in result.tests:
        assert test["energy_J"]["value"] == pytest.approx(energy, rel=2e-2)


def test_lift_before_and_after_wear_gives_the_wear_factor(tmp_path, worn):
    path = write_lifts(tmp_path, worn)
    result = identify(scenario(), path)
    (test,) = result.tests
    assert test["k_over_h_per_Pa"]["low"] < K < test["k_over_h_per_Pa"]["high"]
    assert test["k_over_h_per_Pa"]["value"] == pytest.approx(K, rel=0.05)
    assert test["quantity"] == "lift"
    assert test["area_m2"] is None
    curve = np.asarray(worn.raw.records["lift_error_curve"])[-1]
    assert test["model_depth_m"] == pytest.approx(np.ptp(curve), rel=0.05)
    json.dumps(result.raw.measured)


@pytest.mark.slow
def test_runout_of_a_cam_that_was_mounted_again_is_fitted(tmp_path, worn):
    path = write_lifts(tmp_path, worn)
    angle, lift = np.loadtxt(tmp_path / "worn.csv", delimiter=",", skiprows=1).T
    lift += 0.02 * np.cos(np.radians(angle) - 1.0)
    head = "angle [deg],lift [mm]"
    table = np.stack([angle, lift], axis=1)
    np.savetxt(tmp_path / "worn.csv", table, delimiter=",", header=head, comments="", fmt="%.7f")
    path.write_text(path.read_text() + "runout = true\n")
    (test,) = identify(scenario(), path).tests
    assert test["k_over_h_per_Pa"]["low"] < K < test["k_over_h_per_Pa"]["high"]
    assert test["k_over_h_per_Pa"]["value"] == pytest.approx(K, rel=0.1)


def test_place_of_a_measurement_must_fit_the_scenario(tmp_path, worn):
    write_grooves(tmp_path, worn)
    with pytest.raises(ScenarioError, match=r"angle: is needed for a groove of a cam"):
        identify(scenario(), [tmp_path / "45.csv"])
    rig = wearsim.load_scenario("scenarios/rig-450min.toml")
    with pytest.raises(ScenarioError, match=r"angle: is for a cam, and the scenario has a cyl"):
        identify(rig, tmp_path / "tests.toml")
    with pytest.raises(CapabilityError, match="tests are planned for a cylinder"):
        plan_tests(scenario(), [3])
    scatter = {"distribution": "lognormal", "median": 1, "factor": 1.5}
    with pytest.raises(ScenarioError, match=r"factor: is random, and so is what is identified"):
        identify(scenario(**{"wear.factor": scatter}), tmp_path / "tests.toml")
    (tmp_path / "wrong.toml").write_text('[[test]]\nlift = "a.csv"\nangle = "1 deg"\n')
    with pytest.raises(ScenarioError) as caught:
        read_tests(tmp_path / "wrong.toml")
    for part in ("before: is needed with lift", "angle: has no meaning with lift"):
        assert part in str(caught.value)


SETS, DRAWS = 60, 64
DEGREES = (45.0, 225.0)
NAMES = [f"cylinder at {degrees:.9g} deg" for degrees in DEGREES]


@pytest.fixture(scope="module")
def grown_cams() -> tuple[Trajectories, Trajectories, float]:
    """Return trajectories of the model and of the truths, other draws of the same inputs."""
    angles = dict(zip(NAMES, np.radians(DEGREES), strict=True))
    base, passes = scenario(**RANDOM), float(scenario().total_passes)
    wanted = [*(Wanted(name, passes, 40e-6, 70e-6) for name in NAMES)]
    wanted.append(Wanted(LIFT, passes, 14e-6, 24e-6))
    model, truth = (
        Grower(base.changed({"seed": seed}), count, angles=angles).grow_on_cam(wanted)
        for seed, count in ((1, DRAWS), (5, SETS))
    )
    return model, truth, passes


def true_profile(
    truth: Trajectories, passes: float, name: str, draw: int, ln_k: float
) -> np.ndarray:
    """Return a profile of the truth at a wear factor, by its records."""
    grown = truth.by_passes[passes]
    rows, known = np.cbrt(np.abs(grown.depth[name][draw]) ** 1.5), grown.ln_k[draw]
    signs = np.sign(grown.depth[name][draw][-1])
    # sqrt(depth) is interpolated in K^(1/3), to which it is nearly proportional
    power = np.exp(known / 3.0)
    found = [np.interp(np.exp(ln_k / 3.0), power, row) for row in rows.T]
    return signs * np.array(found) ** 2


def covered(rows: list[Identified], ln_k: float) -> bool:
    """Return whether the 95 % interval of all grooves of a cam holds ln K."""
    product = rows[0].likelihood
    for row in rows[1:]:
        product = product.times(row.likelihood)
    low, high = kernel_of(product, "t").quantile(np.array([0.025, 0.975]))
    return bool(low < ln_k < high)


@pytest.mark.coverage
def test_intervals_hold_the_truth_by_grooves_of_cams(grown_cams):
    model, truth, passes = grown_cams
    rng, held = np.random.default_rng(12), 0
    y = np.arange(-11e-3, 11e-3, 250e-6)
    for draw in range(SETS):
        middle = float(np.median(truth.by_passes[passes].ln_k[draw]))
        ln_k, rows = middle + rng.uniform(-0.3, 0.3), []
        for name, degrees in zip(NAMES, DEGREES, strict=True):
            profile = true_profile(truth, passes, name, draw, ln_k)
            worn = np.interp(y - rng.uniform(-5e-4, 5e-4), truth.by_passes[passes].y, profile)
            height = 2e-4 * y - worn + NOISE.sample(y, rng.standard_normal((2, len(y))))
            unworn = np.zeros(len(y), dtype=bool)
            trace = level(Trace("t", y, height, unworn, "", None, None, None, 0.0), None, 0.5)
            item = Measurement("t", angle=math.radians(degrees))
            assert item.surface == name
            rows.append(identified(item, trace, model, passes, 0.5))
        held += covered(rows, ln_k)
        assert len(specimens_of(rows)) == 2  # no group
    assert abs(held / SETS - 0.95) <= 2.0 * math.sqrt(0.95 * 0.05 / SETS), held


@pytest.mark.coverage
def test_intervals_hold_the_truth_by_lifts_of_cams(grown_cams):
    model, truth, passes = grown_cams
    rng, held = np.random.default_rng(13), 0
    theta = np.radians(np.arange(0.0, 360.0, 2.0))
    unworn = np.zeros(len(theta), dtype=bool)
    curve = np.linspace(0.0, 2.0 * np.pi, 361)
    for draw in range(SETS):
        ln_k = float(np.median(truth.by_passes[passes].ln_k[draw])) + rng.uniform(-0.3, 0.3)
        fall = np.interp(theta, curve, true_profile(truth, passes, LIFT, draw, ln_k))
        change = 5e-6 - fall + 1e-6 * rng.standard_normal(len(theta))
        trace = Trace("t", theta, change, unworn, "", None, None, None, 0.0, difference=True)
        row = identified(Measurement("t", lift=Path("t")), trace, model, passes, 0.5)
        held += covered([row], ln_k)
    assert abs(held / SETS - 0.95) <= 2.0 * math.sqrt(0.95 * 0.05 / SETS), held
