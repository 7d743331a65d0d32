"""Forms along the axis: against closed forms, against crowns, in every study that solves them."""

from __future__ import annotations

import math

import numpy as np
import pytest

import wearsim
from tests.rig_text import RUBBING, short_rig
from wearsim.errors import CapabilityError, ScenarioError
from wearsim.plugins import AxialPair
from wearsim.scenario import Scenario
from wearsim.scenario.axial_gap import AxialGap
from wearsim.scenario.tables.axial import described_form, pair_of
from wearsim.studies.run.assemble import assemble_problem
from wearsim.studies.run.draws import draw
from wearsim.studies.run.setup import Setup

MODULUS = 200e9 / (2.0 * (1.0 - 0.3**2))
LOAD, LENGTH = 5000.0, 10e-3
LINE = """
[roller]
radius = "20 mm"
width = "10 mm"
material = "steel"
axial_profile = {form = "logarithmic", design_load = "5 kN"}

[cylinder]
radius = "25 mm"
material = "steel"

[operation]
speed = "1000 rpm"
duration = "30 s"
rollers = 3

[load]
kind = "constant"
normal_force = "5 kN"

[wear]
law = "archard-dissipation"
cylinder.k_over_h = "1.1e-12 1/Pa"
roller.k_over_h = "1.1e-12 1/Pa"
"""
FORM = "roller.axial_profile"


def line(**changes: object) -> Scenario:
    """Return the scenario of rollers that are logarithmic unless changed."""
    overrides = {f"{FORM}.{key}": value for key, value in changes.items()}
    return Scenario.from_toml(LINE + RUBBING, overrides)


def rig(overrides: dict[str, object] | None = None) -> Scenario:
    return Scenario.from_toml(short_rig(), overrides)


def roller_profile(scenario: Scenario):
    pair = pair_of(scenario.roller, scenario.cylinder, scenario.pair)
    return scenario.roller.axial_profile.build(pair)


def test_lundberg_carries_a_uniform_load():
    solution = wearsim.solve_contact(line(variant="lundberg"))
    inner = solution.line_load[np.abs(solution.y) < 0.45 * LENGTH]
    middle = 0.5 * (inner.max() + inner.min())
    assert np.abs(inner / middle - 1.0).max() < 0.01
    assert middle == pytest.approx(LOAD / LENGTH, rel=0.02)


def test_lundberg_is_the_closed_form():
    y = np.linspace(-0.499, 0.499, 101) * LENGTH
    scale = LOAD / LENGTH / (math.pi * MODULUS)
    expected = scale * np.log(1.0 / (1.0 - (2.0 * y / LENGTH) ** 2))
    drop = roller_profile(line(variant="lundberg")).drop(y)
    assert drop == pytest.approx(expected, rel=1e-12, abs=1e-18)


def johns_gohar(y: np.ndarray) -> np.ndarray:
    """Return the drop of Johns and Gohar after their own formula, with 0.3033 in full."""
    line_load = LOAD / LENGTH
    half_length = math.sqrt(4.0 * line_load / (math.pi * MODULUS * (1.0 / 0.02 + 1.0 / 0.025)))
    part = 0.5 * math.exp(-0.5) * 2.0 * half_length / LENGTH
    scale = line_load / (math.pi * MODULUS)
    return scale * np.log(1.0 / (1.0 - (1.0 - part) * (2.0 * y / LENGTH) ** 2))


def test_fujiwara_with_unit_constants_is_johns_gohar():
    y = np.linspace(-0.5, 0.5, 101) * LENGTH
    end = float(johns_gohar(np.array([0.5 * LENGTH]))[0])
    for scenario in (line(), line(k1=1.0, k2=1.0, drop=f"{end!r} m")):
        assert roller_profile(scenario).drop(y) == pytest.approx(
            johns_gohar(y), rel=1e-9, abs=1e-18
        )


def test_fujiwara_is_flat_inside_and_drops_by_z_m():
    profile = roller_profile(line(k1=1.5, k2=0.6, drop="20 um"))
    assert (profile.drop(np.linspace(-1.99e-3, 1.99e-3, 5)) == 0.0).all()
    assert profile.drop(np.array([-5e-3, 5e-3])) == pytest.approx(20e-6, rel=1e-12)
    s, scale = 2e-3, 1.5 * LOAD / LENGTH / (math.pi * MODULUS)  # from the flat part
    part = (1.0 - math.exp(-20e-6 / scale)) * (s / 3e-3) ** 2
    expected = scale * math.log(1.0 / (1.0 - part))
    assert profile.drop(np.array([4e-3])) == pytest.approx(expected, rel=1e-12)


