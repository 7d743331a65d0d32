"""Dissipation of one contact with random inputs: values, draws, strips and failures."""

from __future__ import annotations

import re
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from dissipation_examples import COARSE, NO_ANGLES, contact, field, normal, paper, positive

from wearsim.errors import ContactError, Interrupted, ScenarioError
from wearsim.scenario import realise
from wearsim.studies.contact.batch import Realisations, acting_inputs
from wearsim.studies.contact.single import study_contact
from wearsim.studies.dissipation import monte_carlo as study
from wearsim.studies.dissipation.monte_carlo import dissipation
from wearsim.studies.dissipation.result import DissipationResult
from wearsim.studies.opening import open_dissipation
from wearsim.studies.preparation import bytes_per_realisation
from wearsim.studies.run.draws import Drawer

# mean and std [W]: converged, from another program
PAPERS = {"no angles": (NO_ANGLES, 0.0739, 0.040), "all random": ({}, 0.1058, 0.047)}


@pytest.fixture(scope="module")
def all_random() -> DissipationResult:
    """Return the paper's Monte Carlo on a coarse grid."""
    return dissipation(paper(**COARSE), 20_000)


@pytest.mark.parametrize("case", PAPERS)
def test_paper_scenario_has_expected_power(case):
    changes, mean, std = PAPERS[case]
    scenario = paper(**COARSE, **changes)
    power = dissipation(scenario, 20_000).summaries["power"]
    assert power.mean_error < 0.004 * mean  # four standard errors are then a useful tolerance
    assert power.mean == pytest.approx(mean, abs=4 * power.mean_error)
    assert power.std == pytest.approx(std, abs=4 * power.std_error + 0.0005)  # as printed


@pytest.mark.parametrize(
    ("probability", "expected"), [(0.05, 0.035), (0.95, 0.188), (0.025, 0.025), (0.975, 0.207)]
)
def test_paper_scenario_has_expected_quantiles(all_random, probability, expected):
    found = all_random.summaries["power"].quantile(probability)
    assert found.high - found.low < 0.03 * 0.207
    assert found.low - 0.0005 <= expected <= found.high + 0.0005  # as printed


def test_paper_scenario_runs_unchanged():
    scenario = paper()
    result = dissipation(scenario, 200)
    assert result.finished
    assert result.raw.strip_width == pytest.approx(2 * 1.5565e-3 / 50, rel=1e-3)  # of 307 N
    # the power is bounded by mu N V |creepage|, where spin adds to the creepage off the centre
    drawn = result.inputs
    creepage = np.hypot(drawn["creepage.longitudinal"], drawn["creepage.yaw"])
    bound = drawn["friction.coefficient"] * drawn["load.normal_force"] * scenario.rolling_speed
    spin = np.abs(drawn["creepage.tilt"]) / scenario.roller.radius
    assert (result.power <= bound * (creepage + spin * 1.8e-3)).all()


def test_power_is_work_of_the_forces():
    result = dissipation(paper(**COARSE), 300)
    drawn = result.inputs
    work = drawn["creepage.longitudinal"] * result.values("force_x")
    work += drawn["creepage.yaw"] * result.values("force_y")
    work += drawn["creepage.tilt"] / 0.02 * result.values("spin_moment")
    np.testing.assert_allclose(result.power, -result.scenario.rolling_speed * work, rtol=1e-10)
    strips = result.dissipation.sum(axis=1) * result.raw.strip_width
    np.testing.assert_allclose(result.power, strips, rtol=1e-10)


def test_solutions_are_bitwise_independent_of_batches():
    scenario = contact(
        roller__offset=normal("0 mm", "0.2 mm"),
        creepage__misalignment={"distribution": "disc", "radius": "1 mrad"},
        friction__coefficient=positive(0.1, 0.01),
    )
    whole = Realisations(scenario, 60).solve(0, 60)
    parts = Realisations(scenario, 60)
    for first in (40, 0, 20, 59):
        count = min(20, 60 - first)
        part = parts.solve(first, count)
        expected_part = vars(whole.at(np.arange(first, first + count)))
        for name, column in vars(part).items():
            expected = expected_part[name]
            same = column is expected is None or column.tobytes() == expected.tobytes()
            assert same, name


def test_study_is_independent_of_batch_size(monkeypatch):
    whole = dissipation(contact(), 50)
    monkeypatch.setattr(study, "BATCH", 7)
    parts = dissipation(contact(), 50)
    for name, array in whole.raw.variables.items():
        assert array.tobytes() == parts.raw.variables[name].tobytes(), name
    assert whole.raw.statistics == parts.raw.statistics


