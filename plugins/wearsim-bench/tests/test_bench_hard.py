"""Hard cases: detection of errors, mirrored scenarios, verdicts."""

import json
from dataclasses import replace

import numpy as np
import pytest

import wearsim_bench.hard_cases.topic as hard_module
from wearsim.mechanics.hertz.ellipse import hertz
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.run.result import Result
from wearsim.studies.run.run import run
from wearsim_bench.figures.hard_cases import hard_markdown
from wearsim_bench.hard_cases import evaluation, measures
from wearsim_bench.hard_cases.cases import (
    RobustnessCase,
    crown_radius_of,
    hard_cases,
    profile,
    roughness,
)
from wearsim_bench.hard_cases.evaluation import evaluate
from wearsim_bench.hard_cases.runs import Plan, is_symmetric, mirror_image
from wearsim_bench.hard_cases.topic import hard
from wearsim_bench.hard_cases.truths import rigid_depth
from wearsim_bench.hard_cases.verdict import CRITERIA, Criterion, Verdict
from wearsim_bench.measure.measurement import Effort

PASSES = 6000
PLAN = Plan(PASSES, finer=1, steps=5, doublings=2, tighter=False, changes={})
PLAIN = RobustnessCase("plain", {})
ASYMMETRIC = RobustnessCase(
    "asymmetric",
    {
        "roller.offset": ["-1 mm", "0 mm", "0.3 mm"],
        "creepage.tilt": ["1 mrad", "-2 mrad", "0.5 mrad"],
        "creepage.yaw": ["0.3 mrad", "0 mrad", "-1 mrad"],
        "contact.centre": "0.1 mm",
    },
)


@pytest.fixture(scope="module")
def plain():
    scenario = PLAN.scenario(PLAIN, evolution__step=1200, outputs__every_passes=600)
    return scenario, run(scenario)


def modified(result, kind, name, change):
    """Return a result with one array changed."""
    raw = result.raw
    arrays = {**getattr(raw, kind), name: change(getattr(raw, kind)[name].copy())}
    return Result(replace(raw, **{kind: arrays}), None)


def test_balances_of_a_run_hold(plain):
    scenario, result = plain
    assert measures.is_finite(result)
    assert measures.volume_balance(result, scenario) < 1e-12
    assert measures.records_half_steps(result)
    assert measures.energy_balance(result) < 1e-3
    assert measures.work_balance(result, scenario) < 1e-12
    assert measures.load_balance(result) < 1e-12


def test_volume_error_is_detected(plain):
    scenario, result = plain
    wrong = modified(result, "history", "worn_volume", lambda v: 1.001 * v)
    assert measures.volume_balance(wrong, scenario) == pytest.approx(1e-3, rel=1e-2)


def test_energy_error_is_detected(plain):
    wrong = modified(plain[1], "records", "dissipation", lambda p: 1.1 * p)
    assert measures.energy_balance(wrong) == pytest.approx(0.1, rel=0.02)


def test_load_error_is_detected(plain):
    wrong = modified(plain[1], "records", "line_load", lambda q: 1.001 * q)
    assert measures.load_balance(wrong) == pytest.approx(1e-3, rel=1e-6)


def test_work_error_is_detected(plain):
    scenario, result = plain
    wrong = modified(result, "checkpoint", "contact_force_x", lambda force: 1.001 * force)
    assert measures.work_balance(wrong, scenario) == pytest.approx(1e-3, rel=1e-6)


def test_oscillation_is_detected(plain):
    fine = run(PLAN.scenario(PLAIN, evolution__step=6000, contact__strips=80))
    assert measures.max_oscillation(fine) < 0.02

    def sawtooth(q):
        q[..., ::2] *= 0.9
        return q

    assert measures.max_oscillation(modified(fine, "records", "line_load", sawtooth)) > 0.1


def test_drift_of_a_groove_is_detected(plain):
    def shifted(worn):
        return np.roll(worn, 1, axis=-1)

    assert measures.drift(plain[1]) < 1e-12
    wrong = modified(plain[1], "records", "cylinder_depth_profile", shifted)
    assert measures.drift(wrong) > 1e-3
    assert measures.asymmetry(wrong, plain[1]) > 1e-3


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -1e-9])
def test_invalid_depth_is_detected(plain, wrong):
    def invalid(worn):
        worn[-1, ..., 3] = wrong
        return worn

    assert not measures.is_finite(modified(plain[1], "records", "cylinder_depth_profile", invalid))


