"""Ensembles of whole wear tests: the same whoever runs them, and nothing lost."""

from __future__ import annotations

from contextlib import nullcontext

import numpy as np
import pytest

import wearsim
from tests.studies.ensemble_cases import LOGNORMAL, frail, small, unlike
from tests.studies.random_examples import CREEPAGE, FRICTION, LOAD, SLACK, scenario_of
from wearsim.errors import CapabilityError, Interrupted, ResultsFileError, ScenarioError
from wearsim.results import open_ensemble
from wearsim.studies.ensemble import driver as ensemble_work
from wearsim.studies.ensemble.api import ensemble, resume_ensemble

SERIAL = {"scheduler": "serial"}


@pytest.fixture(scope="module")
def twelve(tmp_path_factory):
    path = tmp_path_factory.mktemp("twelve") / "twelve.h5"
    return ensemble(small(), 12, path, **SERIAL)


def test_that_every_realisation_is_a_whole_test(twelve):
    assert (twelve.count, twelve.failed, twelve.finished) == (12, 0, True)
    for number in (0, 7):
        alone = wearsim.run(small(sampling__realisation=number))
        assert twelve.at_end("depth")[number] == pytest.approx(float(alone.depth[-1]), rel=2e-3)
        assert twelve.at_end("worn_volume")[number] == pytest.approx(
            float(alone.worn_volume[-1]), rel=2e-3
        )
        drawn = alone.drawn["wear.cylinder.k_over_h"]
        assert twelve.inputs["wear.cylinder.k_over_h"][number] == drawn[0]


def test_that_worn_volume_is_wear_factor_times_energy_in_every_realisation(twelve):
    factor = twelve.inputs["wear.cylinder.k_over_h"]
    energy, volume = twelve.at_end("dissipated_energy"), twelve.at_end("worn_volume")
    np.testing.assert_allclose(volume, factor * energy, rtol=1e-12)


def test_that_records_hold_the_course_of_every_test(twelve):
    depth = twelve.values("depth")
    assert depth.shape == (12, len(twelve.record_passes))
    assert (depth[:, 0] == 0.0).all()
    assert (np.diff(depth, axis=1) > 0.0).all()
    assert twelve.record_passes[-1] == 3000.0
    course = twelve.course("depth")
    np.testing.assert_allclose(course.mean, depth.mean(axis=0))
    assert (course.quantiles[0.05] <= course.quantiles[0.95]).all()


def test_that_profiles_are_those_of_the_depths(twelve):
    np.testing.assert_array_equal(twelve.profiles.max(axis=1), twelve.at_end("depth"))
    band = twelve.band()
    assert band.kept == 12
    assert (band.low <= band.mean).all()
    assert (band.mean <= band.high).all()


@pytest.mark.parametrize(
    "options",
    [
        {"scheduler": "processes", "workers": 1},
        {"scheduler": "processes", "workers": 3},
        {"scheduler": "threads", "workers": 2},
    ],
)
def test_that_workers_change_no_bit(twelve, tmp_path, options):
    other = ensemble(small(), 12, tmp_path / "other.h5", **options)
    assert unlike(twelve, other) == []


@pytest.mark.parametrize("size", [1, 5])
def test_that_batches_change_no_bit(twelve, tmp_path, monkeypatch, size):
    monkeypatch.setattr(ensemble_work.EnsembleWork, "_batch_size", lambda self: size)
    assert unlike(twelve, ensemble(small(), 12, tmp_path / "other.h5", **SERIAL)) == []


def test_that_order_changes_no_bit(twelve, tmp_path, monkeypatch):
    def backwards(self):
        yield from np.flatnonzero(self.file.status == 0).tolist()[::-1]

    monkeypatch.setattr(ensemble_work.EnsembleWork, "_pending", backwards)
    assert unlike(twelve, ensemble(small(), 12, tmp_path / "other.h5", **SERIAL)) == []


def test_that_a_greater_ensemble_begins_with_the_smaller_one(twelve, tmp_path):
    more = ensemble(small(), 14, tmp_path / "more.h5", **SERIAL)
    for name in ("depth", "worn_volume", "creepage.yaw"):
        np.testing.assert_array_equal(more.values(name)[:12], twelve.values(name))


def test_that_another_seed_gives_another_ensemble(twelve, tmp_path):
    other = ensemble(small(seed=2), 3, tmp_path / "other.h5", **SERIAL)
    assert not np.isin(other.at_end("depth"), twelve.at_end("depth")).any()


