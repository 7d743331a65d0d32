"""Ensembles of wear tests: reproducibility, restart, failures and stopping rule."""

from __future__ import annotations

from contextlib import nullcontext
from functools import cache
from itertools import chain

import numpy as np
import pytest

import wearsim
from tests.fixed_batches import batches_of
from tests.studies.ensemble_cases import LOGNORMAL, differences, small
from tests.studies.random_examples import CREEPAGE, FRICTION, LOAD, SLACK, scenario_of
from wearsim.errors import CapabilityError, Interrupted, ResultsFileError, ScenarioError
from wearsim.studies.ensemble.api import ensemble, resume_ensemble
from wearsim.studies.ensemble.designs import interim_sizes
from wearsim.studies.ensemble.driver import AHEAD
from wearsim.studies.opening import open_ensemble
from wearsim.uq.estimation.intervals import t_interval

SERIAL = {"scheduler": "serial"}


@pytest.fixture(scope="module")
def twelve(tmp_path_factory):
    path = tmp_path_factory.mktemp("twelve") / "twelve.h5"
    return ensemble(small(), 12, path, **SERIAL)


def test_realisation_agrees_with_single_run(twelve):
    assert (twelve.count, twelve.failed, twelve.finished) == (12, 0, True)
    for number in (0, 7):
        single = wearsim.run(small(sampling__realisation=number))
        assert twelve.at_end("depth")[number] == pytest.approx(float(single.depth[-1]), rel=2e-3)
        assert twelve.at_end("worn_volume")[number] == pytest.approx(
            float(single.worn_volume[-1]), rel=2e-3
        )
        drawn = single.drawn["wear.cylinder.k_over_h"]
        assert twelve.inputs["wear.cylinder.k_over_h"][number] == drawn[0]


def test_worn_volume_is_wear_factor_times_energy(twelve):
    factor = twelve.inputs["wear.cylinder.k_over_h"]
    energy, volume = twelve.at_end("dissipated_energy"), twelve.at_end("worn_volume")
    np.testing.assert_allclose(volume, factor * energy, rtol=1e-12)


def test_records_hold_the_history_of_every_test(twelve):
    depth = twelve.values("depth")
    assert depth.shape == (12, len(twelve.record_passes))
    assert (depth[:, 0] == 0.0).all()
    assert (np.diff(depth, axis=1) > 0.0).all()
    assert twelve.record_passes[-1] == 3000.0
    history = twelve.course("depth")
    np.testing.assert_allclose(history.mean, depth.mean(axis=0))
    assert (history.quantiles[0.05] <= history.quantiles[0.95]).all()


def test_maxima_of_profiles_are_the_depths(twelve):
    np.testing.assert_array_equal(twelve.profiles.max(axis=1), twelve.at_end("depth"))
    band = twelve.band()
    assert band.kept == 12
    assert (band.low <= band.mean).all()
    assert (band.mean <= band.high).all()


@pytest.mark.parametrize(
    "options",
    [
        {"scheduler": "processes", "workers": 1},
        # a study of lives is run by two processes in a quick test, and an ensemble stopped in them
        pytest.param({"scheduler": "processes", "workers": 2}, marks=pytest.mark.slow),
        {"scheduler": "threads", "workers": 2},
    ],
)
def test_results_are_bitwise_independent_of_workers(twelve, tmp_path, monkeypatch, options):
    monkeypatch.setattr("wearsim.studies.ensemble.driver.BatchSizes", batches_of(3))
    other = ensemble(small(), 12, tmp_path / "other.h5", **options)
    assert differences(twelve, other) == []


@pytest.mark.parametrize("size", [1, 5])
def test_results_are_bitwise_independent_of_batches(twelve, tmp_path, monkeypatch, size):
    monkeypatch.setattr("wearsim.studies.ensemble.driver.BatchSizes", batches_of(size))
    assert differences(twelve, ensemble(small(), 12, tmp_path / "other.h5", **SERIAL)) == []


class Backwards:
    """Executor that takes all batches, and runs them from the last to the first."""

    workers, describe = 1, "1 worker"

    def results(self, work, batches):
        for batch in list(batches)[::-1]:
            numbers = batch[::-1]
            yield numbers, work(numbers)


def test_results_are_bitwise_independent_of_order(twelve, tmp_path, monkeypatch):
    monkeypatch.setattr("wearsim.studies.ensemble.driver.BatchSizes", batches_of(4))
    monkeypatch.setattr(
        "wearsim.studies.ensemble.api.executor", lambda *_, **__: nullcontext(Backwards())
    )
    assert differences(twelve, ensemble(small(), 12, tmp_path / "other.h5", **SERIAL)) == []