@pytest.mark.parametrize("plan", ["monte-carlo", "latin-hypercube", "sobol"])
def test_added_input_does_not_change_other_draws(plan):
    one = dissipation(contact(sampling__plan=plan), 20).inputs
    two = dissipation(contact(sampling__plan=plan, creepage__longitudinal=normal(1e-3, 1e-4)), 20)
    key = "load.normal_force"
    assert one[key].tobytes() == two.inputs[key].tobytes()
    assert two.inputs["creepage.longitudinal"].std() > 0.0
    warned = any("too wide for" in text for text in two.warnings)
    assert warned == (plan == "latin-hypercube")


CASES: dict[str, dict[str, object]] = {
    "angles that shift": {
        "creepage__misalignment": {"distribution": "disc", "radius": "1 mrad"},
    },
    "angles that do not": {
        "creepage__misalignment": {"distribution": "disc", "radius": "1 mrad"},
        "creepage__tilt_shifts_contact": False,
    },
    "differential slip": {
        "creepage__differential_slip": True,
        "creepage__tilt_shifts_contact": False,
        "creepage__tilt": normal("0.2 mrad", "0.1 mrad"),
        "roller__offset": normal("0.1 mm", "0.1 mm"),
    },
    "a worn cylinder": {
        "cylinder__profile": "worn.csv",
        "contact__model": "slender",
        "creepage__differential_slip": True,
        "roller__offset": normal("0 mm", "0.1 mm"),
    },
    "free rollers": {
        "creepage": {
            "drive": "free",
            "bearing_torque": positive("0.3 N*m", "0.02 N*m"),
            "differential_slip": True,
            "tilt": "0.3 mrad",
        },
    },
}
WORN = "y [mm],height [um]\n" + "".join(
    f"{k / 10},{-3.0 * np.exp(-((k / 15) ** 2)):.6f}\n" for k in range(-40, 41)
)


@pytest.mark.parametrize("case", CASES)
def test_realisation_is_the_contact_with_its_values(case):
    settings = {"contact__strips": 81, "contact__width": "6 mm", "contact__centre": "0 mm"}
    changes = {**settings, **CASES[case]}
    if case in {"a worn cylinder", "free rollers"}:
        changes |= {
            "contact": {"model": "slender", "strips": 81, "width": "6 mm", "centre": "0 mm"}
        }
        changes = {k: v for k, v in changes.items() if not k.startswith("contact__")}
    scenario = contact(files={"worn.csv": WORN}, **changes)
    batch = Realisations(scenario, 3)
    found = batch.solve(0, 3)
    for k in range(3):
        values = {key: float(drawn[k]) for key, drawn in batch.values.items()}
        single = study_contact(realise(scenario, values)).solution
        np.testing.assert_allclose(found.y, single.y, atol=1e-18)
        for name in ("power", "force_x", "force_y", "spin_moment", "longitudinal_creepage"):
            assert getattr(found, name)[k] == pytest.approx(
                getattr(single, name), rel=1e-9, abs=1e-12
            ), name
        np.testing.assert_allclose(found.dissipation[k], single.dissipation, rtol=1e-7, atol=1e-9)


def test_mean_problem_has_all_inputs_at_their_mean():
    scenario = paper(**NO_ANGLES, **COARSE)
    result = dissipation(scenario, 5)
    single = study_contact(scenario).solution.power
    assert result.mean_problem_power == pytest.approx(single, rel=1e-4)  # on wider strips
    over = result.values("mean_problem_dissipation").sum() * result.raw.strip_width
    assert over == pytest.approx(result.mean_problem_power, rel=1e-12)


def test_loads_are_distributed_about_the_initial_load():
    scenario = contact(load__kind="spring", load__stiffness="690 N/mm")
    result = dissipation(scenario, 400)
    loads = result.values("normal_force")
    np.testing.assert_allclose(loads, result.inputs["load.normal_force"], rtol=1e-14)
    assert loads.mean() == pytest.approx(300.0, abs=4 * 30 / 20)


def test_process_is_drawn_from_its_marginal():
    process = {
        "distribution": "ornstein-uhlenbeck",
        "correlation_time": "5 min",
        "marginal": positive("320 N", "10 N"),
    }
    loads = dissipation(contact(load__normal_force=process), 4000).values("normal_force")
    assert loads.mean() == pytest.approx(320.0, abs=4 * 10 / 4000**0.5)
    assert loads.std() == pytest.approx(10.0, abs=4 * 10 / 8000**0.5)


