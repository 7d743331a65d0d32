"""Rare, early ends of life through the whole study, with lives of a closed form."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.special import ndtri

from tests.studies.ensemble_cases import LOGNORMAL, differences
from tests.studies.life.test_life import FRICTION, LOAD, design, lives
from tests.studies.life.test_life_kills import Killed, counted
from wearsim.cli.render import show_view
from wearsim.scenario import Scenario
from wearsim.studies.ensemble.api import resume_ensemble
from wearsim.studies.ensemble.batch import RealisationRun
from wearsim.studies.ensemble.file.parts import read_ensemble
from wearsim.studies.ensemble.file.schema import OBSERVABLES
from wearsim.studies.life import realisation
from wearsim.studies.life.api import life
from wearsim.studies.life.batch import LifeRun
from wearsim.studies.life.rare.estimates import IMPORTANCE, SUBSET
from wearsim.studies.life.realisation import LevelRunner
from wearsim.studies.life.result import LifeResult
from wearsim.studies.run.draws import Drawer
from wearsim.types import FloatArray
from wearsim.uq.survival.rare_events import RareProbability, subset_stages

MEDIAN = 1e6
OFTEN, SELDOM = 6.2e5, 4e5  # targets that take one level of subset simulation, and several
ROLLER = {**LOGNORMAL, "median": "1e-20 1/Pa"}
SPREADS = {
    "wear.cylinder.k_over_h": math.log(1.5),
    "friction.coefficient": math.log(1.2),
    "load.normal_force": math.log(1.1),
}
MEDIANS = {
    "wear.cylinder.k_over_h": 2e-9,
    "friction.coefficient": 0.1,
    "load.normal_force": 300.0,
}

Whole = tuple[LifeResult, int]


def without_problem(
    self: LevelRunner, number: int, drawn: dict[str, float | FloatArray]
) -> RealisationRun:
    """Draw the inputs of a test that is not run."""
    draws = self.drawer.draw(number)
    drawn.update(draws.values)
    unused: Any = SimpleNamespace(grid=self.grid, fixed=self.fixed)
    return RealisationRun(number, drawn, draws, unused, unused)


def closed_form(runs: Sequence[RealisationRun], _: object) -> list[LifeRun]:
    """Return lives in inverse proportion to K/H, friction and load; of rollers to the mean of ln.

    As a test does, they have the wear factor of the test, which is not that drawn where lives are
    integrated over it.
    """
    found = []
    for run in runs:
        problem: Any = run.problem
        given = dict(run.drawn) | problem.fixed
        logs = [np.mean(np.log(given[key] / MEDIANS[key])) for key in MEDIANS if key in given]
        value = MEDIAN * math.exp(-sum(logs))
        scalars = dict.fromkeys(("life", "life_low", "life_high"), value)
        scalars |= {"first_limit": 0.0, "limit_angle": math.nan}
        scalars |= dict.fromkeys(("steps", "solves", "depth_error", "volume_error"), 1.0)
        rows: list[Any] = [dict.fromkeys(OBSERVABLES, 1.0)] * 2
        curves = {"depth_profile": np.zeros(len(problem.grid.y))}
        found.append(LifeRun(rows, scalars, curves, problem.grid))
    return found


@pytest.fixture
def closed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lives of a closed form instead of tests."""
    use_closed_form(monkeypatch)