@pytest.mark.parametrize("scheduler", ["serial", "processes"])
def test_that_a_stopped_ensemble_goes_on_as_if_unbroken(twelve, tmp_path, monkeypatch, scheduler):
    monkeypatch.setattr(ensemble_work.EnsembleWork, "_batch_size", lambda self: 2)
    path = tmp_path / "part.h5"
    answers = iter([True])
    with pytest.raises(Interrupted, match=r"wearsim resume .*part\.h5"):
        ensemble(small(), 12, path, scheduler=scheduler, stop_requested=lambda: next(answers, True))
    part = open_ensemble(path)
    assert 0 < part.count < 12
    assert not part.finished
    whole = resume_ensemble(path, **SERIAL)
    assert whole.finished
    assert unlike(twelve, whole) == []


def test_that_a_finished_ensemble_is_resumed_to_itself(twelve):
    before = twelve.path.read_bytes()
    assert resume_ensemble(twelve.path).count == 12
    assert twelve.path.read_bytes() == before


def test_that_nothing_is_overwritten_unasked(twelve):
    with pytest.raises(ResultsFileError, match="already exists"):
        ensemble(small(), 12, twelve.path)


def test_that_failed_realisations_are_kept_with_their_errors(tmp_path):
    result = ensemble(frail(), 12, tmp_path / "frail.h5", **SERIAL)
    assert 0 < result.failed < 12
    assert result.count + result.failed == 12
    assert result.finished
    assert all(text for text in result.errors.values())
    assert np.isfinite(result.at_end("depth")).all()
    assert result.estimate("depth").count == result.count


def test_that_failed_realisations_alone_run_once_more(tmp_path, monkeypatch):
    from wearsim.studies.ensemble.realisation import RealisationRunner

    whole = ensemble(small(), 8, tmp_path / "whole.h5", **SERIAL)
    run = RealisationRunner._prepare

    def failing(self, number, *rest):
        if number in {2, 5}:
            raise wearsim.errors.StepError("no step is short enough")
        return run(self, number, *rest)

    monkeypatch.setattr(RealisationRunner, "_prepare", failing)
    path = tmp_path / "failing.h5"
    assert sorted(ensemble(small(), 8, path, **SERIAL).errors) == [2, 5]
    assert resume_ensemble(path, **SERIAL).failed == 2  # no more than asked for

    def failing_if_done_again(self, number, *rest):
        if number not in {2, 5}:
            raise wearsim.errors.StepError("was done before")
        return run(self, number, *rest)

    monkeypatch.setattr(RealisationRunner, "_prepare", failing_if_done_again)
    again = resume_ensemble(path, failed=True, **SERIAL)
    assert unlike(again, whole) == []


def test_that_a_kill_while_failed_ones_run_once_more_costs_nothing(tmp_path, monkeypatch):
    from wearsim.studies.ensemble.realisation import RealisationRunner

    monkeypatch.setattr(ensemble_work.EnsembleWork, "_batch_size", lambda self: 1)
    whole = ensemble(small(), 6, tmp_path / "whole.h5", **SERIAL)
    run = RealisationRunner._prepare

    def failing(self, number, *rest):
        if number in {2, 4}:
            raise wearsim.errors.StepError("no step is short enough")
        return run(self, number, *rest)

    monkeypatch.setattr(RealisationRunner, "_prepare", failing)
    path = tmp_path / "failing.h5"
    ensemble(small(), 6, path, **SERIAL)

    def killed(self, number, *rest):
        if number == 4:
            raise SystemExit  # as a kill would: nothing after it is written
        return run(self, number, *rest)

    monkeypatch.setattr(RealisationRunner, "_prepare", killed)
    with pytest.raises(SystemExit):
        resume_ensemble(path, failed=True, **SERIAL)
    assert not open_ensemble(path).finished
    monkeypatch.setattr(RealisationRunner, "_prepare", run)
    assert unlike(resume_ensemble(path, **SERIAL), whole) == []