def test_inputs_without_effect_are_noted_and_not_drawn():
    factor = positive("1.1e-11 1/Pa", "1e-12 1/Pa")
    scenario = contact(
        wear={"cylinder": {"k_over_h": factor}, "roller": {"k_over_h": "0 1/Pa"}},
        load__kind="spring",
        load__stiffness=positive("690 N/mm", "10 N/mm"),
    )
    result, plain = dissipation(scenario, 10), dissipation(contact(), 10)
    assert list(result.inputs) == ["load.normal_force"]
    (note,) = [text for text in result.notes if "no effect" in text]
    assert note.startswith("load.stiffness, wear.cylinder.k_over_h have no effect")
    assert result.power.tobytes() == plain.power.tobytes()


def test_study_without_random_inputs_is_refused():
    with pytest.raises(ScenarioError, match="no random input acts on the contact"):
        dissipation(contact(load__normal_force="300 N"), 10)


def test_strips_cover_the_contacts_of_all_realisations():
    scenario = contact(creepage__tilt=normal("0 mrad", "1 mrad"), contact__my=50)
    contacts = Realisations(scenario, 500)
    grid, mean = contacts.grid, study_contact(scenario)
    assert grid.spacing == pytest.approx(mean.grid.spacing, rel=1e-12)
    # the strips of the mean contact end at its edges: 50 strips, none partly in contact
    load = contacts.solve_mean_problem().line_load[0]
    assert (load > 1e-9 * load.max()).sum() == 50
    solved = contacts.solve(0, 500)
    shift = 0.5 * np.abs(contacts.values["creepage.tilt"]).max()
    assert 2 * shift + 3.0e-3 < grid.spacing * grid.strips < 2 * shift + 4.0e-3
    loads = solved.line_load.sum(axis=-1) * grid.spacing
    np.testing.assert_allclose(loads, contacts.values["load.normal_force"], rtol=1e-12)


def test_strips_of_the_scenario_are_used():
    choice = {"contact__strips": 61, "contact__width": "5 mm", "contact__centre": "0.2 mm"}
    grid = Realisations(contact(**choice), 20).grid
    assert (grid.strips, grid.spacing) == (61, pytest.approx(5e-3 / 61))
    assert grid.y.mean() == pytest.approx(0.2e-3)
    assert Realisations(contact(contact__strips=61), 20).grid.strips == 61


def test_insufficient_width_is_refused():
    with pytest.raises(ScenarioError, match=r"\[contact\] width: the contacts of all realisations"):
        dissipation(contact(contact__width="3.1 mm"), 200)


def test_inputs_needing_too_many_strips_are_refused():
    with pytest.raises(ScenarioError, match=r"a number of strips, such as contact\.strips = 801"):
        dissipation(contact(roller__offset=normal("0 mm", "100 mm")), 20)


def _is_solved(contacts: Realisations, number: int) -> bool:
    try:
        contacts.solve(number, 1)
    except ContactError:
        return False
    return True


