"""Lives of designs: tests that end at a limit, exact wear factors, and comparison."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.special import ndtr

from tests.evolution import SCENARIOS
from tests.fixed_batches import batches_of
from tests.studies.ensemble_cases import LOGNORMAL, differences, small
from tests.studies.random_examples import WANDERING
from wearsim.errors import Interrupted, ResultsFileError, ScenarioError
from wearsim.scenario import Scenario, load_scenario
from wearsim.studies.ensemble.api import resume_ensemble
from wearsim.studies.ensemble.file.parts import read_ensemble
from wearsim.studies.life import settings
from wearsim.studies.life.api import life, sweep_life
from wearsim.studies.life.comparison import swept_variable as against
from wearsim.studies.life.comparison_view import LivesView
from wearsim.studies.life.factor import exact_factor
from wearsim.studies.life.realisation import LifeRunner
from wearsim.studies.life.result import LifeResult
from wearsim.studies.life.settings import design_variable, parse_life
from wearsim.studies.opening import open_results
from wearsim.studies.run.grid import shared_strips
from wearsim.studies.run.run import run

LOAD = {"distribution": "lognormal", "median": "300 N", "factor": 1.1}
FRICTION = {"distribution": "lognormal", "median": 0.1, "factor": 1.2}


def design(**changes: object) -> Scenario:
    """Return the rig with random load, friction and K/H, and a limit of 20 um."""
    given: dict[str, object] = {
        "load__normal_force": LOAD,
        "friction__coefficient": FRICTION,
        "limit__depth": "20 um",
        **changes,
    }
    found = small(**given)
    fixed = {"creepage.longitudinal": 1e-3, "creepage.misalignment": None}
    text = found.text
    del fixed["creepage.misalignment"]
    return Scenario.from_toml(_without(text), fixed, folder=Path(found.file).parent)


def _without(text: str) -> str:
    """Return a scenario without misalignment of the rollers."""
    import tomlkit

    document: Any = tomlkit.parse(text)
    document["creepage"].pop("misalignment", None)
    return tomlkit.dumps(document)


def lives(
    path: Path, scenario: Scenario | None = None, count: int = 12, **options: Any
) -> LifeResult:
    return life(scenario or design(), count, path, scheduler="serial", force=True, **options)


@pytest.fixture(scope="module")
def exact(tmp_path_factory: pytest.TempPathFactory) -> LifeResult:
    return lives(tmp_path_factory.mktemp("life") / "exact.h5", target=4000)


@pytest.fixture(scope="module")
def censored(tmp_path_factory: pytest.TempPathFactory) -> LifeResult:
    return lives(tmp_path_factory.mktemp("life") / "censored.h5", most=2000)


RADII = ["600 mm", "500 mm"]
OPTIONS: dict[str, Any] = {"target": 4000, "scheduler": "serial"}


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[LifeResult]]:
    """Return the path of a sweep of the crown radius, and its studies."""
    path = tmp_path_factory.mktemp("life") / "a.h5"
    return path, list(sweep_life(design(), "roller.crown_radius", RADII, path, 12, **OPTIONS))


@pytest.mark.parametrize(
    ("limit", "allowed", "count"), [(1.5, False, 4), (3, False, 0), (3, True, 4)]
)
def test_test_that_becomes_too_deep_before_its_limit_fails(
    limit: float, allowed: bool, count: int, tmp_path: Path
) -> None:
    factor = {"distribution": "lognormal", "median": "1.2e-7 1/Pa", "factor": 1.5}
    scenario = design(
        passes=10_000,
        wear__cylinder__k_over_h=factor,
        contact__width="130 mm",
        limit__depth=f"{limit} mm",
        evolution__allow_deep=allowed,
    )
    found = lives(tmp_path / "deep.h5", scenario, 4)
    assert found.count == count
    for number, text in found.errors.items():
        assert "exceeds a tenth of roller.radius = 20 mm" in text
        assert "lower the limits in [limit], or set evolution.allow_deep" in text
        start, end = found.raw.rows("depth", number, number + 1)[0].tolist()
        assert start == 0.0
        assert 2e-3 < end < 3e-3


def test_life_of_a_mean_design_is_that_of_the_closed_form(tmp_path: Path) -> None:
    scenario = design(load__normal_force="300 N", friction__coefficient=0.1)
    found = lives(tmp_path / "mean.h5", scenario, 400)
    # full slip: 4/3 sqrt(2 R_crown) d^(3/2)/(K mu xi N)
    median = 4.0 / 3.0 * (20e-6) ** 1.5 / (2e-9 * 1e-4 * 300.0)
    assert found.count == 1
    assert found.b(50).value == pytest.approx(median, rel=0.03)
    assert found.b(10).value / found.b(50).value == pytest.approx(
        math.exp(math.log(1.5) * -1.2815516), rel=1e-6
    )
    assert found.b(10).low == found.b(10).high
    wider = {"load__normal_force": "300 N", "friction__coefficient": 0.1}
    other = lives(tmp_path / "wider.h5", design(roller__crown_radius="600 mm", **wider), 400)
    machine = other.compare(found).same_machine
    assert machine is not None
    assert (machine.low, machine.value, machine.high) == (1.0, 1.0, 1.0)


def test_lives_at_drawn_factors_are_those_of_single_runs(exact: LifeResult) -> None:
    for number in (0, 5):
        scenario = exact.scenario.changed({"sampling.realisation": number})
        single = run(scenario, until="depth 20 um")
        low, value, high = (
            exact.values(name)[number] for name in ("life_low", "life", "life_high")
        )
        assert low < value < high
        assert single.passes[-1] == pytest.approx(value, rel=5e-3)


def test_depths_at_the_end_of_lives_are_the_limit(exact: LifeResult) -> None:
    assert np.allclose(exact.at_end("depth"), 20e-6, rtol=2e-6)
    assert exact.first_limits == {"depth": 1.0}
    assert exact.censored == 0


def test_survival_is_the_mean_over_the_wear_factor(exact: LifeResult) -> None:
    kappa = exact.values("life") * exact.values("wear.cylinder.k_over_h")
    scores = np.log(kappa / 2000.0 / 2e-9) / math.log(1.5)
    assert exact.survival(2000.0).value == pytest.approx(ndtr(scores).mean(), rel=1e-9)
    assert exact.probability_before(2000.0).value == pytest.approx(1.0 - ndtr(scores).mean())


def test_one_study_answers_other_distributions_of_the_factor(
    exact: LifeResult, tmp_path: Path
) -> None:
    other = {**LOGNORMAL, "median": "1e-9 1/Pa"}
    changed = exact.with_wear_factor(other)
    assert changed.b(10).value == pytest.approx(2.0 * exact.b(10).value, rel=1e-9)
    again = lives(tmp_path / "again.h5", design(wear__cylinder__k_over_h=other))
    assert changed.b(10).value == pytest.approx(again.b(10).value, rel=2e-3)


def test_counted_and_exact_lives_agree(exact: LifeResult, tmp_path: Path) -> None:
    # an independent scatter of K/H of rollers that hardly wear makes lives countable only
    scenario = design(wear__roller__k_over_h={**LOGNORMAL, "median": "1e-20 1/Pa"})
    counted = lives(tmp_path / "counted.h5", scenario)
    assert not counted.is_exact
    assert "independently" in counted.settings.reason
    assert np.allclose(counted.lives, exact.lives, rtol=5e-3)
    with pytest.raises(AttributeError, match="no wear factor is integrated exactly"):
        counted.factor_law  # noqa: B018


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"wear__cylinder__k_over_h": "2e-9 1/Pa"}, "no wear factor is random"),
        ({"wear__roller__k_over_h": "1e-9 1/Pa"}, "scatter both by wear.factor"),
        ({"load__normal_force": {**WANDERING, "marginal": LOAD}}, "varies in time"),
        ({"evolution__stepper": "per-pass"}, "every pass"),
        (
            {"load__thermal__gain": "1 N/W", "load__thermal__time_constant": "10 s"},
            "depends on time",
        ),
    ],
)
def test_factor_that_is_not_exact_has_a_reason(changes: dict[str, object], reason: str) -> None:
    found, why = exact_factor(design(**changes))
    assert found is None
    assert reason in why


def test_factor_shared_by_both_bodies_is_exact(tmp_path: Path) -> None:
    shared = {"distribution": "lognormal", "median": 1.0, "factor": 1.5}
    both = {"wear__cylinder__k_over_h": "2e-9 1/Pa", "wear__roller__k_over_h": "1e-9 1/Pa"}
    scenario = design(wear__factor=shared, **both)
    found, reason = exact_factor(scenario)
    assert found is not None, reason
    result = lives(tmp_path / "shared.h5", scenario, 3)
    single = run(scenario.changed({"sampling.realisation": 2}), until="depth 20 um")
    assert result.values("life")[2] == pytest.approx(float(single.passes[-1]), rel=5e-3)


def test_correlated_factor_is_conditional_on_other_draws(tmp_path: Path) -> None:
    rows = [["wear.cylinder.k_over_h", "friction.coefficient", 0.6]]
    result = lives(tmp_path / "correlated.h5", design(sampling__correlation=rows), 6)
    normal = 2.0 * math.sin(math.pi / 6.0 * 0.6)
    scores = np.log(result.values("friction.coefficient") / 0.1) / math.log(1.2)
    assert np.allclose(result.values("score_mean"), normal * scores, atol=1e-9)
    assert result.settings.spread == pytest.approx(math.sqrt(1.0 - normal**2))


def test_first_of_two_limits_ends_each_life(exact: LifeResult, tmp_path: Path) -> None:
    volume = float(np.median(exact.at_end("worn_volume")))
    both = lives(tmp_path / "both.h5", limits=[f"volume={volume * 1e9:.6g}mm^3"])
    shares = both.first_limits
    assert sum(shares.values()) == pytest.approx(1.0)
    assert 0.0 < shares["volume"] < 1.0
    # steps end at the first limit, so that lives differ by errors of steps
    assert (both.lives <= exact.lives * (1.0 + 2e-4)).all()


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("cam-life", {}),
        ("cam-life", {"limit.depth": "1 mm", "limit.width": "8 mm", "cam.stations": 1}),
        ("rig-life", {"wear.roller.k_over_h": "5e-12 1/Pa", "limit.depth": "15 um"}),
    ],
)
def test_strips_of_lives_cover_the_grooves_at_the_limits(
    monkeypatch: pytest.MonkeyPatch, name: str, changes: dict[str, object]
) -> None:
    scenario = load_scenario(SCENARIOS / f"{name}.toml", overrides=changes)
    grid, whole = shared_strips(scenario, to_limits=True), shared_strips(scenario)
    assert 5 < grid.strips < whole.strips
    assert (whole.strips - grid.strips) % 2 == 0
    assert grid.spacing == pytest.approx(whole.spacing)
    found = life(scenario, 3, scheduler="serial")
    with monkeypatch.context() as patched:
        patched.setattr(
            "wearsim.studies.life.realisation.shared_strips",
            lambda scenario, to_limits: shared_strips(scenario),
        )
        known = life(scenario, 3, scheduler="serial")
    np.testing.assert_allclose(found.values("life"), known.values("life"), rtol=1e-9)
    width = found.at_end("width").max()
    assert 0.5 * grid.strips * grid.spacing < width < grid.strips * grid.spacing


def test_limit_that_is_exceeded_when_fresh_gives_life_zero(tmp_path: Path) -> None:
    result = lives(tmp_path / "fresh.h5", limits=["peak_pressure=100MPa"], count=5)
    assert result.at_once == 5
    assert result.b(50).value == 0.0
    assert result.first_limits["peak_pressure"] == 1.0
    assert result.fits == []


def test_lives_beyond_the_maximum_are_censored(
    tmp_path: Path, exact: LifeResult, censored: LifeResult
) -> None:
    result, full = censored, exact
    assert result.censored == int((full.lives > 2000).sum()) > 0
    assert np.allclose(result.lives[result.observed], full.lives[full.lives <= 2000], rtol=5e-3)
    assert result.b(10).value == pytest.approx(full.b(10).value, rel=5e-3)
    never = lives(tmp_path / "never.h5", design(limit__depth="5 mm"), 3, most=5000)
    assert never.censored == 3
    assert math.isnan(never.b(50).value)
    assert repr(never).endswith("3 lives, B10 unknown>")


def test_quantity_that_hardly_grows_gives_an_interval_of_life(tmp_path: Path) -> None:
    # the spring has taken off the load at a depth of 23.1 um
    scenario = design(
        load__kind="spring",
        load__stiffness="15000 N/mm",
        load__normal_force="300 N",
        limit__depth="23.05 um",
        evolution__tolerance=1e-3,
    )
    result = lives(tmp_path / "flat.h5", scenario, 2, most=3e4)
    low, value, high = (result.values(name) for name in ("life_low", "life", "life_high"))
    error = result.values("depth_error") / 23.05e-6
    # wider than by the slope of a free groove, and to greater lives
    assert ((high - low) / value > 10.0 * 1.5 * error).all()
    assert (high - value > 1.2 * (value - low)).any()
    assert (value > low).all()


def test_stopped_study_continues_bit_for_bit(
    tmp_path: Path, exact: LifeResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("wearsim.studies.ensemble.driver.BatchSizes", batches_of(4))
    path, calls = tmp_path / "stopped.h5", []

    def stop() -> bool:
        calls.append(1)
        return len(calls) > 1

    with pytest.raises(Interrupted):
        lives(path, target=4000, stop_requested=stop)
    assert not read_ensemble(path).finished
    result = resume_ensemble(path, scheduler="serial")
    assert differences(result, exact) == []


def test_lives_do_not_depend_on_workers(
    tmp_path: Path, exact: LifeResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("wearsim.studies.ensemble.driver.BatchSizes", batches_of(4))
    result = life(design(), 12, tmp_path / "two.h5", target=4000, workers=2)
    assert differences(result, exact) == []


def test_extended_study_has_the_same_first_lives(tmp_path: Path, exact: LifeResult) -> None:
    path = tmp_path / "extended.h5"
    lives(path, count=6)
    result = resume_ensemble(path, realisations=12, scheduler="serial")
    assert np.array_equal(result.lives, exact.lives)
    with pytest.raises(ResultsFileError, match="has 12 realisations"):
        resume_ensemble(path, realisations=12, scheduler="serial")


def test_longer_attempts_reproduce_the_life(exact: LifeResult) -> None:
    data = exact.raw
    grid = exact_grid(exact)
    short = LifeRunner(exact.scenario, 12, grid, exact.settings, data.life["base"] / 20.0)
    (found,) = short([3])
    assert found.values["life"] == pytest.approx(exact.values("life")[3], rel=3e-3)


def exact_grid(result: LifeResult) -> Any:
    from wearsim.types import Grid

    return Grid(result.raw.variables["y"], result.raw.strip_width)


def test_study_of_lives_is_opened_as_such(exact: LifeResult) -> None:
    assert exact.path is not None
    again = open_results(exact.path)
    assert isinstance(again, LifeResult)
    assert again.b(10) == exact.b(10)
    assert resume_ensemble(exact.path).raw.life == exact.raw.life  # nothing is left to be run


def test_designs_are_compared_with_common_draws(
    exact: LifeResult,
    censored: LifeResult,
    swept: tuple[Path, list[LifeResult]],
    tmp_path: Path,
) -> None:
    wider = swept[1][0]
    found = wider.compare(exact)
    ratio = math.sqrt(600.0 / 500.0)  # of the closed form
    assert found.b10_ratio.value == pytest.approx(ratio, rel=0.02)
    assert found.same_machine is not None
    assert found.same_machine.value == 1.0
    assert 0.5 < found.two_specimens.value < 0.7
    assert found.count == 12
    short = censored.compare(exact)
    assert 0.0 < short.two_specimens.low < short.two_specimens.high < 1.0
    assert short.b10_ratio.value == pytest.approx(1.0, rel=5e-3)
    low, high = found.b10_ratio_bounds
    assert low < found.b10_ratio.value < high
    widths = [math.log(most / least) for least, most in (wider.b_error(10), exact.b_error(10))]
    assert math.log(high / low) == pytest.approx(sum(widths))
    rows = LivesView([exact, exact], ["one", "same"]).rows()
    assert "leave open which is longer" in str(rows[0])
    other = lives(tmp_path / "seed.h5", design().changed({"seed": 5}))
    assert other.compare(exact).same_machine is None


def test_sweep_has_the_lives_of_each_value(
    swept: tuple[Path, list[LifeResult]], exact: LifeResult
) -> None:
    path, found = swept
    assert [one.variable.value for one in found if one.variable] == [0.6, 0.5]
    assert differences(found[1], exact) == []
    assert against(found) == found[0].variable
    assert against([found[0], found[0]]) is None
    assert against([found[0], exact]) is None
    with pytest.raises(ResultsFileError, match="exists"):
        sweep_life(design(), "roller.crown_radius", RADII, path, 12, **OPTIONS)


@pytest.mark.parametrize(
    ("key", "expected"),
    [
        ("roller.crown_radius", (0.5, "m")),
        ("operation.rollers", (3.0, "1")),
        ("wear.law", None),
        ("friction.coefficient", None),
        ("roller.none", None),
    ],
)
def test_design_variable_is_a_number(key: str, expected: tuple[float, str] | None) -> None:
    found = design_variable(design(operation__rollers=3), key)
    assert (found and (found.value, found.unit)) == expected


def test_precision_ends_a_study_early(tmp_path: Path) -> None:
    result = lives(tmp_path / "precise.h5", count=200, precision="b10 50%")
    assert result.count == 64
    assert result.b(10).half_width <= 0.5 * result.b(10).value


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"limits": ["dept=5um"]}, "is not a limit"),
        ({"limits": ["depth=-5um"]}, "must be above zero"),
        ({"limits": ["12 h"]}, "does not end a life"),
        ({"limits": ["depth=5um", "depth=6um"]}, "given twice"),
        ({"target": "5 kg"}, "is not a life"),
        ({"target": -3}, "must be above zero"),
        ({"target": 1e9, "most": 1e6}, "beyond the maximum"),
        ({"precision": "depth.mean 1%"}, "cannot read the target"),
        ({"b": (0.0,)}, "is not a life"),
    ],
)
def test_bad_arguments_are_refused(tmp_path: Path, options: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        lives(tmp_path / "bad.h5", **options)


def test_study_without_limit_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="is needed for a life"):
        lives(tmp_path / "none.h5", small())
    with pytest.raises(ScenarioError, match="is a quantity of cams"):
        lives(tmp_path / "none.h5", limits=["lift_error=5um"])


def test_lives_are_read_in_passes_and_time() -> None:
    assert parse_life("200 h", "turns", 16.0, "target") == 200 * 3600 * 16.0
    assert parse_life("5e6 turns", "turns", 16.0, "target") == 5e6
    assert parse_life(675000, "passes", 50.0, "target") == 675000.0


def test_rare_end_of_life_agrees_with_the_exact_factor(tmp_path: Path, exact: LifeResult) -> None:
    quick = {"evolution__strip_error": False}
    scenario = design(wear__roller__k_over_h={**LOGNORMAL, "median": "1e-20 1/Pa"}, **quick)
    found = lives(tmp_path / "rare.h5", scenario, 40, target=250, rare=600)
    rare = found.rare
    assert found.count == 40
    assert rare is not None
    assert rare.is_reliable
    many = lives(tmp_path / "many.h5", design(**quick), 40, target=250, rare=200).rare
    assert many is not None
    assert many.probability.value < 2e-3
    assert rare.probability.low < many.probability.high
    assert rare.probability.high > many.probability.low
    assert many.variation < 0.1
    assert rare.variation < 0.25


def test_stopped_rare_events_continue_bit_for_bit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("wearsim.studies.ensemble.driver.BatchSizes", batches_of(20))
    monkeypatch.setattr(settings, "LEAST_TESTS", 60)
    factor = {**LOGNORMAL, "median": "1e-20 1/Pa"}
    quick = {"evolution__tolerance": 5e-2, "evolution__strip_error": False}
    scenario = design(wear__roller__k_over_h=factor, **quick)
    # subset simulation is stopped in test_rare_lives.py, without tests
    options: dict[str, Any] = {"target": 1200, "rare": 60, "rare_method": "importance"}
    whole = lives(tmp_path / "whole.h5", scenario, 20, **options)
    path, calls = tmp_path / "stopped.h5", []

    def stop() -> bool:
        calls.append(1)
        return len(read_ensemble(path).status) > 20 and len(calls) % 2 == 0

    with pytest.raises(Interrupted):
        lives(path, scenario, 20, stop_requested=stop, **options)
    assert not read_ensemble(path).finished
    result = resume_ensemble(path, scheduler="serial")
    assert differences(result, whole) == []
    assert result.rare == whole.rare


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"rare": 200}, "need a target"),
        ({"rare": -5, "target": 250}, "take 200 tests or more"),
        ({"rare": 200, "target": 250, "precision": "b10 5%"}, "a fixed number"),
    ],
)
def test_rare_events_without_meaning_are_refused(
    tmp_path: Path, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        lives(tmp_path / "bad.h5", **options)