def test_larger_ensemble_starts_with_the_smaller_one(twelve, tmp_path):
    more = ensemble(small(), 14, tmp_path / "more.h5", **SERIAL)
    for name in ("depth", "worn_volume", "creepage.yaw"):
        np.testing.assert_array_equal(more.values(name)[:12], twelve.values(name))


@pytest.fixture(scope="module")
def whole_of(twelve, tmp_path_factory):
    """Return a function of the plan: an ensemble of twelve tests, computed once."""

    @cache
    def whole(plan):
        if plan == "monte-carlo":
            return twelve
        path = tmp_path_factory.mktemp(plan) / "whole.h5"
        return ensemble(small(), 12, path, plan=plan, **SERIAL)

    return whole


@pytest.mark.parametrize("plan", ["monte-carlo", "sobol", "control-variate"])
def test_extended_ensemble_equals_the_larger_one(tmp_path, monkeypatch, whole_of, plan):
    monkeypatch.setattr("wearsim.studies.ensemble.driver.BatchSizes", batches_of(4))
    whole = whole_of(plan)
    path = tmp_path / "grown.h5"
    ensemble(small(), 4, path, plan=plan, **SERIAL)
    with pytest.raises(Interrupted):
        resume_ensemble(path, realisations=12, stop_requested=lambda: True, **SERIAL)
    assert not open_ensemble(path).finished
    assert open_ensemble(path).requested == 12
    grown = resume_ensemble(path, **SERIAL)
    assert differences(grown, whole) == []
    assert grown.raw.control == whole.raw.control
    with pytest.raises(ResultsFileError, match="has 12 realisations; give a larger number"):
        resume_ensemble(path, realisations=5)


def test_seed_changes_the_ensemble(twelve, tmp_path):
    other = ensemble(small(seed=2), 3, tmp_path / "other.h5", **SERIAL)
    assert not np.isin(other.at_end("depth"), twelve.at_end("depth")).any()


@pytest.mark.parametrize("scheduler", ["serial", "processes"])
def test_resumed_ensemble_equals_unbroken_ensemble(twelve, tmp_path, monkeypatch, scheduler):
    size = 5 if scheduler == "serial" else 2  # processes are ahead by some batches
    monkeypatch.setattr("wearsim.studies.ensemble.driver.BatchSizes", batches_of(size))
    path = tmp_path / "part.h5"
    answers = iter([True])
    with pytest.raises(Interrupted, match=r"wearsim\.resume_ensemble.*part\.h5"):
        ensemble(
            small(),
            12,
            path,
            scheduler=scheduler,
            workers=1 if scheduler == "serial" else 2,
            stop_requested=lambda: next(answers, True),
        )
    part = open_ensemble(path)
    assert 0 < part.count < 12
    assert not part.finished
    whole = resume_ensemble(path, **SERIAL)
    assert whole.finished
    assert differences(twelve, whole) == []


def test_resuming_finished_ensemble_changes_nothing(twelve):
    before = twelve.path.read_bytes()
    assert resume_ensemble(twelve.path).count == 12
    assert twelve.path.read_bytes() == before


def test_existing_file_is_not_overwritten(twelve):
    with pytest.raises(ResultsFileError, match="already exists"):
        ensemble(small(), 12, twelve.path)


def test_time_left_is_estimated_from_three_batches_on(tmp_path, monkeypatch):
    monkeypatch.setattr("wearsim.studies.ensemble.driver.BatchSizes", batches_of(1))
    left: list[float] = []
    ensemble(
        small(), 5, tmp_path / "few.h5", on_progress=lambda now: left.append(now.left), **SERIAL
    )
    assert np.isnan(left).tolist() == [True, True, False, False, False]


def test_slow_batch_defers_few_outcomes(tmp_path, monkeypatch):
    monkeypatch.setattr("wearsim.studies.ensemble.driver.BatchSizes", batches_of(1))
    taken = []
    monkeypatch.setattr("wearsim.studies.ensemble.designs.FIRST_ANALYSIS", 4)

    class Late:
        """Executor that returns the first batch last."""

        workers, describe = 1, "1 late worker"

        def results(self, work, batches):
            outcomes = [(batch, work(batch)) for batch in batches]
            taken.append([number for batch, _ in outcomes for number in batch])
            yield from [*outcomes[1:], *outcomes[:1]]

    monkeypatch.setattr(
        "wearsim.studies.ensemble.api.executor", lambda *_, **__: nullcontext(Late())
    )
    result = ensemble(small(), 10, tmp_path / "e.h5", precision="depth.mean 0.01%")
    assert result.count == 10
    assert taken[0] == list(range(4 + AHEAD))  # up to the first analysis and beyond it
    assert sorted(chain(*taken)) == list(range(10))