def test_realisation_without_solution_is_reported(tmp_path, monkeypatch):
    monkeypatch.setattr(study, "BATCH", 8)
    # patches of light loads are narrower than three strips
    scenario = contact(load__normal_force=positive("300 N", "280 N"), seed=3)
    contacts = Realisations(scenario, 4000)
    loads = contacts.values["load.normal_force"]
    first = min(int(k) for k in np.argsort(loads)[:8] if not _is_solved(contacts, int(k)))
    assert first >= 8  # so that a batch is completed before it
    with pytest.raises(ContactError) as caught:
        dissipation(scenario, 4000, tmp_path / "a.h5")
    message = str(caught.value)
    assert message.startswith(f"realisation {first} of seed 3 has no solution: ")
    assert f"its inputs: load.normal_force {loads[first]:.6g} N" in message
    kept = open_dissipation(tmp_path / "a.h5")
    assert (kept.count, kept.finished, kept.raw.requested) == (first // 8 * 8, False, 4000)


def test_stopped_study_keeps_completed_realisations(tmp_path, monkeypatch):
    monkeypatch.setattr(study, "BATCH", 16)
    seen: list[int] = []
    path = tmp_path / "a.h5"
    with pytest.raises(Interrupted, match=f"stopped after 32 of 100 realisations; .*{path.name}"):
        dissipation(
            contact(),
            100,
            path,
            on_progress=lambda done, total: seen.append(done),
            stop_requested=lambda: len(seen) == 2,
        )
    kept, whole = open_dissipation(path), dissipation(contact(), 100)
    assert (kept.count, kept.finished, seen) == (32, False, [16, 32])
    assert kept.power.tobytes() == whole.power[:32].tobytes()
    assert kept.summaries["power"].count == 32


def test_study_of_one_realisation(tmp_path):
    result = dissipation(contact(), 1, tmp_path / "a.h5")
    power = open_dissipation(tmp_path / "a.h5").summaries["power"]
    assert (power.count, power.mean) == (1, result.power[0])
    assert np.isnan(power.std)
    with pytest.raises(ValueError, match="1 or more, got 0"):
        dissipation(contact(), 0)


def test_statistics_include_profiles_that_are_not_stored(monkeypatch):
    whole = dissipation(contact(), 300)
    monkeypatch.setattr(study, "MOST_KEPT", 100 * len(whole.y) + 5)
    part = dissipation(contact(), 300)
    assert part.dissipation.tobytes() == whole.dissipation[:100].tobytes()
    for name in ("dissipation_mean", "dissipation_std", "power"):
        assert part.values(name).tobytes() == whole.values(name).tobytes()
    np.testing.assert_array_equal(
        part.values("dissipation_high"), np.quantile(whole.dissipation[:100], 0.975, axis=0)
    )
    assert "P_l(y) of the first 100 of 300 realisations is stored" in part.warnings[0]


def test_strip_statistics_are_those_of_the_realisations():
    result = dissipation(contact(), 400)
    rows = result.dissipation
    np.testing.assert_allclose(result.values("dissipation_mean"), rows.mean(axis=0), rtol=1e-13)
    std = rows.std(axis=0, ddof=1)
    np.testing.assert_allclose(result.values("dissipation_std"), std, rtol=1e-10, atol=1e-12)


def test_existing_file_is_refused_before_the_study(tmp_path: Path):
    path = tmp_path / "a.h5"
    path.write_text("content")
    with pytest.raises(Exception, match="force=True replaces it"):
        dissipation(contact(), 2, path)
    assert dissipation(contact(), 2, path, force=True).path == path


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        (
            {"creepage__misalignment": {"distribution": "disc", "radius": "5 deg"}},
            "[creepage] misalignment: moves contacts by up to",
        ),
        (
            {"creepage__tilt": {"distribution": "uniform", "low": "-90 mrad", "high": "90 mrad"}},
            "[creepage] tilt: moves contacts by up",
        ),
    ],
)
def test_excessive_shift_by_tilt_is_reported(changes, text):
    scenario = contact(contact__my=50, **changes)
    with pytest.raises(ScenarioError) as caught:
        dissipation(scenario, 50)
    message = str(caught.value)
    assert text in message
    drawer = Drawer(acting_inputs(scenario)[0], "monte-carlo", 50)
    tilt = np.abs(drawer.columns(0, 50)["creepage.tilt"]).max()
    assert f"{0.5 * tilt * 1e3:.4g} mm, crown radius x tilt = 500 mm x {tilt * 1e3:.4g}" in message
    assert "creepage.tilt_shifts_contact = false" in message
    free = contact(contact__my=50, creepage__tilt_shifts_contact=False, **changes)
    assert Realisations(free, 50).grid.strips < 100


@pytest.mark.parametrize(("scenario", "count"), [({}, 3), (contact(), 2.5), (contact(), "3")])
def test_invalid_arguments_raise_type_error(scenario, count):
    with pytest.raises(TypeError, match=r"^(scenario|realisations) must be a .*, got "):
        dissipation(scenario, count)


def test_memory_per_realisation_is_estimated(monkeypatch):
    monkeypatch.setattr(study, "MOST_KEPT", 1000)
    scenario = paper(contact__mx=4, contact__my=6)

    def peak(count: int) -> int:
        tracemalloc.start()
        dissipation(scenario, count)
        found = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return found

    peak(100)  # compiles kernels and imports modules
    each = (peak(40_000) - peak(10_000)) / 30_000
    assert 0.5 * bytes_per_realisation(scenario) < each < 1.25 * bytes_per_realisation(scenario)


@pytest.mark.parametrize(("mx", "my"), [(16, 24), (16, 400), (400, 24)])
def test_coarse_grid_error_states_least_sufficient_grid(mx, my):
    def scenario(along: int, across: int):
        fine = field("gaussian-field", correlation_length="20 um")
        grid = {"contact__mx": along, "contact__my": across}
        return contact(friction__coefficient=fine, **grid)

    with pytest.raises(ScenarioError) as caught:
        Realisations(scenario(mx, my), 3)
    counts = dict(re.findall(r"contact\.(mx|my) = (\d+)", str(caught.value)))
    assert ("mx" in counts, "my" in counts) == (mx == 16, my == 24)
    needed = {"mx": mx, "my": my} | {key: int(number) for key, number in counts.items()}
    assert Realisations(scenario(needed["mx"], needed["my"]), 3).friction_points == needed["mx"]
    for key in counts:
        less = {**needed, key: needed[key] - 1}
        with pytest.raises(ScenarioError, match="does not resolve"):
            Realisations(scenario(less["mx"], less["my"]), 3)
