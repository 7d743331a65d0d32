"""Sampling plans, interim analyses, sweeps and comparisons of ensembles."""

from __future__ import annotations

import numpy as np
import pytest

import wearsim
from tests.fixed_batches import batches_of
from tests.studies.ensemble_cases import small
from wearsim.errors import Interrupted
from wearsim.studies.comparison.compare import compare, have_same_draws
from wearsim.studies.ensemble.api import ensemble
from wearsim.studies.ensemble.designs import interim_sizes, parse_plan, sources, whole_count
from wearsim.studies.ensemble.sweep import path_of, run_sweep
from wearsim.studies.run.draws import Drawer

SERIAL = {"scheduler": "serial"}


def test_saltelli_row_replaces_one_input_at_a_time():
    groups = ["a", "b", "c"]
    rows = [sources("saltelli", groups, number)[0] for number in range(10)]
    assert rows[0] == {"a": 0, "b": 0, "c": 0}
    assert rows[1] == {"a": 1, "b": 1, "c": 1}
    assert rows[2] == {"a": 1, "b": 0, "c": 0}
    assert rows[4] == {"a": 0, "b": 0, "c": 1}
    assert rows[5] == {"a": 2, "b": 2, "c": 2}
    assert sources("sobol", groups, 7) == ({}, 7)
    assert [whole_count("saltelli", groups, asked) for asked in (1, 5, 6)] == [5, 5, 10]
    assert whole_count("monte-carlo", groups, 6) == 6


def test_unknown_plan_error_lists_the_plans():
    with pytest.raises(ValueError, match="unknown plan 'halton', expected one of monte-carlo"):
        parse_plan("halton")


def test_interim_sizes_increase_to_the_maximum():
    assert interim_sizes("sobol", 1000) == [64, 128, 256, 512, 1000]
    sizes = interim_sizes("monte-carlo", 1000)
    assert sizes[0] == 64
    assert sizes[-1] == 1000
    assert (np.diff(sizes) > 0).all()
    assert interim_sizes("monte-carlo", 10) == [10]
    # they do not depend on the maximum
    assert interim_sizes("monte-carlo", 5000)[: len(sizes) - 1] == sizes[:-1]


@pytest.mark.parametrize("plan", ["monte-carlo", "sobol"])
def test_single_realisation_draws_as_in_a_batch(plan):
    drawer = Drawer(small(), plan)
    columns = drawer.columns(0, 9)
    for number in (0, 5, 8):
        for key, value in drawer.draw(number).values.items():
            assert value == columns[key][number]
    drawn = wearsim.studies.run.draws.draw(small(sampling__plan=plan, sampling__realisation=5))
    assert drawn.values["load.normal_force"] == columns["load.normal_force"][5]


def test_each_sobol_replicate_is_stratified():
    uniform = Drawer(small(), "sobol")._sampler.uniforms(0, 8 * 16)["load.normal_force"][:, 0]
    for replicate in range(8):
        cells = np.sort(np.floor(16 * uniform[replicate::8]))
        np.testing.assert_array_equal(cells, np.arange(16))


def creepages(values):
    """Return a scenario for each value of the creepage."""
    return [small(creepage__longitudinal=float(value)) for value in values]


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    path = tmp_path_factory.mktemp("sweep") / "creep.h5"
    values = ["8e-4", "1.2e-3"]
    return run_sweep(creepages(values), values, 8, path, **SERIAL)


def test_sweep_has_common_random_numbers(swept):
    low, high = swept
    assert low.path.name == "creep-8e-4.h5"
    np.testing.assert_array_equal(low.values("load.normal_force"), high.values("load.normal_force"))
    assert (high.at_end("depth") > low.at_end("depth")).all()
    assert have_same_draws(low, high)


def test_sweep_refuses_existing_file_before_it_runs(swept, tmp_path):
    (tmp_path / "creep-2.h5").write_text("mine")
    with pytest.raises(wearsim.errors.ResultsFileError, match="already exists"):
        run_sweep([small(), small()], ["1", "2"], 3, tmp_path / "creep.h5", **SERIAL)
    assert not (tmp_path / "creep-1.h5").exists()