def test_that_failed_ones_count_for_the_target_once_they_have_run(tmp_path, monkeypatch):
    from wearsim.studies.ensemble.realisation import RealisationRunner

    monkeypatch.setattr("wearsim.studies.ensemble.designs.FIRST_ANALYSIS", 32)
    whole = ensemble(small(), 90, tmp_path / "whole.h5", until="depth.mean 8%", **SERIAL)
    run = RealisationRunner._prepare

    def failing(self, number, *rest):
        if number % 9 == 0:
            raise wearsim.errors.StepError("no step is short enough")
        return run(self, number, *rest)

    monkeypatch.setattr(RealisationRunner, "_prepare", failing)
    path = tmp_path / "failing.h5"
    ensemble(small(), 90, path, until="depth.mean 8%", **SERIAL)
    monkeypatch.setattr(RealisationRunner, "_prepare", run)
    again = resume_ensemble(path, failed=True, **SERIAL)
    estimate = again.estimate("depth").mean
    assert again.finished
    assert again.failed == 0
    assert estimate.half_width <= 0.08 * estimate.value
    np.testing.assert_array_equal(again.at_end("depth")[:32], whole.at_end("depth")[:32])


def test_that_a_value_that_is_not_finite_fails_its_realisation_alone(tmp_path, monkeypatch):
    from wearsim.studies.ensemble import realisation as member

    observed = member.observe

    def spoilt(group):
        found = observed(group)
        for each, one in zip(group, found, strict=True):
            if each.number == 1:
                one.rows[-1]["peak_pressure"] = np.nan
        return found

    monkeypatch.setattr(member, "observe", spoilt)
    result = ensemble(small(), 3, tmp_path / "e.h5", **SERIAL)
    assert result.errors == {1: "peak_pressure is not finite at record 2"}
    assert result.finished


def test_that_a_straggler_holds_no_more_than_a_few_back(tmp_path, monkeypatch):
    from wearsim.studies.ensemble.driver import AHEAD, EnsembleWork

    monkeypatch.setattr(EnsembleWork, "_batch_size", lambda self: 1)
    taken, greatest = EnsembleWork._take, []

    def watched(self, outcomes):
        taken(self, outcomes)
        greatest.append(len(self._deferred))

    monkeypatch.setattr(EnsembleWork, "_take", watched)
    monkeypatch.setattr("wearsim.studies.ensemble.designs.FIRST_ANALYSIS", 4)

    class Late:
        """Has the first batch done last."""

        workers, describe = 1, "one that is late"

        def results(self, work, batches):
            outcomes = [(batch, work(batch)) for batch in batches]
            yield from [*outcomes[1:], *outcomes[:1]]

    monkeypatch.setattr(
        "wearsim.studies.ensemble.api.executor", lambda *_, **__: nullcontext(Late())
    )
    result = ensemble(small(), 20, tmp_path / "e.h5", until="depth.mean 0.01%")
    assert result.count == 20
    assert max(greatest) <= AHEAD


def test_that_a_plugins_mistake_ends_one_realisation_alone(tmp_path, monkeypatch):
    from wearsim.studies.ensemble.realisation import RealisationRunner

    run = RealisationRunner._prepare

    def failing(self, number, *rest):
        return run(self, number, *rest) if number != 1 else 1 / 0

    monkeypatch.setattr(RealisationRunner, "_prepare", failing)
    result = ensemble(small(), 3, tmp_path / "e.h5", **SERIAL)
    assert result.errors == {1: "ZeroDivisionError: division by zero"}


def test_that_an_ensemble_ends_where_its_target_is_reached(tmp_path):
    options = {"until": "depth.mean 8%", **SERIAL}
    result = ensemble(small(), 1000, tmp_path / "until.h5", **options)
    estimate = result.estimate("depth").mean
    assert result.finished
    assert result.count < 1000
    assert estimate.half_width <= 0.08 * estimate.value
    # it would not have ended at the look before
    before = result.at_end("depth")[: int(result.count / 1.1)]
    if result.count > 64:
        assert 1.96 * before.std() / np.sqrt(len(before)) > 0.08 * before.mean()
    several = ensemble(
        small(), 1000, tmp_path / "two.h5", until="depth.mean 8%", scheduler="threads", workers=3
    )
    assert unlike(result, several) == []


def test_that_a_target_out_of_reach_is_told(tmp_path):
    result = ensemble(small(), 6, tmp_path / "e.h5", until="depth.q95 1%", **SERIAL)
    assert result.count == 6
    assert any("depth.q95 1%" in text for text in result.warnings)


@pytest.mark.parametrize(
    ("plan", "words"), [("latin-hypercube", "cannot grow"), ("saltelli", "chosen beforehand")]
)
def test_that_what_cannot_grow_refuses_a_target(tmp_path, plan, words):
    with pytest.raises(ScenarioError, match=words):
        ensemble(small(), 6, tmp_path / "e.h5", plan=plan, until="depth.mean 1%")
    assert not (tmp_path / "e.h5").exists()