def use_closed_form(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(LevelRunner, "prepare", without_problem)
    monkeypatch.setattr(realisation, "batch_groups", lambda runs: [runs])
    monkeypatch.setattr(realisation, "observe_lives", closed_form)


def target_of(probability: float, spread: float) -> float:
    return MEDIAN * math.exp(float(ndtri(probability)) * spread)


def estimate(path: Path, probability: float, tests: int, seed: int, method: str) -> LifeResult:
    """Return a study with the given true probability of a life before the target."""
    scenario = design(wear__roller__k_over_h=ROLLER, seed=seed)
    target = target_of(probability, math.hypot(*SPREADS.values()))
    return lives(path, scenario, 400, target=target, most=1e8, rare=tests, rare_method=method)


@cache
def drawn_design() -> Scenario:
    return design(wear__roller__k_over_h=ROLLER)


def by_draws(probability: float, tests: int, seed: int, plain: int = 400) -> RareProbability:
    """Return the estimate of subset simulation from the draws of a study, without its file."""
    drawer = Drawer(replace(drawn_design(), seed=seed), "monte-carlo")
    numbers = drawer.uniforms(0, plain + tests)
    scores = np.column_stack([ndtri(numbers[name][:, 0]) for name in SPREADS])
    spreads = np.array(list(SPREADS.values()))
    excess = -float(ndtri(probability)) * math.hypot(*spreads)
    stages = subset_stages(tests, plain)
    stage = next(stages)
    order, free = np.arange(min(plain, stage.count)), plain
    while True:
        missing = stage.count if stage.parents is not None else stage.count - len(order)
        new, free = np.arange(free, free + missing), free + missing
        if stage.parents is not None:
            part = math.sqrt(1.0 - stage.scale**2)
            scores[new] = part * scores[order[stage.parents]] + stage.scale * scores[new]
        order = np.append(order, new)
        try:
            stage = stages.send(excess - scores[order[-stage.count :]] @ spreads)
        except StopIteration as end:
            found: RareProbability = end.value
            return found


@pytest.mark.parametrize(("probability", "tests"), [(1e-4, 2000), (1e-6, 5000)])
def test_subset_simulation_holds_the_probability_in_repeats(probability: float, tests: int) -> None:
    found = [by_draws(probability, tests, seed) for seed in range(200)]
    values = np.array([item.probability.value for item in found])
    held = [item.probability.low < probability < item.probability.high for item in found]
    assert np.mean(held) >= 0.9
    assert values.std() / probability < 0.5
    assert max(item.tests for item in found) <= tests
    assert all(item.is_reliable for item in found)


@pytest.mark.usefixtures("closed")
@pytest.mark.parametrize(
    ("probability", "tests", "seed"),
    [
        (1e-2, 600, 1),
        pytest.param(1e-3, 1000, 1, marks=pytest.mark.slow),
        pytest.param(1e-4, 2000, 1, marks=pytest.mark.slow),
        pytest.param(1e-6, 5000, 2, marks=pytest.mark.slow),
    ],
)
def test_study_has_the_subset_simulation_of_its_draws(
    tmp_path: Path, probability: float, tests: int, seed: int
) -> None:
    rare = estimate(tmp_path / "rare.h5", probability, tests, seed, "subset").rare
    expected = by_draws(probability, tests, seed)
    assert rare is not None
    assert rare.probability.value == pytest.approx(expected.probability.value, rel=1e-9)
    assert rare.variation == pytest.approx(expected.variation, rel=1e-9)
    assert rare.tests == expected.tests


@pytest.mark.usefixtures("closed")
@pytest.mark.parametrize(
    ("probability", "tests", "seeds"),
    [
        (1e-4, 800, range(1)),
        pytest.param(1e-6, 5000, range(1), marks=pytest.mark.slow),
    ],
)
def test_importance_sampling_has_the_probability_of_the_closed_form(
    tmp_path: Path, probability: float, tests: int, seeds: range
) -> None:
    for seed in seeds:
        result = estimate(tmp_path / "rare.h5", probability, tests, seed, "auto")
        rare = result.rare
        assert list(result.rare_estimates) == [IMPORTANCE]
        assert rare is not None
        assert rare.variation < 0.2
        assert abs(rare.probability.value / probability - 1.0) < 4.0 * rare.variation


def many(count: int = 3, **changes: object) -> Scenario:
    """Return a design whose life is moved most by the loads of its rollers."""
    each = {**LOAD, "factor": 2.0, "persistence": "per-roller"}
    return design(
        wear__cylinder__k_over_h="2e-9 1/Pa",
        operation__rollers=count,
        load__normal_force=each,
        **changes,
    )


@pytest.mark.usefixtures("closed")
def test_subset_simulation_follows_where_importance_sampling_fails(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spread = math.hypot(math.log(1.2), math.log(2.0) / math.sqrt(3.0))
    options: dict[str, Any] = {"target": target_of(0.1, spread), "most": 1e8, "rare": 400}
    result = lives(tmp_path / "both.h5", many(), 40, **options)
    first, second = result.rare_estimates.values()
    assert list(result.rare_estimates) == [IMPORTANCE, SUBSET]
    assert "effective sample size" in first.obstacle
    assert second.is_reliable
    assert second.tests <= 400
    assert result.rare == second
    assert second.probability.low < 0.1 < second.probability.high
    found = result.view.data()["rare"]
    assert found["method"] == SUBSET
    assert found["probability"]["value"] == second.probability.value
    assert found["tried"][IMPORTANCE]["refused"]
    show_view(result.view, json=False)
    text = " ".join(capsys.readouterr().out.split())
    assert "by importance sampling refused, effective sample size" in text
    assert f"by subset simulation {second.probability.value:.3g} [" in text
    alone = lives(tmp_path / "one.h5", many(friction__coefficient=0.1), 40, **options)
    assert list(alone.rare_estimates) == [SUBSET]
    assert alone.settings.rare_method == "subset"


@pytest.mark.usefixtures("closed")
def test_probability_is_refused_where_both_methods_fail(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # nine lives of ten are beyond the maximum, and do not show the way to the target
    options = {"target": 0.05 * MEDIAN, "most": 0.4 * MEDIAN, "rare": 200}
    result = lives(tmp_path / "refused.h5", many(friction__coefficient=FRICTION), 40, **options)
    obstacles = [found.obstacle for found in result.rare_estimates.values()]
    assert len(obstacles) == 2
    assert "below 30" in obstacles[0]
    assert "such as a censored life" in obstacles[1]
    assert result.rare is not None
    assert not result.rare.is_reliable
    assert result.view.data()["rare"]["probability"] is None
    show_view(result.view, json=False)
    assert "not stated; give a greater --rare" in capsys.readouterr().out


def subset_study(path: Path, **options: Any) -> LifeResult:
    """Return a study in which both methods are used."""
    given = {"target": OFTEN, "most": 1e8, "rare": 200, "scheduler": "serial", **options}
    return life(many(), 20, path, **given)


@pytest.fixture(scope="module")
def whole_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[float], Whole]:
    """Return a function of the target: a study, computed once, and its stages of writing."""

    @cache
    def whole(target: float) -> Whole:
        stages: list[str] = []
        with pytest.MonkeyPatch.context() as patch:
            use_closed_form(patch)
            path = tmp_path_factory.mktemp("whole") / "whole.h5"
            return subset_study(path, target=target, storage=counted(stages)), len(stages)

    return whole


@pytest.mark.usefixtures("closed")
def test_subset_simulation_does_not_depend_on_workers(
    tmp_path: Path, whole_of: Callable[[float], Whole]
) -> None:
    one, _ = whole_of(OFTEN)
    two = subset_study(tmp_path / "two.h5", scheduler="threads", workers=2)
    assert SUBSET in one.rare_estimates
    assert differences(two, one) == []
    assert two.rare_estimates == one.rare_estimates


@pytest.mark.usefixtures("closed")
@pytest.mark.parametrize(
    ("target", "part"),
    [
        (OFTEN, 0.9),
        *(pytest.param(SELDOM, part, marks=pytest.mark.slow) for part in (0.5, 0.7, 0.85)),
    ],
)
def test_killed_subset_simulation_continues_bit_for_bit(
    tmp_path: Path, target: float, part: float, whole_of: Callable[[float], Whole]
) -> None:
    whole, stages = whole_of(target)
    path, done = tmp_path / "killed.h5", list[str]()
    with pytest.raises(Killed):
        subset_study(path, target=target, storage=counted(done, int(part * stages)))
    assert not read_ensemble(path).finished
    assert read_ensemble(path).requested > 20 + 200  # importance sampling is over
    result = resume_ensemble(path, scheduler="serial")
    assert differences(result, whole) == []
    assert result.rare_estimates == whole.rare_estimates
    assert result.settings == whole.settings


def test_draws_are_changes_of_those_of_their_parents() -> None:
    scenario, names = many(), ["friction.coefficient", "load.normal_force@1"]
    plain = Drawer(scenario, "monte-carlo")
    changed = Drawer(scenario, "monte-carlo", changes={7: (5, 0.6), 5: (2, 0.8)})
    own, found = plain.uniforms(0, 8), changed.uniforms(0, 8)
    for name in names:
        z = ndtri(own[name][:, 0])
        expected = 0.8 * (0.6 * z[2] + 0.8 * z[5]) + 0.6 * z[7]
        assert ndtri(found[name][7, 0]) == pytest.approx(expected, rel=1e-12)
        assert np.array_equal(np.delete(found[name], [5, 7]), np.delete(own[name], [5, 7]))
        assert np.array_equal(changed.uniforms(7, 1)[name][0], found[name][7])


@pytest.mark.parametrize(
    ("changes", "method", "message"),
    [
        ({}, "simple", "is not a method"),
        ({"friction__coefficient": 0.1}, "importance", "can be shifted; use subset"),
    ],
)
def test_methods_without_meaning_are_refused(
    tmp_path: Path, changes: dict[str, Any], method: str, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        lives(tmp_path / "bad.h5", many(**changes), target=250, rare=200, rare_method=method)