def test_patches_are_counted_in_sequence(plain):
    def split(q):
        q[3:5, ..., q.shape[-1] // 2] = 0.0
        return q

    assert measures.patches(plain[1]) == (1,)
    assert measures.patches(modified(plain[1], "records", "line_load", split)) == (1, 2, 1)


def test_change_compares_means_over_wider_strips(plain):
    fine = run(PLAN.scenario(PLAIN, evolution__step=1200, contact__strips=80))
    coarse = plain[1].profiles[-1]
    means = fine.profiles[-1].reshape(-1, 2).mean(axis=1)
    expected = np.abs(coarse - means).sum() / means.sum()
    assert measures.change(plain[1], fine) == pytest.approx(expected, rel=1e-12)
    assert 0.0 < expected < 0.05


def test_order_of_a_power_of_the_step():
    assert measures.order([4e-3, 1e-3, 2.5e-4]) == pytest.approx(2.0)
    assert measures.order([1e-3, 0.0]) is None


def test_mirroring_twice_restores_the_scenario():
    scenario = PLAN.scenario(ASYMMETRIC)
    image = mirror_image(scenario)
    assert image.roller.offset == (0.001, 0.0, -0.0003)
    assert image.contact.centre == -scenario.contact.centre
    again = mirror_image(image)
    assert again.roller == scenario.roller
    assert again.creepage == scenario.creepage
    assert not is_symmetric(scenario)
    assert is_symmetric(PLAN.scenario(PLAIN))


def test_profile_is_mirrored_exactly():
    rough = profile(roughness, finer=4)
    case = RobustnessCase("rough", {"cylinder.profile": "r.csv"}, {"r.csv": rough})
    scenario = PLAN.scenario(case)
    image = mirror_image(scenario).cylinder.profile
    np.testing.assert_array_equal(image.y, -scenario.cylinder.profile.y[::-1])
    np.testing.assert_array_equal(image.height, scenario.cylinder.profile.height[::-1])
    assert not is_symmetric(scenario)


def test_roughness_has_the_stated_rms_and_correlation():
    y = np.linspace(-16.0, 16.0, 6401)
    heights = roughness(y)
    assert heights.std() == pytest.approx(0.5, rel=0.02)
    at = np.searchsorted(y, y[0] + 0.1)
    correlation = (heights[at:] * heights[:-at]).mean() / heights.var()
    assert correlation == pytest.approx(np.exp(-1.0), abs=0.05)


@pytest.mark.parametrize("ratio", [200.0, 1.0, 0.3])
def test_crown_radius_gives_the_requested_patch(ratio):
    along = 0.5 * (1.0 / 0.025 + 1.0 / 0.020)
    patch = hertz(along, 0.5 / crown_radius_of(ratio), 300.0, 1e11)
    assert patch.b / patch.a == pytest.approx(ratio, rel=1e-9)


def test_unexpected_error_fails_the_case():
    narrow = RobustnessCase("narrow", {"contact.width": "1 mm"})
    verdict = evaluate(narrow, PLAN)
    assert not verdict.holds
    assert "does not fit" in verdict.error
    assert verdict.unexpected.startswith("stopped: ")


def test_error_without_the_required_words_fails():
    narrow = RobustnessCase(
        "narrow", {"contact.width": "1 mm"}, refused=("[contact] width", "moon")
    )
    assert evaluate(narrow, PLAN).failures == ("the error does not name moon",)


def test_missing_error_fails_the_case():
    assert "completed" in evaluate(RobustnessCase("plain", {}, refused=("width",)), PLAN).unexpected


def test_missing_patches_fail_the_case():
    verdict = evaluate(RobustnessCase("plain", {}, patches=(1, 2, 1)), PLAN)
    assert verdict.failures == ("patches (1,), expected (1, 2, 1)",)


@pytest.mark.parametrize(
    ("criterion", "failure"),
    [
        (Criterion("load", 2e-9, 1e-9), "load 2.0e-09 > 1e-09"),
        (Criterion("load", np.nan, 1e-9), "load nan > 1e-09"),
        (Criterion("steps", 1e-3, 2e-2, -0.5), "steps 1.0e-03 does not decrease (order -0.5)"),
        (Criterion("steps", 1e-3, 2e-2, -0.5, floor=2e-3), ""),
        (Criterion("steps", 1e-3, 2e-2, 1.0), ""),
    ],
)
def test_criterion_describes_its_failure(criterion, failure):
    assert criterion.failure == failure
    assert criterion.holds == (not failure)


def test_depth_of_rigid_bodies_is_that_of_the_closed_forms():
    rig = RobustnessCase("rig", {})
    crown, area = 0.5, 1.1e-11 * 0.1 * 1e-3 * 300.0 * 1_350_000
    free = rigid_depth(rig.scenario(1_350_000, {}))
    assert free == pytest.approx((0.75 * area / (2.0 * crown) ** 0.5) ** (2.0 / 3.0), rel=1e-9)
    ended = rigid_depth(rig.scenario(1_350_000, {"roller.width": "10 mm"}))
    assert area == pytest.approx(0.01 * ended - 0.005**3 / (3.0 * crown), rel=1e-9)
    spring = {"load": {"kind": "spring", "normal_force": "300 N", "stiffness": "690 N/mm"}}
    depth, stiffness = rigid_depth(rig.scenario(1_350_000, spring)), 6.9e5
    unloaded = (stiffness * depth / 300.0) ** 0.5
    passes = (300.0 / stiffness) ** 0.5 * np.arctanh(unloaded) - depth**0.5
    passes *= 4.0 * (2.0 * crown) ** 0.5 / (area / 300.0 / 1_350_000 * stiffness)
    assert passes == pytest.approx(1_350_000, rel=1e-6)


def test_wrong_depth_of_a_known_case_is_detected(monkeypatch):
    (known,) = (case for case in hard_cases(PASSES) if case.name == "load step x3")
    plan = replace(PLAN, steps=1, doublings=0)
    assert evaluate(known, plan).criterion("truth").holds
    monkeypatch.setattr(evaluation, "rigid_depth", lambda scenario: 1.01 * rigid_depth(scenario))
    assert any("truth" in text for text in evaluate(known, plan).failures)


def test_names_of_cases_are_unique():
    names = [case.name for case in hard_cases(PASSES)]
    assert len(set(names)) == len(names)


def test_verdicts_in_json_and_markdown(monkeypatch):
    refused = RobustnessCase("narrow", {"contact.width": "1 mm"}, refused=("[contact] width",))
    monkeypatch.setattr(hard_module, "hard_cases", lambda passes: (PLAIN, refused))
    progress = []
    verdicts = hard(Effort(quick=True), lambda name, part: progress.append((name, part)))
    assert [name for name, _ in progress[:2]] == ["plain", "narrow"]
    assert progress[-1][1] == 1.0
    assert all(verdict.holds for verdict in verdicts)
    kept = json.loads(json.dumps([verdict.as_json() for verdict in verdicts]))
    assert [item["case"] for item in kept] == [verdict.case for verdict in verdicts]
    assert tuple(map(Verdict.from_json, kept)) == verdicts
    checks = {check["name"] for check in kept[0]["checks"]}
    assert checks == set(CRITERIA) - {
        "tolerance",
        "truth",
    }  # not of this case in the quick evaluation
    text = hard_markdown(verdicts)
    assert text.startswith(f"{len(verdicts)} of {len(verdicts)} pass.")
    assert all(f"| {verdict.case} |" in text for verdict in verdicts)


def test_failed_case_is_bold_in_markdown():
    wrong = Verdict("wrong", criteria=(Criterion("load", 1.0, 1e-9),))
    assert "**failed**: load 1.0e+00 > 1e-09" in hard_markdown((wrong,))
    assert Verdict.from_json(wrong.as_json()).failures == wrong.failures


def test_hard_cases_run_with_another_model(monkeypatch):
    monkeypatch.setattr(hard_module, "hard_cases", lambda passes: (PLAIN,))
    effort = Effort(quick=True, plugin="semi-hertzian")
    (verdict,) = hard(effort, lambda name, part: None)
    assert verdict.criterion("volume").holds
    assert verdict.figures["depth_m"] > 0.0
    slender = evaluate(PLAIN, Plan.of(quick=True, changes={}))
    assert verdict.figures["depth_m"] != slender.figures["depth_m"]
    assert shipped_scenario("rig-450min").contact.model == "slender"
