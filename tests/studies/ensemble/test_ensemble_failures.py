"""Failed realisations of ensembles: storage, repetition and effect on others."""

from __future__ import annotations

import numpy as np
import pytest

import wearsim
from tests.fixed_batches import batches_of
from tests.studies.ensemble_cases import differences, partly_failing, small
from wearsim.studies.ensemble.api import ensemble, resume_ensemble
from wearsim.studies.opening import open_ensemble

SERIAL = {"scheduler": "serial"}


def test_failed_realisations_are_stored_with_errors(tmp_path):
    result = ensemble(partly_failing(), 12, tmp_path / "failures.h5", **SERIAL)
    assert 0 < result.failed < 12
    assert result.count + result.failed == 12
    assert result.finished
    assert all(text for text in result.errors.values())
    assert np.isfinite(result.at_end("depth")).all()
    assert result.estimate("depth").count == result.count


def test_realisation_that_becomes_too_deep_fails_and_keeps_its_observables(tmp_path):
    deep = {"passes": 17_000, "contact__width": "130 mm", "outputs__records": 4}
    factor = {"distribution": "lognormal", "median": "1.2e-7 1/Pa", "factor": 1.5}
    scenario = small(wear__cylinder__k_over_h=factor, **deep)
    ended = ensemble(scenario, 6, tmp_path / "ended.h5", **SERIAL)
    allowed = scenario.changed({"evolution.allow_deep": True})
    whole = ensemble(allowed, 6, tmp_path / "whole.h5", **SERIAL)
    assert whole.count == 6
    beyond = whole.at_end("depth") > 0.1 * scenario.roller.radius
    assert sorted(ended.errors) == np.flatnonzero(beyond).tolist()
    assert 0 < ended.failed < 6
    for number, text in ended.errors.items():
        assert "exceeds a tenth of roller.radius = 20 mm" in text
        assert "lower operation.passes, or set evolution.allow_deep = true" in text
        kept = ended.raw.rows("depth", number, number + 1)[0]
        done = int(text.removeprefix("after pass ").split()[0])
        known = ended.record_passes <= done
        assert known.sum() > 1
        np.testing.assert_array_equal(np.isfinite(kept), known)
        np.testing.assert_array_equal(kept[known], whole.values("depth")[number][known])
    np.testing.assert_array_equal(ended.values("depth"), whole.values("depth")[~beyond])


def test_only_failed_realisations_run_again(tmp_path, monkeypatch):
    from wearsim.studies.ensemble.realisation import RealisationRunner

    whole = ensemble(small(), 8, tmp_path / "whole.h5", **SERIAL)
    run = RealisationRunner.prepare

    def failing(self, number, *rest):
        if number in {2, 5}:
            raise wearsim.errors.StepError("no step is short enough")
        return run(self, number, *rest)

    monkeypatch.setattr(RealisationRunner, "prepare", failing)
    path = tmp_path / "failing.h5"
    assert sorted(ensemble(small(), 8, path, **SERIAL).errors) == [2, 5]
    assert resume_ensemble(path, **SERIAL).failed == 2  # failed ones are run again on request only

    def failing_if_done_again(self, number, *rest):
        if number not in {2, 5}:
            raise wearsim.errors.StepError("has been completed before")
        return run(self, number, *rest)

    monkeypatch.setattr(RealisationRunner, "prepare", failing_if_done_again)
    again = resume_ensemble(path, failed=True, **SERIAL)
    assert differences(again, whole) == []


def test_kill_during_repetition_of_failed_loses_nothing(tmp_path, monkeypatch):
    from wearsim.studies.ensemble.realisation import RealisationRunner

    whole = ensemble(small(), 6, tmp_path / "whole.h5", **SERIAL)
    run = RealisationRunner.prepare

    def failing(self, number, *rest):
        if number in {2, 4}:
            raise wearsim.errors.StepError("no step is short enough")
        return run(self, number, *rest)

    monkeypatch.setattr(RealisationRunner, "prepare", failing)
    path = tmp_path / "failing.h5"
    ensemble(small(), 6, path, **SERIAL)
    monkeypatch.setattr("wearsim.studies.ensemble.driver.BatchSizes", batches_of(1))

    def killed(self, number, *rest):
        if number == 4:
            raise SystemExit  # like a kill, nothing is written after it
        return run(self, number, *rest)

    monkeypatch.setattr(RealisationRunner, "prepare", killed)
    with pytest.raises(SystemExit):
        resume_ensemble(path, failed=True, **SERIAL)
    assert not open_ensemble(path).finished
    monkeypatch.setattr(RealisationRunner, "prepare", run)
    assert differences(resume_ensemble(path, **SERIAL), whole) == []


def test_repeated_realisations_count_for_the_target(tmp_path, monkeypatch):
    from wearsim.studies.ensemble.realisation import RealisationRunner

    monkeypatch.setattr("wearsim.studies.ensemble.designs.FIRST_ANALYSIS", 16)
    monkeypatch.setattr("wearsim.studies.ensemble.driver.BatchSizes", batches_of(8))
    options = {"precision": "depth.mean 16%", **SERIAL}
    whole = ensemble(small(), 40, tmp_path / "whole.h5", **options)
    run = RealisationRunner.prepare

    def failing(self, number, *rest):
        if number % 9 == 0:
            raise wearsim.errors.StepError("no step is short enough")
        return run(self, number, *rest)

    monkeypatch.setattr(RealisationRunner, "prepare", failing)
    path = tmp_path / "failing.h5"
    ensemble(small(), 40, path, **options)
    monkeypatch.setattr(RealisationRunner, "prepare", run)
    again = resume_ensemble(path, failed=True, **SERIAL)
    estimate = again.estimate("depth").mean
    assert again.finished
    assert again.failed == 0
    assert estimate.half_width <= 0.16 * estimate.value
    np.testing.assert_array_equal(again.at_end("depth")[:16], whole.at_end("depth")[:16])


def test_nonfinite_value_fails_one_realisation_only(tmp_path, monkeypatch):
    from wearsim.studies.ensemble import realisation

    observe = realisation.observe

    def observe_with_nan(group):
        results = observe(group)
        for run, result in zip(group, results, strict=True):
            if run.number == 1:
                result.rows[-1]["peak_pressure"] = np.nan
        return results

    monkeypatch.setattr(realisation, "observe", observe_with_nan)
    result = ensemble(small(), 3, tmp_path / "e.h5", **SERIAL)
    assert result.errors == {1: "peak_pressure is not finite at record 2"}
    assert result.finished


def test_unexpected_error_fails_one_realisation_only(tmp_path, monkeypatch):
    from wearsim.studies.ensemble.realisation import RealisationRunner

    run = RealisationRunner.prepare

    def failing(self, number, *rest):
        return run(self, number, *rest) if number != 1 else 1 / 0

    monkeypatch.setattr(RealisationRunner, "prepare", failing)
    result = ensemble(small(), 3, tmp_path / "e.h5", **SERIAL)
    assert result.errors == {1: "ZeroDivisionError: division by zero"}


def test_control_variate_is_omitted_after_failures(tmp_path):
    result = ensemble(partly_failing(), 12, tmp_path / "e.h5", plan="control-variate", **SERIAL)
    assert 0 < result.failed < 12
    estimate = result.estimate("depth")
    assert estimate.variance_saved is None
    assert estimate.mean.value == pytest.approx(result.at_end("depth").mean())
    assert any("plain Monte Carlo" in text for text in result.warnings)
