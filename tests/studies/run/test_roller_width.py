"""Rollers with a width: contact ends where the roller ends."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.evolution import SCENARIOS
from wearsim.errors import CapabilityError, ScenarioError
from wearsim.mechanics.hertz.elasticity import combine
from wearsim.scenario import Scenario, load_scenario
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.contact.single import study_contact
from wearsim.studies.dissipation.monte_carlo import dissipation
from wearsim.studies.ensemble.api import ensemble
from wearsim.studies.plausibility import plausibility_warnings
from wearsim.studies.run import run as studies
from wearsim.studies.run.setup import Setup

FLAT = {"roller__crown_radius": "1e9 mm", "roller__width": "10 mm"}
WIDTH, LOAD, RADIUS = 10e-3, 300.0, 1.0 / (1.0 / 0.02 + 1.0 / 0.025)


def short(**overrides: object) -> Scenario:
    """Return 6000 passes of the rig with overrides, on strips that the program chooses."""
    values = {"operation__passes": 6000, **overrides}
    dotted = {key.replace("__", "."): value for key, value in values.items()}
    return load_scenario(SCENARIOS / "rig-450min.toml", dotted)


def modulus(scenario: Scenario) -> float:
    return combine(scenario.cylinder.material, scenario.roller.material).contact_modulus


def test_worn_line_contact_has_the_pressure_of_hertz() -> None:
    scenario = short(**FLAT, operation__passes=300_000)
    run = studies.run(scenario)
    loaded = run.line_load[-1] > 0.0
    spacing = float(run.y[1] - run.y[0])
    # strips end with the roller, and wear makes the line load uniform
    assert loaded.sum() * spacing == pytest.approx(WIDTH, rel=1e-9)
    assert run.line_load[-1][loaded] == pytest.approx(LOAD / WIDTH, rel=0.02)
    uniform = LOAD / WIDTH
    pressure = np.sqrt(uniform * modulus(scenario) / (np.pi * RADIUS))
    half_length = np.sqrt(4.0 * uniform * RADIUS / (np.pi * modulus(scenario)))
    assert run.peak_pressure[-1] == pytest.approx(pressure, rel=0.01)
    assert run.values("half_length")[-1][loaded] == pytest.approx(half_length, rel=0.01)
    volume = 1.1e-11 * run.dissipated_energy[-1]
    assert run.worn_volume[-1] == pytest.approx(volume, rel=1e-12, abs=0.0)
    depth = volume / (2.0 * np.pi * 0.025 * WIDTH)
    assert run.depth[-1] == pytest.approx(depth, rel=0.05)
    assert run.profiles[-1][~loaded] == pytest.approx(0.0, abs=1e-20)


@pytest.mark.parametrize("width", ["10 mm", "40 mm"])
def test_fresh_line_contact_carries_the_load_of_hertz_between_its_ends(width: str) -> None:
    scenario = short(roller__crown_radius="1e9 mm", roller__width=width, contact__strips=201)
    solution = study_contact(scenario).solution
    spacing = float(solution.y[1] - solution.y[0])
    mean = LOAD / (scenario.roller.width or 0.0)
    inner = np.abs(solution.y) < 0.4 * (scenario.roller.width or 0.0)
    assert solution.line_load.sum() * spacing == pytest.approx(LOAD, rel=1e-10)
    # the ends of a stiff roller on a longer cylinder carry more than the middle
    assert solution.line_load[inner] == pytest.approx(mean, rel=0.12)
    exact = np.sqrt(4.0 * solution.line_load * RADIUS / (np.pi * modulus(scenario)))
    assert solution.half_length[inner] == pytest.approx(exact[inner], rel=1e-3)
    assert solution.power == pytest.approx(0.1 * LOAD * scenario.rolling_speed * 1e-3, rel=1e-9)


def test_wide_roller_changes_nothing() -> None:
    crowned, wide = studies.run(short()), studies.run(short(roller__width="30 mm"))
    np.testing.assert_array_equal(wide.profiles, crowned.profiles)
    np.testing.assert_array_equal(wide.line_load, crowned.line_load)


def test_edges_are_part_of_the_gap() -> None:
    s = np.array([0.0, 4.4e-3, 4.5e-3, 4.75e-3, 5e-3, 5.01e-3])
    rounded = short(**FLAT, roller__edge_radius="0.5 mm").roller.edge_drop(s)
    expected = [0.0, 0.0, 0.0, 0.5e-3 * (1.0 - np.sqrt(0.75)), 0.5e-3, 20e-3]
    assert rounded == pytest.approx(expected, abs=1e-10)
    chamfer = {"roller__chamfer": "0.5 mm", "roller__chamfer_angle": "30 deg"}
    cut = short(**FLAT, **chamfer).roller.edge_drop(s)
    tangent = np.tan(np.radians(30.0))
    expected = [0.0, 0.0, 0.0, 0.25e-3 * tangent, 0.5e-3 * tangent, 20e-3]
    assert cut == pytest.approx(expected, abs=1e-15)


def test_rounded_edge_carries_less_than_a_sharp_one() -> None:
    sharp, rounded = (
        study_contact(short(**{**FLAT, "contact__strips": 241, **edge})).solution
        for edge in ({}, {"roller__edge_radius": "5 mm", "roller__width": "20 mm"})
    )
    # both have 10 mm without a drop
    assert rounded.peak_pressure < 0.9 * sharp.peak_pressure
    assert rounded.line_load[np.abs(rounded.y) > 5.5e-3].max() == 0.0
    assert rounded.line_load[np.abs(rounded.y) < 4.9e-3].min() > 0.0


def test_tilted_and_shifted_rollers_end_where_they_are() -> None:
    offsets = ["0 mm", "2 mm", "2 mm"]
    scenario = short(
        roller__width="4 mm",
        roller__offset=offsets,
        creepage__tilt=["1 mrad", "-1 mrad", "-1 mrad"],
        wear__roller__k_over_h="2e-12 1/Pa",
        wear__cylinder__k_over_h="1.1e-10 1/Pa",
    )
    run = studies.run(scenario)
    for number, offset in enumerate((0.0, 2e-3)):
        load = run.line_load[-1][number]
        spacing = float(run.y[1] - run.y[0])
        outside = np.abs(run.y - offset) > 2e-3 + 0.51 * spacing
        assert load.sum() * spacing == pytest.approx(LOAD, rel=1e-8)
        assert load[outside].max() == 0.0
        assert load[~outside].max() > 0.0
        assert run.roller_profiles[-1][number][outside].max() == 0.0
    assert run.profiles[-1][run.y > 4.1e-3].max() == 0.0


def test_realisations_share_strips_that_end_with_the_roller(tmp_path: Path) -> None:
    random = {"distribution": "uniform", "low": "-0.3 mrad", "high": "0.3 mrad"}
    scenario = short(**FLAT, creepage__tilt=random, outputs__records=2)
    result = ensemble(scenario, 4, tmp_path / "e.h5", scheduler="serial")
    assert result.failed == 0
    spacing = float(result.y[1] - result.y[0])
    assert (10e-3 / spacing) == pytest.approx(round(10e-3 / spacing), rel=1e-9)


def test_realisations_of_one_contact_end_with_the_roller(tmp_path: Path) -> None:
    random = {"distribution": "uniform", "low": "-0.3 mrad", "high": "0.3 mrad"}
    result = dissipation(short(**FLAT, creepage__tilt=random), 20, tmp_path / "d.h5")
    spacing = float(result.y[1] - result.y[0])
    assert spacing * len(result.y) == pytest.approx(WIDTH + 4.0 * spacing, rel=1e-9)
    full = 0.1 * LOAD * result.scenario.rolling_speed * 1e-3
    assert result.values("power") == pytest.approx(full, rel=0.02)


@pytest.mark.parametrize("edge", [{}, {"roller.edge_radius": "0.5 mm"}])
def test_error_of_the_peak_pressure_contains_that_at_the_ends(edge: dict[str, object]) -> None:
    """The contact is shorter at an end under the same line load, which coarse strips average."""
    changes = {"roller.width": "8 mm", "operation.passes": 300_000, **edge}
    coarse, fine, inside = (
        studies.run(shipped_scenario("rig-450min", {**changes, "contact.strips": strips, **other}))
        for strips, other in ((41, {}), (241, {}), (41, {"operation.passes": 3000}))
    )
    peaks = [float(run.peak_pressure[-1].max()) for run in (coarse, fine, inside)]
    errors = [float(run.errors["peak_pressure"][-1].max()) for run in (coarse, fine, inside)]
    assert peaks[1] > 1.05 * peaks[0]
    assert abs(peaks[1] - peaks[0]) < errors[0]
    assert errors[2] < 0.1 * peaks[2]  # before the groove reaches the ends


@pytest.mark.parametrize("model", ["hertz", "hertz-fastsim", "semi-hertzian"])
def test_models_that_fit_a_parabola_are_refused(model: str) -> None:
    with pytest.raises(CapabilityError, match=r"does not end with roller\.width"):
        study_contact(short(**FLAT, contact__model=model))


def test_unresolved_edge_gives_a_warning() -> None:
    warned = [*plausibility_warnings(Setup(short(**FLAT)))]
    assert any("roller.width: a sharp edge" in text for text in warned)
    warned = [*plausibility_warnings(Setup(short(**FLAT, roller__edge_radius="0.5 mm")))]
    assert any("edge_radius: the edge is in contact over about 0.032 mm" in t for t in warned)
    for quiet in (
        {"roller__edge_radius": "4.9 mm", "contact__strips": 401},
        {"roller__width": "30 mm"},
    ):
        settings = {**FLAT, **quiet}
        if "roller__width" in quiet:
            settings.pop("roller__crown_radius")
        assert not [t for t in plausibility_warnings(Setup(short(**settings))) if "roller." in t]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"roller__edge_radius": "1 mm"}, "edge_radius: needs the width of the roller, got 1 mm"),
        (
            {**FLAT, "roller__chamfer": "6 mm"},
            "chamfer: the edges meet, got 6 mm, expected at most",
        ),
        (
            {**FLAT, "roller__chamfer": "1 mm", "roller__edge_radius": "1 mm"},
            "chamfer: an edge is rounded or chamfered, expected one of them",
        ),
        (
            {**FLAT, "roller__chamfer": "1 mm", "roller__chamfer_angle": "95 deg"},
            "chamfer_angle: is too great, got 95 deg",
        ),
        ({"roller__width": "-1 mm"}, "width: must be above zero"),
    ],
)
def test_edges_that_cannot_be_are_mistakes(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        short(**changes)
    assert message in str(caught.value)
