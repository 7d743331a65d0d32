"""Small probabilities of a life with the wear factor integrated, through the whole study."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.special import ndtr, ndtri

from tests.studies.ensemble_cases import LOGNORMAL, differences
from tests.studies.life.test_life import FRICTION, LOAD, design, lives
from tests.studies.life.test_life_kills import Killed, counted
from tests.studies.life.test_rare_lives import MEDIAN, target_of, use_closed_form
from wearsim.cli.render import show_view
from wearsim.scenario import Scenario
from wearsim.studies.ensemble.api import resume_ensemble
from wearsim.studies.ensemble.file.parts import read_ensemble
from wearsim.studies.life.api import life
from wearsim.studies.life.factor import exact_factor
from wearsim.studies.life.rare.estimates import IMPORTANCE, SUBSET
from wearsim.studies.life.result import LifeResult
from wearsim.studies.life.view import life_cells
from wearsim.uq.survival.lives import median_positions

SPREAD = math.sqrt(math.log(1.5) ** 2 + math.log(1.6) ** 2 + math.log(1.1) ** 2)


@pytest.fixture(autouse=True)
def closed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lives of a closed form instead of tests."""
    use_closed_form(monkeypatch)


def wide(**changes: object) -> Scenario:
    """Return a design with a factor of 1.6 of the friction."""
    return design(friction__coefficient={**FRICTION, "factor": 1.6}, **changes)


def study(path: Path, probability: float = 1e-6, **options: Any) -> LifeResult:
    given = {"target": target_of(probability, SPREAD), "most": 1e8, **options}
    scenario = given.pop("scenario", None) or wide()
    return life(scenario, 40, path, **{"scheduler": "serial", **given})


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[LifeResult, int]:
    """Return a study with tests for rare ends of life, and the number of its stages of writing."""
    stages: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        use_closed_form(patch)
        path = tmp_path_factory.mktemp("whole") / "whole.h5"
        return study(path, rare=200, storage=counted(stages)), len(stages)


@pytest.mark.parametrize("probability", [1e-2, 1e-4, 1e-6])
def test_200_further_tests_give_a_variation_below_10_percent(
    tmp_path: Path, probability: float
) -> None:
    result = study(tmp_path / "rare.h5", probability, rare=200)
    rare = result.rare
    assert list(result.rare_estimates) == [IMPORTANCE]
    assert rare is not None
    assert rare.is_reliable
    assert rare.variation < 0.1
    assert abs(rare.probability.value / probability - 1.0) < 3.5 * rare.variation
    assert rare.probability.low < rare.probability.value < rare.probability.high
    mixed = [stage for stage in result.settings.stages if "mixture" in stage]
    assert sum(stage["count"] for stage in result.settings.stages) == rare.tests == 200
    assert mixed[0]["count"] == round(0.1 * sum(stage["count"] for stage in mixed))
    assert set(mixed[0]["shift"].values()) == {0.0}
    assert result.settings.factor not in mixed[0]["shift"]


def test_small_probability_is_not_stated_but_the_command_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result = study(tmp_path / "plain.h5", 1e-4)
    target = result.target
    assert target is not None
    assert not math.isfinite(result.probability_before(target).value)
    assert not math.isfinite(result.survival(target).value)
    show_view(result.view, json=False)
    text = capsys.readouterr().out
    assert "not stated: its effective number of realisations is 0." in text
    assert "`wearsim life" in text
    assert "--rare 200" in text
    assert "'depth=2e-05 m'" in " ".join(text.split())
    found = result.view.data()["probability_before_target"]
    assert "below 20" in found["not_stated_because"]
    assert "--rare 200" in found["command"]
    assert any("not stated" in row.text for row in result.view.rows())
    stated = result.with_settings(target=MEDIAN)
    assert stated.probability_before(MEDIAN).value == pytest.approx(0.5, abs=0.2)
    assert stated.view.data()["probability_before_target"]["not_stated_because"] is None


def test_correlated_inputs_are_sampled_given_the_factor(tmp_path: Path) -> None:
    rows = [["wear.cylinder.k_over_h", "friction.coefficient", 0.5]]
    scenario = wide(sampling__correlation=rows)
    normal = 2.0 * math.sin(math.pi / 6.0 * 0.5)
    both = 2.0 * normal * math.log(1.5) * math.log(1.6)
    target = MEDIAN * math.exp(float(ndtri(1e-4)) * math.sqrt(SPREAD**2 + both))
    result = study(tmp_path / "both.h5", rare=200, scenario=scenario, target=target)
    rare = result.rare
    assert rare is not None
    assert rare.variation < 0.1
    assert abs(rare.probability.value / 1e-4 - 1.0) < 3.5 * rare.variation