def test_sweep_continues_where_it_was_stopped(tmp_path, monkeypatch):
    monkeypatch.setattr("wearsim.studies.ensemble.driver.BatchSizes", batches_of(2))
    values, path = ["8e-4", "1e-3", "1.2e-3"], tmp_path / "creep.h5"
    scenarios, second = creepages(values), tmp_path / "creep-1e-3.h5"
    with pytest.raises(Interrupted, match=r"not started: 1.2e-3; call sweep again"):
        run_sweep(scenarios, values, 3, path, stop_requested=second.exists, **SERIAL)
    kept = (tmp_path / "creep-8e-4.h5").read_bytes()
    results = run_sweep(scenarios, values, 3, path, **SERIAL)
    assert [result.count for result in results] == [3, 3, 3]
    assert (tmp_path / "creep-8e-4.h5").read_bytes() == kept
    with pytest.raises(wearsim.errors.ResultsFileError, match="already exists"):
        run_sweep(scenarios, values, 4, path, **SERIAL)  # a different ensemble


def test_sweep_file_names_contain_the_values():
    assert path_of("out/a.h5", "250 N").name == "a-250N.h5"
    assert path_of("a.h5", "1e-11 1/Pa").name == "a-1e-11_1_per_Pa.h5"


def test_comparison_estimates_which_wears_deeper(swept):
    low, high = swept
    found = compare([low, high], ["low", "high"])
    first, second = found.rows
    assert first.deeper is None
    assert second.deeper.value > 0.5
    assert second.deeper.low <= second.deeper.value <= second.deeper.high
    # with the same random numbers every pair has the same sign
    assert second.paired.share.value == 1.0
    difference = high.at_end("depth") - low.at_end("depth")
    assert second.paired.difference.value == pytest.approx(difference.mean())
    backwards = compare([high, low], ["high", "low"]).rows[1]
    assert backwards.deeper.value == pytest.approx(1.0 - second.deeper.value)
    assert backwards.paired.share.value == 0.0


def test_run_is_compared_with_an_ensemble(swept):
    run = wearsim.run(small(sampling__realisation=3))
    found = compare([swept[0], run], ["ensemble", "run"], "depth")
    row = found.rows[1]
    assert (row.kind, row.count, row.paired, row.std) == ("run", 1, None, None)
    assert row.value.low < row.value.value < row.value.high
    below = (swept[0].at_end("depth") < float(run.depth[-1])).mean()
    assert row.deeper.value == pytest.approx(below)


def test_two_runs_compare_by_their_error_estimates():
    runs = [wearsim.run(small(sampling__realisation=number)) for number in (2, 3)]
    depths = [float(run.depth[-1]) for run in runs]
    assert abs(depths[0] - depths[1]) > 0.02 * depths[0]  # twice the tolerance
    row = compare(runs, ["a", "b"]).rows[1]
    assert row.deeper.value == float(depths[1] > depths[0])
    errors = sum(float(run.depth_error[-1]) for run in runs)
    assert row.difference.value == pytest.approx(depths[1] - depths[0])
    assert row.difference.half_width == pytest.approx(errors)
    same = compare([runs[0], runs[0]], ["a", "b"]).rows[1].deeper
    assert (same.value, same.low, same.high) == (0.5, 0.0, 1.0)


def test_comparison_detects_unequal_test_lengths(swept):
    run = wearsim.run(small(passes=2000))
    assert compare(swept, ["low", "high"]).equally_long
    found = compare([swept[0], run], ["low", "run"])
    assert not found.equally_long
    assert [row.passes for row in found.rows] == [3000.0, 2000.0]
    assert found.rows[1].time == pytest.approx(2.0 / 3.0 * found.rows[0].time)


def test_ensembles_of_different_seeds_are_not_paired(swept, tmp_path):
    other = ensemble(small(seed=3), 6, tmp_path / "other.h5", **SERIAL)
    row = compare([swept[0], other], ["a", "b"]).rows[1]
    assert row.paired is None
    assert row.deeper is not None


def test_invalid_comparison_raises_value_error(swept):
    with pytest.raises(ValueError, match="'colour' is not an observable of a; known: depth"):
        compare(swept, ["a", "b"], "colour")
    with pytest.raises(ValueError, match="two or more"):
        compare(swept[:1], ["a"])