def test_peak_pressure_converges_in_strips():
    form = {"k1": 1.5, "k2": 0.7, "drop": "40 um"}
    for tilt in (0.0, 5e-4):
        peaks = []
        for strips in (245, 325, 485):
            changed = line(**form).changed(
                {"contact.strips": strips, "creepage.tilt": f"{tilt} rad"}
            )
            peaks.append(wearsim.solve_contact(changed).peak_pressure)
        assert peaks[:2] == pytest.approx([peaks[2]] * 2, rel=5e-3)


def test_crown_as_a_form_equals_crown_radius_bit_for_bit():
    crowned, formed = rig(), rig({FORM: {"form": "crown", "radius": "500 mm"}})
    assert "crown_radius" not in formed.text
    first, second = wearsim.run(crowned), wearsim.run(formed)
    assert np.array_equal(first.profiles, second.profiles)
    assert np.array_equal(first.peak_pressure, second.peak_pressure)


def test_crowned_cylinder_adds_its_curvature():
    both = {
        "roller.crown_radius": "800 mm",
        "cylinder.axial_profile": {"form": "crown", "radius": f"{1e3 / (2.0 - 1.0 / 0.8)!r} mm"},
    }
    first, second = (wearsim.solve_contact(rig(changes)) for changes in ({}, both))
    assert second.line_load == pytest.approx(first.line_load, rel=1e-9)
    tilted = wearsim.solve_contact(
        rig({**both, "roller.offset": "1 mm", "creepage.tilt": "1 mrad"})
    )
    middle = np.average(tilted.y, weights=tilted.line_load)
    assert middle == pytest.approx(1e-3 * 0.5 / 0.8 - 0.5 * 1e-3, abs=1e-6)


def test_free_rollers_have_the_radius_of_their_form():
    free = {"creepage.drive": "free", "creepage.bearing_torque": "10 N mm"}
    text = short_rig().replace("longitudinal = 1e-3", "")
    problems = [
        assemble_problem(draw(Scenario.from_toml(text, {**free, **form})))[0]
        for form in ({}, {FORM: {"form": "crown", "radius": "500 mm"}})
    ]
    assert np.array_equal(problems[0].roller_drop, problems[1].roller_drop)
    assert problems[0].roller_drop.max() == pytest.approx(
        np.square(problems[0].grid.y).max() / (2.0 * 0.5)
    )


def test_table_of_a_crown_has_the_contact_of_the_crown(tmp_path):
    y = np.linspace(-8.0, 8.0, 1601)
    rows = [f"{at!r}, {-at * at / 1e3 * 1e3!r}" for at in y.tolist()]  # um, of 500 mm
    (tmp_path / "crown.csv").write_text("\n".join(["y [mm], height [um]", *rows]))
    table = Scenario.from_toml(short_rig(), {FORM: "crown.csv"}, folder=tmp_path)
    assert table.roller.width == pytest.approx(16e-3)
    # the strips of the table resolve less: those of the crown for both
    strips = {"contact.strips": 121, "contact.width": "5 mm"}
    found = wearsim.solve_contact(table.changed(strips))
    expected = wearsim.solve_contact(rig(strips))
    assert found.peak_pressure == pytest.approx(expected.peak_pressure, rel=2e-4)
    assert found.power == pytest.approx(expected.power, rel=1e-3)
    assert wearsim.solve_contact(table).peak_pressure == pytest.approx(
        found.peak_pressure, rel=2e-3
    )


def test_partial_crown_is_an_arc_of_a_circle():
    profile = roller_profile(
        rig({FORM: {"form": "partial-crown", "straight": "6 mm", "radius": "9 mm"}})
    )
    away = np.array([0.0, 1e-3, 4e-3])
    arc = 9e-3 - np.sqrt(9e-3**2 - away**2)
    assert profile.drop(3e-3 + away) == pytest.approx(arc, rel=1e-12)
    assert profile.drop(-3e-3 - away) == pytest.approx(arc, rel=1e-12)


def test_straight_roller_carries_its_load_on_its_width():
    text = LINE.replace('{form = "logarithmic", design_load = "5 kN"}', '"straight"')
    straight = Scenario.from_toml(text + RUBBING, {"contact.strips": 125})
    solution = wearsim.solve_contact(straight)
    assert (np.abs(solution.y[solution.line_load > 0.0]) < 0.5 * LENGTH).all()
    assert solution.line_load.sum() * (solution.y[1] - solution.y[0]) == pytest.approx(LOAD)


class Parabola:
    """A crown that does not say so, so that the gap is tabulated."""

    crown_radius, length = None, math.inf

    def drop(self, s):
        return s * s / (2.0 * 0.5)