def test_subset_simulation_draws_the_factor_where_nothing_else_can_be_shifted(
    tmp_path: Path,
) -> None:
    scenario = design(
        friction__coefficient=0.1, load__normal_force={**LOAD, "persistence": "per-roller"}
    )
    options = {"target": target_of(0.1, math.log(1.5)), "rare": 400, "most": 1e8}
    result = lives(tmp_path / "subset.h5", scenario, 40, **options)
    assert list(result.rare_estimates) == [SUBSET]
    assert result.rare is not None
    assert result.rare.probability.low < 0.1 < result.rare.probability.high


def test_factor_alone_takes_no_further_tests(tmp_path: Path) -> None:
    scenario = design(friction__coefficient=0.1, load__normal_force="300 N")
    with pytest.raises(ValueError, match="any probability is known without further tests"):
        lives(tmp_path / "alone.h5", scenario, 1, target=1000, rare=200)


def test_tests_of_an_integrated_factor_do_not_depend_on_workers(
    tmp_path: Path, whole: tuple[LifeResult, int]
) -> None:
    one, _ = whole
    two = study(tmp_path / "two.h5", rare=200, scheduler="threads", workers=2)
    assert differences(two, one) == []
    assert two.rare_estimates == one.rare_estimates


@pytest.mark.parametrize(
    "part", [0.6, *(pytest.param(k / 8.0, marks=pytest.mark.slow) for k in (3, 6, 7.5))]
)
def test_killed_study_of_an_integrated_factor_continues_bit_for_bit(
    tmp_path: Path, part: float, whole: tuple[LifeResult, int]
) -> None:
    complete, stages = whole
    path, done = tmp_path / "killed.h5", list[str]()
    with pytest.raises(Killed):
        study(path, rare=200, storage=counted(done, int(part * stages)))
    assert not read_ensemble(path).finished
    result = resume_ensemble(path, scheduler="serial")
    assert differences(result, complete) == []
    assert result.rare_estimates == complete.rare_estimates
    assert result.settings == complete.settings


def test_effects_are_not_stated_where_lives_are_censored(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scenario = wide(wear__roller__k_over_h={**LOGNORMAL, "median": "1e-20 1/Pa"})
    censored = lives(tmp_path / "censored.h5", scenario, 60, most=0.8 * MEDIAN)
    assert censored.effects_obstacle.startswith(f"{censored.censored} of 60 lives are censored")
    assert censored.tornado() == {}
    assert not any(math.isfinite(item.first.value) for item in censored.sensitivity("life"))
    show_view(censored.view, json=False)
    text = capsys.readouterr().out
    assert "what moves the life: Sobol indices of its logarithm: not stated" in text
    assert "give a greater --max" in text
    assert "censored" in censored.view.data()["sensitivity_not_stated_because"]
    full = lives(tmp_path / "full.h5", scenario, 60, most=1e8)
    assert full.effects_obstacle == ""
    low, high = (one.value for one in full.tornado()["friction.coefficient"].factors)
    assert math.log(low / high) == pytest.approx(2.0 * 1.2816 * math.log(1.6), rel=0.3)


def test_effects_need_no_lives_within_the_maximum_with_an_exact_factor(tmp_path: Path) -> None:
    full, short = (
        lives(tmp_path / f"{most:g}.h5", wide(), 60, most=most) for most in (1e8, 0.8 * MEDIAN)
    )
    assert short.censored > 20
    assert short.effects_obstacle == ""
    assert np.allclose(short.log_lives, full.log_lives)
    assert short.tornado() == full.tornado()


def test_probability_plot_uses_the_median_positions(tmp_path: Path) -> None:
    scenario = wide(wear__roller__k_over_h={**LOGNORMAL, "median": "1e-20 1/Pa"})
    result = lives(tmp_path / "counted.h5", scenario, 30, most=1e8)
    axes = next(
        one for one in result.plot().axes if "Log-normal" in one.get_title("left") + one.get_title()
    )
    drawn = next(line for line in axes.lines if line.get_marker() == ".")
    assert np.array_equal(drawn.get_xdata(), np.sort(result.lives))
    assert ndtr(drawn.get_ydata()) == pytest.approx(median_positions(30), abs=1e-12)
    assert life_cells(result, 1.0) == ("takes 69 lives", "")
    assert not math.isfinite(result.b(1).value)
    assert math.isfinite(result.b(10).value)


def test_drawn_law_with_single_values_is_not_replaced(tmp_path: Path) -> None:
    file = tmp_path / "two.csv"
    file.write_text("probability,value [1/Pa]\n0,1e-9\n0.6,1e-9\n0.6000001,3e-9\n1,3e-9\n")
    two = {"distribution": "table", "file": str(file)}
    result = lives(tmp_path / "two.h5", wide(wear__cylinder__k_over_h=two), 4, most=1e8)
    with pytest.raises(ValueError, match="takes the value 1e-09 with a probability"):
        result.with_wear_factor(LOGNORMAL)
    file.write_text("probability,value [1/Pa]\n0,0\n0.6,0\n0.6000001,3e-9\n1,3e-9\n")
    factor, reason = exact_factor(wide(wear__cylinder__k_over_h=two))
    assert factor is None
    assert "is 0 with a probability" in reason