def test_ensemble_stops_where_target_is_reached(tmp_path, monkeypatch):
    monkeypatch.setattr("wearsim.studies.ensemble.designs.FIRST_ANALYSIS", 32)
    monkeypatch.setattr("wearsim.studies.ensemble.driver.BatchSizes", batches_of(8))
    options = {"precision": "depth.mean 12%", **SERIAL}
    result = ensemble(small(), 1000, tmp_path / "until.h5", **options)
    estimate = result.estimate("depth").mean
    assert result.finished
    assert result.count < 1000
    assert estimate.half_width <= 0.12 * estimate.value
    # the target was not reached at the previous interim analysis
    sizes = interim_sizes("monte-carlo", 1000)
    count = sizes[sizes.index(result.count) - 1]
    before = result.at_end("depth")[:count]
    error = before.std(ddof=1) / np.sqrt(count)
    assert t_interval(before.mean(), error, count - 1).half_width > 0.12 * before.mean()
    several = ensemble(
        small(),
        1000,
        tmp_path / "two.h5",
        precision="depth.mean 12%",
        scheduler="threads",
        workers=2,
    )
    assert differences(result, several) == []


def test_unreached_target_is_reported(tmp_path):
    result = ensemble(small(), 6, tmp_path / "e.h5", precision="depth.q95 1%", **SERIAL)
    assert result.count == 6
    assert any("depth.q95 1%" in text for text in result.warnings)


@pytest.mark.parametrize(
    ("plan", "words"), [("latin-hypercube", "cannot grow"), ("saltelli", "chosen beforehand")]
)
def test_plan_of_fixed_size_refuses_a_target(tmp_path, plan, words):
    with pytest.raises(ScenarioError, match=words):
        ensemble(small(), 6, tmp_path / "e.h5", plan=plan, precision="depth.mean 1%")
    assert not (tmp_path / "e.h5").exists()


@pytest.mark.parametrize("plan", ["latin-hypercube", "sobol", "control-variate", "saltelli"])
def test_resumed_plan_equals_unbroken_plan(tmp_path, monkeypatch, whole_of, plan):
    whole = whole_of(plan)
    monkeypatch.setattr("wearsim.studies.ensemble.driver.BatchSizes", batches_of(6))
    path, answers = tmp_path / "part.h5", iter([True])
    with pytest.raises(Interrupted):
        ensemble(small(), 12, path, plan=plan, stop_requested=lambda: next(answers, True), **SERIAL)
    assert 0 < open_ensemble(path).count < 12
    assert differences(resume_ensemble(path, **SERIAL), whole) == []


def test_control_variate_reduces_variance(tmp_path):
    # in long tests the initial contact, which the closed form does not contain, is unimportant
    scenario = small(passes=6000, wear__cylinder__k_over_h={**LOGNORMAL, "median": "1e-8 1/Pa"})
    result = ensemble(scenario, 24, tmp_path / "e.h5", plan="control-variate", **SERIAL)
    estimate = result.estimate("depth")
    assert estimate.variance_saved > 0.8
    plain = 1.96 * result.at_end("depth").std(ddof=1) / np.sqrt(24)
    assert estimate.mean.half_width < 0.6 * plain


def test_saltelli_ensemble_has_whole_rows(tmp_path):
    result = ensemble(small(), 7, tmp_path / "e.h5", plan="saltelli", **SERIAL)
    groups = [item["name"] for item in result.raw.groups]
    size = len(groups) + 2
    assert result.count == 2 * size
    load = result.values("load.normal_force").reshape(2, size)
    place = 2 + groups.index("load.normal_force")
    np.testing.assert_array_equal(load[:, place], load[:, 1])
    others = [k for k in range(2, size) if k != place]
    assert (load[:, others] == load[:, :1]).all()
    yaw = result.values("creepage.yaw").reshape(2, size)
    tilt = result.values("creepage.tilt").reshape(2, size)
    slack = 2 + groups.index("creepage.misalignment")  # yaw and tilt are one group
    assert (yaw[:, slack] == yaw[:, 1]).all()
    assert (tilt[:, slack] == tilt[:, 1]).all()