def test_tabulated_gap_agrees_with_the_closed_forms_of_a_crown():
    straight = rig().cylinder.axial_profile.build(AxialPair(None, MODULUS, 90.0))
    crown = rig().axial_gap
    gap = AxialGap(Parabola(), straight, None, 0.02)  # type: ignore[arg-type]
    assert not gap.is_crowned
    depths = np.array([1e-6, 1e-5, 5e-5, 2e-4])
    assert gap.half_width(depths) == pytest.approx(crown.half_width(depths), rel=1e-4)
    areas = 4.0 / 3.0 * depths * np.sqrt(2.0 * 0.5 * depths)
    assert gap.depth_of(areas) == pytest.approx(depths, rel=1e-4)
    assert gap.radius_at(2e-3) == pytest.approx(0.5, rel=1e-4)
    tilt = np.array([-1e-3, 0.0, 2e-4, 1e-3])
    assert gap.shift(tilt, 1e-3) == pytest.approx(-0.5 * tilt, rel=1e-4, abs=1e-8)


def test_estimated_patch_is_near_the_contact():
    form = {"k1": 1.5, "k2": 0.6, "drop": "40 um"}
    for force in (300.0, 1000.0, 5000.0):
        scenario = line(**form).changed({"load.normal_force": f"{force} N"})
        patch, solution = Setup(scenario).fresh_patch(force), wearsim.solve_contact(scenario)
        width = np.ptp(solution.y[solution.line_load > 0.0])
        assert 2.0 * patch.b == pytest.approx(width, rel=0.15)
        assert patch.peak_pressure == pytest.approx(solution.peak_pressure, rel=0.1)


@pytest.mark.parametrize("model", ["hertz", "hertz-fastsim", "semi-hertzian"])
def test_models_of_ellipses_refuse_other_forms(model):
    with pytest.raises(CapabilityError, match=f"'{model}'.*parabola.*'logarithmic'.*'slender'"):
        wearsim.solve_contact(line().changed({"contact.model": model}))


MISTAKES = {
    "no length": ({f"{FORM}": {"form": "logarithmic", "design_load": "1 kN"}}, "length is needed"),
    "a roller wider than its profile": (
        {
            "roller.width": "12 mm",
            FORM: {"form": "logarithmic", "design_load": "1 kN", "length": "9 mm"},
        },
        r"\[roller\] width: exceeds its profile, got 12 mm, expected at most 9 mm",
    ),
    "a drop without end": (
        {
            "roller.width": "9 mm",
            FORM: {
                "form": "logarithmic",
                "design_load": "1 kN",
                "variant": "lundberg",
                "drop": "9 um",
            },
        },
        "drop has no meaning",
    ),
    "an unknown form": ({FORM: {"form": "barrel"}}, "no axial profile is named 'barrel'"),
    "a crown and a form": (
        {FORM: "straight", "roller.crown_radius": "500 mm"},
        "crown_radius and axial_profile",
    ),
    "a random length": (
        {
            FORM: {
                "form": "logarithmic",
                "design_load": "1 kN",
                "length": {"distribution": "uniform", "low": "9 mm", "high": "10 mm"},
            }
        },
        "length: cannot be random",
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_in_forms_are_reported(name):
    overrides, message = MISTAKES[name]
    with pytest.raises(ScenarioError, match=message):
        rig(overrides)


def test_form_in_words_has_its_options():
    text = described_form(line(k1=1.5, drop="20 um").roller.axial_profile)
    assert text == "logarithmic, design load 5 kN, drop 20 um, k1 1.5"


RANDOM = {
    f"{FORM}.k1": {"distribution": "uniform", "low": 1.0, "high": 2.0},
    f"{FORM}.drop": {"distribution": "uniform", "low": "10 um", "high": "20 um"},
    "contact.strips": 31,
}


def test_random_forms_are_those_of_single_contacts():
    scenario = line().changed(RANDOM)
    study = wearsim.dissipation(scenario, 3)
    for number in range(3):
        k1, drop = (float(study.values(f"{FORM}.{key}")[number]) for key in ("k1", "drop"))
        single = wearsim.solve_contact(
            scenario.changed({f"{FORM}.k1": k1, f"{FORM}.drop": f"{drop!r} m"})
        )
        assert study.power[number] == pytest.approx(single.power, rel=1e-9)


def test_ensemble_of_random_forms_equals_its_runs(tmp_path):
    scenario = line().changed({**RANDOM, "evolution.tolerance": 1e-2})
    ensemble = wearsim.ensemble(scenario, 3, tmp_path / "e.h5", workers=1)
    single = wearsim.run(scenario.changed({"sampling.realisation": 2}))
    assert ensemble.values("depth")[2, -1] == single.depth[-1]