@pytest.mark.parametrize("plan", ["latin-hypercube", "sobol", "control-variate", "saltelli"])
def test_that_every_plan_goes_on_as_if_unbroken(tmp_path, plan):
    whole = ensemble(small(), 12, tmp_path / "whole.h5", plan=plan, **SERIAL)
    path, answers = tmp_path / "part.h5", iter([True])
    with pytest.raises(Interrupted):
        ensemble(small(), 12, path, plan=plan, stop_requested=lambda: next(answers, True), **SERIAL)
    assert unlike(resume_ensemble(path, **SERIAL), whole) == []


def test_that_a_control_variate_saves_variance(tmp_path):
    # tests long enough to forget the fresh contact, which the closed form knows nothing of
    scenario = small(passes=6000, wear__cylinder__k_over_h={**LOGNORMAL, "median": "1e-8 1/Pa"})
    result = ensemble(scenario, 24, tmp_path / "e.h5", plan="control-variate", **SERIAL)
    estimate = result.estimate("depth")
    assert estimate.variance_saved > 0.8
    plain = 1.96 * result.at_end("depth").std(ddof=1) / np.sqrt(24)
    assert estimate.mean.half_width < 0.6 * plain


def test_that_saltellis_rows_are_whole_and_their_inputs_taken_in_turn(tmp_path):
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


def test_that_saltellis_blocks_are_those_of_their_inputs_with_a_process_among_them(tmp_path):
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


def test_that_a_control_is_left_out_where_realisations_fail(tmp_path):
    result = ensemble(frail(), 12, tmp_path / "e.h5", plan="control-variate", **SERIAL)
    assert 0 < result.failed < 12
    estimate = result.estimate("depth")
    assert estimate.variance_saved is None
    assert estimate.mean.value == pytest.approx(result.at_end("depth").mean())
    assert any("plain Monte Carlo" in text for text in result.warnings)


def test_that_correlated_inputs_are_told_with_what_they_move(tmp_path):
    ties = [["load.normal_force", "creepage.longitudinal", 0.6]]
    result = ensemble(small(sampling__correlation=ties), 4, tmp_path / "e.h5", **SERIAL)
    assert any("correlated" in text for text in result.warnings)


def test_that_inputs_without_effect_are_told(tmp_path):
    # a roller that does not wear: its slack does not matter where all contacts slide and none moves
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


def test_that_nothing_random_is_refused(tmp_path):
    with pytest.raises(ScenarioError, match="no random input differs between realisations"):
        ensemble(scenario_of(), 4, tmp_path / "e.h5")
    averaged = scenario_of(friction__coefficient={**FRICTION, "persistence": "per-pass"})
    with pytest.raises(ScenarioError, match="drawn at every pass are averaged"):
        ensemble(averaged, 4, tmp_path / "e.h5")


def test_that_passes_solved_one_by_one_tell_tests_apart(tmp_path):
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


def test_that_a_model_without_what_is_asked_is_refused_before_anything_is_written(tmp_path):
    scenario = small(contact__model="hertz-fastsim", evolution__stepper="implicit")
    with pytest.raises(CapabilityError, match="takes no wear compliance"):
        ensemble(scenario, 4, tmp_path / "e.h5")
    assert not (tmp_path / "e.h5").exists()


def test_that_draws_per_roller_scatter_less_than_draws_per_test(tmp_path):
    """Three rollers share a groove: with draws of their own, volume scatters by 1/sqrt(3)."""
    spreads = []
    for persistence in ("per-test", "per-roller"):
        inputs = {
            key: {**law, "persistence": persistence}
            for key, law in (
                ("load__normal_force", LOAD),
                ("creepage__longitudinal", CREEPAGE),
                ("creepage__misalignment", SLACK),
            )
        }
        scenario = scenario_of(
            3000, contact__strips=41, evolution__tolerance=1e-2, outputs__records=1, **inputs
        )
        result = ensemble(scenario, 60, tmp_path / f"{persistence}.h5")
        volume, power = result.at_end("worn_volume"), result.at_end("mean_power")
        depth = result.at_end("depth")
        spread = volume.std(ddof=1) / volume.mean()
        assert power.std(ddof=1) / power.mean() == pytest.approx(spread, rel=1e-9)
        assert 0.55 < depth.std(ddof=1) / depth.mean() / spread < 0.8
        spreads.append(spread)
    # the ratio of two such estimates has a standard error of a seventh
    assert spreads[1] / spreads[0] == pytest.approx(1.0 / np.sqrt(3.0), rel=0.4)
