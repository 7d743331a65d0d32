"""Identification: wear factors of synthetic grooves with known truth, and the verdict."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import wearsim
from tests.report.drawn import identification_figure
from tests.studies.identify.grooves import NOISE, PASSES, RANDOM, K, groove, grown, rig, write
from wearsim.errors import CapabilityError, ScenarioError
from wearsim.studies.ensemble.realisation import closed_form_depths
from wearsim.studies.identify import api, trajectories
from wearsim.studies.identify.likelihood import TraceLikelihood
from wearsim.studies.identify.measurements import Measurement
from wearsim.studies.identify.planning import DEPTH_ERROR, plan_tests
from wearsim.studies.identify.trajectories import Grower

SCENARIOS = Path(__file__).parents[3] / "scenarios"


def depth(value: float, **options: object) -> Measurement:
    """Return a measured depth [um] with an error of 1 um."""
    name = f"{value:g} um"
    return Measurement(name, depth=value * 1e-6, depth_std=1e-6, **options)  # type: ignore[arg-type]


def test_known_inputs_give_the_wear_factor_of_a_groove(tmp_path: Path):
    path = write(tmp_path / "t.csv", *groove(np.random.default_rng(1)))
    found = wearsim.identify(rig(), [path])
    (test,) = found.tests
    k = test["k_over_h_per_Pa"]
    assert k["low"] < K < k["high"]
    assert k["high"] / k["low"] < 1.08
    assert test["model_depth_m"] == pytest.approx(48.1e-6, abs=0.8e-6)
    assert test["depth_m"] == pytest.approx(48.1e-6, abs=1.5e-6)
    assert 0.8 < test["residual_ratio"] < 1.25
    assert abs(test["residual_autocorrelation"]) < 0.15
    assert found.summary["scatter_seen"] is None


def test_shape_of_a_groove_of_little_noise_does_not_choose_the_friction(tmp_path: Path):
    bench = {
        "roller": {"radius": "15 mm", "crown_radius": "200 mm", "material": "steel"},
        "cylinder": {"radius": "30 mm", "material": "bronze"},
        "operation": {"speed": "600 rpm", "duration": "85 min", "rollers": 2},
        "load.normal_force": "250 N",
        "wear.cylinder.k_over_h": "5e-11 1/Pa",
        "evolution.tolerance": 1e-3,
    }
    run = wearsim.run(rig().changed({**bench, "friction.coefficient": 0.12}))
    rng, y = np.random.default_rng(1), np.linspace(-0.99, 0.99, 900) * run.y[-1]
    height = rng.normal(0.0, 0.2e-6, y.size) - np.interp(y, run.y, run.profiles[-1])
    path = write(tmp_path / "t.csv", y, height)
    friction = {"distribution": "lognormal", "mean": 0.12, "std": 0.008}
    found = wearsim.identify(rig().changed({**bench, "friction.coefficient": friction}), [path])
    k = found.tests[0]["k_over_h_per_Pa"]
    assert k["low"] < 5e-11 < k["high"]


def test_records_between_are_those_of_a_run():
    run = wearsim.run(rig().changed({"wear.cylinder.k_over_h": "0.8e-11 1/Pa"}))
    worn = run.values("cylinder_depth_profile")[-1].ravel()
    model = TraceLikelihood(run.y, np.zeros_like(run.y), NOISE, grown())
    found = model.worn(np.array([0]), np.log([0.8e-11]), np.zeros(1))[:, 0]
    # except in the strips at the edges of the groove
    assert np.sort(np.abs(found - worn))[-3] < 0.002 * worn.max()
    assert np.abs(found - worn).max() < 0.02 * worn.max()


def test_grid_of_wear_factors_agrees_with_one_trajectory(monkeypatch: pytest.MonkeyPatch):
    scenario = rig(random=True)
    tests = [depth(40.0), depth(52.0)]
    one = wearsim.identify(scenario, tests, draws=16)
    monkeypatch.setattr(trajectories, "time_dependence", lambda *_: ("a process",))
    grid = wearsim.identify(scenario, tests, draws=16)
    assert any("each of several K/H" in note for note in grid.notes)
    values = [[t["k_over_h_per_Pa"]["value"] for t in found.tests] for found in (one, grid)]
    assert values[1] == pytest.approx(values[0], rel=0.01)


def test_process_needs_a_grid_of_wear_factors():
    load = {
        "distribution": "ornstein-uhlenbeck",
        "correlation_time": "30 min",
        "marginal": {"distribution": "uniform", "low": "280 N", "high": "320 N"},
    }
    grower = Grower(rig().changed({"load.normal_force": load}), 2)
    assert grower.reasons == ("a random process in time sets load.normal_force",)
    assert Grower(rig(), 2).reasons == ()


def test_logged_load_needs_a_grid_of_wear_factors():
    logged = wearsim.load_scenario(SCENARIOS / "rig-logged-load.toml")
    reasons = trajectories.time_dependence(logged, shared=True)
    assert reasons[0] == "the load 'recorded' depends on time"
    assert "the load has terms (thermal)" in reasons
    spring = rig().changed({"load.kind": "spring", "load.stiffness": "690 N/mm"})
    assert trajectories.time_dependence(spring, shared=True) == ()


def test_wear_of_the_roller_needs_a_shared_factor():
    scenario = rig().changed({"wear.roller.k_over_h": "2e-12 1/Pa"})
    (reason,) = Grower(scenario, 2).reasons
    assert "--share k=cylinder,roller" in reason
    assert Grower(scenario, 2, shared=True).reasons == ()
    with pytest.raises(ScenarioError, match="wear of the roller is measured"):
        wearsim.identify(scenario, [depth(5.0, body="roller")])
    both = [depth(48.0), Measurement("b", depth=1.6e-6, depth_std=0.2e-6, body="roller")]
    found = wearsim.identify(scenario, both, share=("roller", "cylinder"))
    assert [test["body"] for test in found.tests] == ["cylinder", "roller"]


def test_known_and_measured_inputs_narrow_the_wear_factor():
    known = {"friction.coefficient": 0.1, "creepage.longitudinal": 1e-3}
    error = {"creepage.longitudinal": 1e-4}
    tests = [depth(48.0), depth(48.0, values=known, errors=error), depth(48.0, values=known)]
    found = wearsim.identify(rig(random=True), tests, draws=32)
    widths = [
        np.log(t["k_over_h_per_Pa"]["high"] / t["k_over_h_per_Pa"]["low"]) / 3.92
        for t in found.tests
    ]
    inputs = np.hypot(np.log(1.2), np.log(1.3))
    assert widths[0] == pytest.approx(inputs, rel=0.15)
    # the prior of 0.26 and the measurement of 0.1, combined
    assert widths[1] == pytest.approx(0.1, rel=0.2)
    assert widths[2] == pytest.approx(1.5 / 48.0, rel=0.05)
    assert found.tests[1]["k_over_h_per_Pa"]["value"] == pytest.approx(K, rel=0.05)


def test_measured_value_out_of_the_distribution_is_refused():
    values, errors = {"friction.coefficient": 0.9}, {"friction.coefficient": 0.01}
    test = depth(48.0, values=values, errors=errors)
    with pytest.raises(ScenarioError, match="out of the scenario's distribution"):
        wearsim.identify(rig(random=True), [test], draws=16)


def test_traces_of_one_test_share_its_inputs():
    late = depth(48.1, group="A")
    early = depth(48.1 * (100.0 / 450.0) ** (2.0 / 3.0), group="A", at="100 min")
    found = wearsim.identify(rig(random=True), [early, late, depth(48.1)], draws=32)
    assert found.raw.specimens == ["A", "48.1 um"]
    slope = found.summary["exponents"]["A"]
    assert slope["low"] < 2.0 / 3.0 < slope["high"]
    assert slope["value"] == pytest.approx(2.0 / 3.0, abs=0.01)
    # inputs are common to both traces, so that the second one adds little
    first, second = (
        np.exp(np.diff(np.log([r["low"], r["high"]]))[0])
        for r in (found.tests[0]["k_over_h_per_Pa"], found.tests[1]["k_over_h_per_Pa"])
    )
    assert first == pytest.approx(second, rel=0.2)
    with pytest.raises(ScenarioError, match="is not within the test"):
        wearsim.identify(rig(), [depth(48.0, at="500 min")])


def test_paper_depths_are_undecided_and_reproducible():
    one = wearsim.identify(rig(random=True), [depth(d) for d in (28.0, 48.0, 62.0)], draws=32)
    two = wearsim.identify(rig(random=True), [depth(d) for d in (28.0, 48.0, 62.0)], draws=32)
    assert one.summary == two.summary
    assert one.summary["scatter_seen"] == pytest.approx(0.609, abs=0.02)
    alone = one.summary["scatter_from_inputs"]
    assert alone == pytest.approx(np.hypot(np.log(1.2), np.log(1.3)), rel=0.1)


def test_small_detected_scatter_is_explained_everywhere(tmp_path: Path):
    values = 48.0 * (1.0 + 0.03 * np.linspace(-1.5, 1.5, 12))
    tests = [Measurement(f"{d:.3f} um", depth=d * 1e-6, depth_std=0.1e-6) for d in values]
    found = wearsim.identify(rig(), tests, tmp_path / "k.h5")
    assert found.verdict == "explained"
    assert found.summary["scatter_detected"]
    assert found.scatter_of_k["low"] > 0.0
    words = "is below the negligible 0.2, although a scatter of 0.04"
    assert words in found.verdict_words
    assert words in found.posterior_toml()
    assert words in identification_figure(found).get_suptitle()
    assert found.view.rows()[0].text == found.verdict_words
    strict = wearsim.identify(rig(), tests, negligible=0.02)
    assert strict.verdict == "random"


def test_results_file_and_posterior_are_used_again(tmp_path: Path):
    tests = [depth(45.0), depth(48.0), depth(52.0)]
    path = tmp_path / "k.h5"
    found = wearsim.identify(rig(random=True), tests, path, draws=32)
    again = wearsim.open_results(path)
    assert isinstance(again, wearsim.IdentificationResult)
    assert again.summary == found.summary
    assert np.array_equal(again.posterior, found.posterior)
    text = found.posterior_toml()
    import tomllib

    table = tomllib.loads(text)["wear"]["cylinder"]["k_over_h"]
    scenario = rig().changed({"wear.cylinder.k_over_h": table})
    (item,) = scenario.random
    low, high = item.scalar.quantile(np.array([0.025, 0.975]))
    following = found.summary["next_specimen"]
    assert high / low == pytest.approx(following["high_per_Pa"] / following["low_per_Pa"], rel=1e-3)
    with pytest.raises(wearsim.ResultsFileError, match="exists"):
        wearsim.identify(rig(), tests, path)


def test_groove_of_another_rig_is_refused(tmp_path: Path):
    y, height = groove(np.random.default_rng(1))
    wide = write(tmp_path / "t.csv", 1.45 * y, height)
    with pytest.raises(ScenarioError, match="is it of another rig"):
        wearsim.identify(rig(), [wide])
    found = wearsim.identify(rig(), [write(tmp_path / "u.csv", 1.15 * y, height)])
    assert any("another rig" in text for text in found.warnings)


def test_bow_of_a_trace_is_fitted_where_it_is_asked_for(tmp_path: Path):
    y, height = groove(np.random.default_rng(3), half=12e-3)
    path = write(tmp_path / "t.csv", y, height + 3e-6 * (y / 12e-3) ** 2)
    straight, curved = (wearsim.identify(rig(), [path], curvature=c) for c in (False, True))
    (low, high) = (curved.tests[0]["k_over_h_per_Pa"][end] for end in ("low", "high"))
    assert low < K < high
    assert not low < straight.tests[0]["k_over_h_per_Pa"]["value"] < high
    # the bow may be seen in the measured depth too
    assert any("may follow a curvature of the trace" in text for text in straight.warnings)
    assert curved.warnings == ()
    assert curved.raw.measured[0]["curvature"] is True


def test_curvature_without_shoulders_is_refused(tmp_path: Path):
    path = write(tmp_path / "t.csv", *groove(np.random.default_rng(1), half=7.2e-3))
    with pytest.raises(ScenarioError, match="cannot be distinguished from the groove"):
        wearsim.identify(rig(), [path], curvature=True)


def test_measured_depth_differs_where_the_wear_of_the_roller_is_ignored(tmp_path: Path):
    both = rig().changed({"wear.roller.k_over_h": "4e-12 1/Pa"})
    run = wearsim.run(both)
    y = np.arange(-12e-3, 12e-3, 40e-6)
    worn = np.interp(y, run.y, run.profiles[-1])
    noise = NOISE.sample(y, np.random.default_rng(1).standard_normal((2, len(y))))
    path = write(tmp_path / "t.csv", y, noise - worn)
    (test,) = (found := wearsim.identify(rig(), [path])).tests
    low, high = test["depth_interval_m"]
    assert low < run.depth[-1] < high
    assert not test["model_depth_interval_m"][0] < run.depth[-1] < test["model_depth_interval_m"][1]
    assert any("does the roller wear too" in text for text in found.warnings)
    (shared,) = wearsim.identify(both, [path], share=("cylinder", "roller")).tests
    low, high = shared["model_depth_interval_m"]
    assert low < run.depth[-1] < high


def test_shallow_groove_is_left_out_with_a_warning(tmp_path: Path):
    rng = np.random.default_rng(1)
    good = write(tmp_path / "t.csv", *groove(rng))
    y = np.arange(-11e-3, 11e-3, 40e-6)
    flat = 1e-6 * (np.abs(y) > 1e-3) + NOISE.sample(y, rng.standard_normal((2, len(y))))
    shallow = write(tmp_path / "s.csv", y, flat)
    found = wearsim.identify(rig(), [good, shallow])
    assert [test["file"] for test in found.tests] == [str(good)]
    assert any("s.csv is left out" in text for text in found.warnings)
    with pytest.raises(ScenarioError, match="no groove can be used"):
        wearsim.identify(rig(), [shallow])


def test_power_is_that_of_a_plan_of_the_same_tests(monkeypatch: pytest.MonkeyPatch):
    scenario = rig(random=True)
    (plan,) = plan_tests(scenario, [3], draws=32)
    reached = float(closed_form_depths(scenario, {}, 1)[0])
    error = DEPTH_ERROR * reached
    tests = [Measurement(f"test {n}", depth=reached, depth_std=error) for n in range(3)]
    found = wearsim.identify(scenario, tests, draws=32).summary["to_decide"]
    assert found["power"] == plan.random[0.4][0]
    assert found["tests"] == plan.needed[0.4]


def test_groove_wider_than_the_trace_is_refused(tmp_path: Path):
    path = write(tmp_path / "t.csv", *groove(np.random.default_rng(1), half=4e-3))
    with pytest.raises(ScenarioError, match="may be wider than the trace"):
        wearsim.identify(rig(), [path])


def test_trace_without_shoulders_knows_less(tmp_path: Path):
    paths = [
        write(tmp_path / f"{half}.csv", *groove(np.random.default_rng(1), half=half))
        for half in (7.4e-3, 12e-3)
    ]
    test, longer = (wearsim.identify(rig(), [path]).tests[0] for path in paths)
    k, best = test["k_over_h_per_Pa"], longer["k_over_h_per_Pa"]
    assert k["low"] < K < k["high"]
    assert np.log(k["high"] / k["low"]) > 1.2 * np.log(best["high"] / best["low"])
    assert test["depth_m"] is None
    assert test["residual_ratio"] is None


def test_scenarios_without_a_wear_factor_are_refused():
    text = rig().text[: rig().text.index("[wear]")]
    scenario = wearsim.Scenario.from_toml(text + '[wear]\nlaw = "t-gamma"\n')
    with pytest.raises(CapabilityError, match="needs the wear factor"):
        wearsim.identify(scenario, [depth(48.0)])
    with pytest.raises(ScenarioError, match="where the search begins"):
        wearsim.identify(rig().changed({"wear.cylinder.k_over_h": "0 1/Pa"}), [depth(48.0)])
    assert set(RANDOM) == {item.name for item in rig(random=True).random}
    assert rig().total_passes == PASSES


def test_more_draws_are_taken_where_few_describe_a_groove(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(trajectories, "DRAWS", 16)
    monkeypatch.setattr(api, "FEW_DRAWS", 0.0)
    few = wearsim.identify(rig(random=True), [depth(48.0)])
    assert few.tests[0]["effective_draws"] <= 16
    monkeypatch.setattr(api, "FEW_DRAWS", 20.0)
    monkeypatch.setattr(api, "MOST_DRAWS", 32)
    more = wearsim.identify(rig(random=True), [depth(48.0)])
    assert more.tests[0]["effective_draws"] > 25
    given = wearsim.identify(rig(random=True), [depth(48.0)], draws=16)
    assert given.tests[0]["effective_draws"] <= 16
    assert any("give more with --draws" in text for text in given.warnings)


def test_repeated_tests_of_a_specimen_share_the_wear_factor():
    alone = wearsim.identify(rig(random=True), [depth(48.0)], draws=32)
    tests = [depth(48.0, group="A"), depth(48.5, group="A"), depth(47.5, group="A")]
    found = wearsim.identify(rig(random=True), tests, draws=32)
    assert found.raw.specimens == ["A"]
    assert found.summary["exponents"] == {}
    widths = [r.summary["scatter_from_inputs"] for r in (alone, found)]
    assert widths[1] == pytest.approx(widths[0] / np.sqrt(3.0), rel=0.15)


def test_result_is_a_dataset_of_xarray():
    found = wearsim.identify(rig(), [depth(48.0), depth(50.0)])
    dataset = found.to_xarray()
    assert dataset["posterior"].dims == ("scatter", "mean")
    total = (np.gradient(dataset["ln_k"]) * dataset["test_density"][0]).sum()
    assert float(total) == pytest.approx(1.0, abs=1e-3)
    assert found.plot(ax=None) is not None


def test_tests_of_one_specimen_with_unlike_errors_are_taken_together():
    tests = [Measurement("a", depth=48e-6, depth_std=std, group="one") for std in (0.01e-6, 10e-6)]
    found = wearsim.identify(rig(), tests)
    alone = wearsim.identify(rig(), tests[:1])
    ends = [item.summary["k_over_h_median_per_Pa"] for item in (found, alone)]
    assert list(ends[0].values()) == pytest.approx(list(ends[1].values()), rel=2e-3)
    assert not any("contradict" in text for text in found.warnings)


@pytest.mark.parametrize("at", [None, "200 min"])
def test_grooves_of_one_specimen_that_contradict_each_other_are_warned_of(at: str | None):
    first = "450 min" if at is None else "100 min"
    tests = [depth(20.0, group="one", at=first), depth(60.0, group="one", at=at)]
    found = wearsim.identify(rig(), tests)
    assert any("one: its grooves contradict each other" in text for text in found.warnings)


def test_interval_of_an_inaccurate_depth_holds_95_percent_of_its_likelihood():
    error = 0.2
    std = error * 48e-6
    found = wearsim.identify(rig(), [Measurement("a", depth=48e-6, depth_std=std)]).tests[0]
    logs = np.linspace(math.log(1.0 - 4.0 * error), math.log(1.0 + 4.0 * error), 20_001)
    weight = np.exp(-0.5 * ((np.exp(logs) - 1.0) / error) ** 2)
    factors = 1.5 * logs + math.log(K * (48.0 / 48.11) ** 1.5)  # rigid bodies in full slip
    low, high = (math.log(found["k_over_h_per_Pa"][end]) for end in ("low", "high"))
    inside = (factors > low) & (factors < high)
    assert weight[inside].sum() / weight.sum() == pytest.approx(0.95, abs=0.015)


@pytest.mark.parametrize(
    ("size", "std", "message"),
    [
        (0.5, 1.0, "depth_std: is more than a quarter of the depth of 0.5 um"),
        (3000.0, 1.0, "depth: the worn depth of 3 mm exceeds a tenth of roller.radius"),
    ],
)
def test_depth_that_bounds_no_wear_factor_is_refused(size: float, std: float, message: str):
    with pytest.raises(ScenarioError, match=message):
        wearsim.identify(rig(), [Measurement("a", depth=size * 1e-6, depth_std=std * 1e-6)])


@pytest.mark.parametrize(
    ("changes", "share"),
    [
        ({}, ()),
        ({"creepage.longitudinal": 2e-4}, ()),
        ({"load.kind": "spring", "load.stiffness": "690 N/mm"}, ()),
        ({"wear.roller.k_over_h": "2e-12 1/Pa"}, ("cylinder", "roller")),
    ],
)
@pytest.mark.parametrize("minutes", [20.0, 100.0])
def test_depth_measured_before_the_end_of_the_test_gives_the_wear_factor(changes, share, minutes):
    worn = wearsim.run(rig().changed({**changes, "operation.duration": f"{minutes:g} min"}))
    body = "roller" if share else "cylinder"
    size = float(np.max(worn.roller_depth[-1] if share else worn.depth[-1]))
    test = Measurement("a", depth=size, depth_std=0.02 * size, at=f"{minutes:g} min", body=body)
    # the search begins at a wear factor that is far too small
    begin = {"wear.cylinder.k_over_h": "1.1e-13 1/Pa"}
    if share:
        begin["wear.roller.k_over_h"] = "2e-14 1/Pa"
    (found,) = wearsim.identify(rig().changed({**changes, **begin}), [test], share=share).tests
    assert found["k_over_h_per_Pa"]["value"] == pytest.approx(K, rel=5e-3)
    energy, error = worn.dissipated_energy[-1], worn.errors["dissipated_energy"][-1]
    assert found["energy_J"]["value"] == pytest.approx(energy, rel=5e-3 + error / energy)
    assert found["model_depth_m"] == pytest.approx(size, rel=2e-3)


def test_depth_that_a_mounting_spring_does_not_permit_is_refused():
    scenario = rig().changed(
        {"load.kind": "spring", "load.stiffness": "20 N/um"}
    )  # unloaded after 15 um
    with pytest.raises(ScenarioError, match="no draw of the inputs describes this groove"):
        wearsim.identify(scenario, [depth(48.0)])


def test_tests_that_rigid_bodies_do_not_wear_are_identified_and_not_planned():
    rolling = {"creepage.longitudinal": 0.0, "creepage.differential_slip": True}
    scenario = rig().changed({**rolling, "operation.duration": "100 min"})
    worn = float(wearsim.run(scenario).depth[-1])
    begin = scenario.changed({"wear.cylinder.k_over_h": "1.1e-12 1/Pa"})
    (found,) = wearsim.identify(begin, [Measurement("a", depth=worn, depth_std=0.02 * worn)]).tests
    assert found["k_over_h_per_Pa"]["low"] < K < found["k_over_h_per_Pa"]["high"]
    with pytest.raises(CapabilityError, match="in full slip, which is zero"):
        plan_tests(scenario, [3])