def test_saltelli_blocks_include_processes(tmp_path):
    load = {"distribution": "ornstein-uhlenbeck", "correlation_time": "20 s", "marginal": LOAD}
    scenario = small(load__normal_force=load)
    result = ensemble(scenario, 7, tmp_path / "e.h5", plan="saltelli", **SERIAL)
    groups = [item["name"] for item in result.raw.groups]
    for name in groups:
        key = "creepage.yaw" if name == "creepage.misalignment" else name
        values = result.values(key).reshape(-1, len(groups) + 2)
        changed = values != values[:, :1]
        assert changed[:, [1, 2 + groups.index(name)]].all()
        assert changed.sum() == 2 * len(values)


def test_correlated_inputs_cause_a_warning(tmp_path):
    correlation = [["load.normal_force", "creepage.longitudinal", 0.6]]
    result = ensemble(small(sampling__correlation=correlation), 4, tmp_path / "e.h5", **SERIAL)
    assert any("correlated" in text for text in result.warnings)


def test_error_of_few_strips_is_stated_with_what_decreases_it(tmp_path):
    few = small(contact__strips=15, evolution__strip_error=True, evolution__tolerance=1e-3)
    result = ensemble(few, 2, tmp_path / "e.h5", **SERIAL)
    worst = 100.0 * (result.values("depth_error") / result.at_end("depth")).max()
    (text,) = [text for text in result.warnings if "estimated error of depth" in text]
    assert f"is {worst:.2g} % of the depth at most" in text
    assert "more contact.strips" in text


def test_inputs_without_effect_are_identified(tmp_path):
    # the worn volume does not depend on a tiny yaw of a roller that does not wear
    scenario = scenario_of(
        3000,
        LOGNORMAL,
        contact__strips=41,
        evolution__tolerance=1e-2,
        outputs__records=1,
        friction__coefficient=FRICTION,
        creepage__yaw={"distribution": "uniform", "low": "0 mrad", "high": "1e-6 mrad"},
    )
    result = ensemble(scenario, 64, tmp_path / "e.h5", **SERIAL)
    effects = {effect.name: effect for effect in result.sensitivity("worn_volume")}
    assert effects["creepage.yaw"].without_effect
    assert not effects["wear.cylinder.k_over_h"].without_effect
    assert effects["wear.cylinder.k_over_h"].first.value > 0.5


def test_scenario_without_random_inputs_is_refused(tmp_path):
    with pytest.raises(ScenarioError, match="no random input differs between realisations"):
        ensemble(scenario_of(), 4, tmp_path / "e.h5")
    averaged = scenario_of(friction__coefficient={**FRICTION, "persistence": "per-pass"})
    with pytest.raises(ScenarioError, match="drawn at every pass are averaged"):
        ensemble(averaged, 4, tmp_path / "e.h5")


def test_per_pass_inputs_differ_between_realisations(tmp_path):
    scenario = scenario_of(
        200,
        contact__strips=41,
        evolution__stepper="per-pass",
        outputs__records=1,
        friction__coefficient={**FRICTION, "persistence": "per-pass"},
    )
    result = ensemble(scenario, 4, tmp_path / "e.h5", **SERIAL)
    assert len(set(result.at_end("depth"))) == 4
    assert result.sensitivity() == []


def test_unsupported_model_is_refused_before_writing(tmp_path):
    scenario = small(contact__model="hertz-fastsim", evolution__stepper="implicit")
    with pytest.raises(CapabilityError, match="takes no wear compliance"):
        ensemble(scenario, 4, tmp_path / "e.h5")
    assert not (tmp_path / "e.h5").exists()


def test_per_roller_inputs_scatter_less_than_per_test(tmp_path):
    """Separate draws for three rollers of one groove reduce the scatter by 1/sqrt(3)."""
    spreads = []
    for persistence in ("per-test", "per-roller"):
        inputs = {
            key: {**table, "persistence": persistence}
            for key, table in (
                ("load__normal_force", LOAD),
                ("creepage__longitudinal", CREEPAGE),
                ("creepage__misalignment", SLACK),
            )
        }
        scenario = scenario_of(
            3000, contact__strips=41, evolution__tolerance=1e-2, outputs__records=1, **inputs
        )
        result = ensemble(scenario, 60, tmp_path / f"{persistence}.h5", **SERIAL)
        volume, power = result.at_end("worn_volume"), result.at_end("mean_power")
        depth = result.at_end("depth")
        spread = volume.std(ddof=1) / volume.mean()
        assert power.std(ddof=1) / power.mean() == pytest.approx(spread, rel=1e-9)
        assert 0.55 < depth.std(ddof=1) / depth.mean() / spread < 0.8
        spreads.append(spread)
    # the ratio of two such estimates has a standard error of a seventh
    assert spreads[1] / spreads[0] == pytest.approx(1.0 / np.sqrt(3.0), rel=0.4)
