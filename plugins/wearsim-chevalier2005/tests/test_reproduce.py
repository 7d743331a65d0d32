"""Comparison with the paper: computed numbers, variants, bounds and reasons."""

from __future__ import annotations

import math
import re
import runpy
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy import integrate

from wearsim.scenario import examples as shipped, load_scenario
from wearsim.studies.dissipation.result import DissipationResult
from wearsim_chevalier2005 import paper
from wearsim_chevalier2005.comparison import compare
from wearsim_chevalier2005.comparison_inputs import EXACT_POWER, maxent_of, printed_area
from wearsim_chevalier2005.comparison_row import Row
from wearsim_chevalier2005.study import (
    VARIANTS,
    Reproduction,
    Variant,
    max_power,
    reproduce,
    white_friction,
)

ROOT = Path(__file__).parents[3]
COUNT = 600
GRID = 5e-4  # error of the grid of the paper in the power of full slip
FindRow = Callable[[str], Row]


@pytest.fixture(scope="module")
def results() -> Reproduction:
    return reproduce(COUNT)


@pytest.fixture(scope="module")
def row(results: Reproduction) -> FindRow:
    rows = {f"{row.part}: {row.name}": row for row in compare(results)}
    assert len(rows) == len(compare(results))  # the names are unique

    def named(name: str) -> Row:
        return rows[name]

    return named


def number(row: Row) -> float:
    assert isinstance(row.here, float)
    return row.here


def test_contact_has_halved_radii(row: FindRow) -> None:
    assert number(row("contact: length 2a")) == pytest.approx(0.2726e-3, abs=5e-8)
    assert number(row("contact: width 2b")) == pytest.approx(3.0898e-3, abs=5e-8)
    assert number(row("contact: length 2a, printed radii")) == pytest.approx(0.3435e-3, abs=5e-8)
    assert number(row("contact: width 2b, printed radii")) == pytest.approx(3.8929e-3, abs=5e-8)
    speed = 2.0 * math.pi * 1000.0 / 60.0 * 25e-3
    assert number(row("contact: rolling speed V")) == pytest.approx(speed, rel=1e-12)
    assert number(row("contact: rolling speed V, printed radii")) == pytest.approx(2 * speed)
    rise = row("contact: rise of p0 under the parabolic bound")
    assert (rise.paper, number(rise)) == (0.25, pytest.approx(1.0 / 3.0, rel=1e-9))


def test_multipliers_follow_from_the_moments(row: FindRow) -> None:
    # truncated at nine standard deviations: multipliers of the normal distribution
    mean, std = paper.LOAD_MEAN.value, paper.LOAD_STD.value
    assert number(row("inputs: lambda1 of load N")) == pytest.approx(-mean / std**2, rel=1e-9)
    assert number(row("inputs: lambda2 of load N")) == pytest.approx(0.5 / std**2, rel=1e-9)
    l0 = 0.5 * (mean / std) ** 2 + math.log(std * math.sqrt(2.0 * math.pi))
    assert number(row("inputs: lambda0 of load N")) == pytest.approx(l0, rel=1e-9)
    assert number(row("inputs: lambda0 of creepage xi")) == pytest.approx(-3.98140, abs=5e-6)
    assert number(row("inputs: lambda1 of creepage xi")) == pytest.approx(-5861.46, abs=5e-3)
    assert number(row("inputs: lambda2 of creepage xi")) == pytest.approx(2.957525e6, rel=2e-7)


def test_printed_multipliers_do_not_give_unit_area(results: Reproduction) -> None:
    printed, load = paper.LOAD_MULTIPLIERS, maxent_of(results.scenario, "load.normal_force")

    def density(n: float) -> float:
        return math.exp(-(printed.l0 + printed.l1 * n + printed.l2 * n * n))

    whole = integrate.quad(density, 0.0, 1000.0, points=[306.0], epsabs=1e-12)[0]
    assert printed_area(printed, load) == pytest.approx(whole, rel=1e-5)
    assert whole < 0.9
    l0, l1, l2 = load.multipliers
    assert printed_area(paper.PrintedMultipliers(l0, l1, l2, ""), load) == pytest.approx(1.0)


def test_misalignment_has_the_std_of_a_disc(row: FindRow) -> None:
    for name, exact in (("std of lateral creepage", 1e-3), ("std of spin", 0.05)):
        item = row(f"inputs: {name}")
        assert isinstance(item.standard_error, float)
        assert 0.0 < item.standard_error < 0.1 * exact
        assert abs(number(item) - exact) < 4.0 * item.standard_error


def test_powers_of_the_mean_problem(row: FindRow) -> None:
    exact = 0.073873  # closed form
    assert number(row("mean problem: P_d, FASTSIM, converged")) == pytest.approx(exact, rel=1e-4)
    summed = number(row("mean problem: P_d, FASTSIM, element sum 50 x 50"))
    assert -0.04 < summed / exact - 1.0 < -0.02
    slender = row("mean problem: P_d, slender")
    assert number(slender) == pytest.approx(EXACT_POWER, rel=2e-3)
    assert f"{EXACT_POWER} W" in slender.why
    printed = number(row("mean problem: P_d, FASTSIM, printed radii"))
    most = 0.1 * 300.0 * 5.235988 * 1e-3
    assert 0.99 * most < printed < most


@pytest.mark.parametrize(
    ("aligned", "exact", "std"), [(True, 0.0739, 0.040), (False, 0.1058, 0.047)]
)
def test_uniform_friction_has_the_known_mean(
    results: Reproduction, aligned: bool, exact: float, std: float
) -> None:
    power = results.spread[Variant(aligned, white=False, element_sum=False)].summaries["power"]
    assert abs(power.mean - exact) < 4.0 * power.mean_error
    assert power.mean_error == pytest.approx(std / COUNT**0.5, rel=0.2)


def test_all_variants_have_the_same_draws(results: Reproduction) -> None:
    whole = results.all_inputs.inputs
    for variant in VARIANTS:
        drawn = results.spread[variant].inputs
        for key in ("load.normal_force", "creepage.longitudinal"):
            assert np.array_equal(drawn[key], whole[key])
        assert ("friction.coefficient" in drawn) is not variant.white
        assert ("creepage.yaw" in drawn) is not variant.aligned


def test_variants_differ_as_expected(results: Reproduction) -> None:
    def power(aligned: bool, white: bool, element_sum: bool) -> np.ndarray:
        return results.spread[Variant(aligned, white, element_sum)].power

    for aligned in (True, False):
        for white in (True, False):
            assert np.all(power(aligned, white, True) < power(aligned, white, False))
        smooth, rough = power(aligned, False, False), power(aligned, True, False)
        assert rough.mean() < 0.95 * smooth.mean()
        assert rough.std() < smooth.std()  # averaging over the cells
    assert results.white_friction.solution.power < 0.95 * results.mean.solution.power


def test_rows_are_computed_from_the_realisations(results: Reproduction, row: FindRow) -> None:
    power = results.all_inputs.power
    mean = row("mean of P_d, all inputs random: uniform friction")
    assert number(mean) == pytest.approx(power.mean())
    assert mean.standard_error == pytest.approx(power.std(ddof=1) / COUNT**0.5)
    band = row("range of P_d, all inputs random: 2.5 to 97.5 %, uniform friction")
    assert band.here == pytest.approx(tuple(np.quantile(power, [0.025, 0.975])))
    first = power[:300]
    settled = row("convergence: standard error of the mean at 300")
    assert number(settled) == pytest.approx(first.std(ddof=1) / 300**0.5)
    needed = row("convergence: realisations for the mean to 1 %")
    assert (needed.paper, needed.here) == (
        300,
        pytest.approx((power.std(ddof=1) / power.mean() / 0.01) ** 2),
    )


def test_no_realisation_exceeds_the_bound(results: Reproduction) -> None:
    part = results.all_inputs.power / results.max_power
    assert part.max() <= 1.0 + GRID
    assert part.mean() > 0.85  # the bound is close
    aligned = results.aligned
    drawn = aligned.inputs
    friction, slip = drawn["friction.coefficient"], drawn["creepage.longitudinal"]
    speed = results.scenario.rolling_speed
    most = friction * aligned.values("normal_force") * speed * slip
    assert (aligned.power / most).max() == pytest.approx(1.0, abs=GRID)  # full slip


def test_bound_is_the_integral_over_the_contact(results: Reproduction) -> None:
    limit = max_power(results.scenario, results.all_inputs)
    drawn, load = results.all_inputs.inputs, results.all_inputs.values("normal_force")
    t, r = np.meshgrid((np.arange(400) + 0.5) * np.pi / 200, (np.arange(400) + 0.5) / 400)
    weight = np.sqrt(1.0 - r**2) * r / (np.sqrt(1.0 - r**2) * r).sum()  # Hertz's pressure
    for number in range(5):
        a, b = (half * np.cbrt(load[number] / 300.0) for half in (0.1363e-3, 1.5449e-3))
        phi = drawn["creepage.tilt"][number] / 0.02
        x = drawn["creepage.longitudinal"][number] - phi * b * r * np.sin(t)
        y = drawn["creepage.yaw"][number] + phi * a * r * np.cos(t)
        force = drawn["friction.coefficient"][number] * load[number]
        exact = force * results.scenario.rolling_speed * float((weight * np.hypot(x, y)).sum())
        assert exact <= limit[number] * (1.0 + 1e-6)
        assert limit[number] == pytest.approx(exact, rel=5e-3)


def test_bound_is_compared_with_printed_values(results: Reproduction, row: FindRow) -> None:
    part = "upper bound of the power, mu N V |creepage|"
    mean = row(f"{part}: mean")
    assert isinstance(mean.standard_error, float)
    assert abs(number(mean) - 0.1124) < 4.0 * mean.standard_error
    beyond = (0.127 - number(mean)) / mean.standard_error
    assert f"{beyond:.0f} standard errors above" in mean.why
    reach = row(f"{part}: realisations that could reach 0.29 W")
    assert number(reach) == np.mean(results.max_power >= 0.29)
    assert number(reach) < 0.01 < paper.ABOVE_RANGE.value
    assert isinstance(reach.standard_error, float)
    assert reach.standard_error > 0.0  # also for zero counts


def test_realisations_and_seed_change_sampled_rows(results: Reproduction) -> None:
    before, less, other = (
        {(row.part, row.name): row for row in compare(study)}
        for study in (results, reproduce(COUNT - 60), reproduce(COUNT, seed=7))
    )
    assert len(before) > 30
    from_draws = [key for key, row in before.items() if row.standard_error is not None]
    from_draws += [key for key, row in before.items() if row.part == "convergence"]
    assert len(from_draws) >= 17
    for name, row in before.items():
        reaching = "could reach" in name[1]  # a count, which can be zero in all studies
        if name in from_draws and not reaching:
            assert row.here != other[name].here
            settled = "at 300" in name[1]
            assert (row.here == pytest.approx(less[name].here, rel=1e-9)) is settled
        elif not name[0].startswith("upper bound"):
            assert row.here == less[name].here == other[name].here


def test_rows_have_section_and_reason(results: Reproduction, row: FindRow) -> None:
    for item in compare(results):
        assert re.match(r"(section \d|eq\. \d)", item.place)
        assert item.why
        assert "nan" not in item.why
    assert "swapped" in row("range of P_d, all inputs random: 2.5 to 97.5 %, uniform friction").why
    assert "diameters" in row("contact: length 2a").why


def test_at_least_two_realisations_are_required() -> None:
    rows = compare(reproduce(2))
    (bound,) = [row for row in rows if row.part.startswith("upper bound") and row.name == "mean"]
    assert bound.why == "too few realisations to distinguish it from the printed mean"
    with pytest.raises(ValueError, match="must be 2 or more for a standard deviation, got 1"):
        reproduce(1)


def test_progress_counts_all_variants() -> None:
    progress: list[tuple[int, int]] = []
    reproduce(2, on_progress=lambda done, total: progress.append((done, total)))
    assert progress[-1] == (2 * len(VARIANTS), 2 * len(VARIANTS))
    assert [done for done, _ in progress] == sorted(done for done, _ in progress)


def test_white_friction_keeps_the_marginal(results: Reproduction) -> None:
    white = results.spread[Variant(aligned=False, white=True, element_sum=False)]
    (item,) = [item for item in white.scenario.random if item.role == "field"]
    (friction,) = [item for item in results.scenario.random if item.name == "friction.coefficient"]
    assert item.mean == friction.mean
    assert white_friction(results.scenario)["marginal"] == {
        "distribution": "maxent",
        **friction.options,
    }
    assert isinstance(white, DissipationResult)


def test_scenarios_are_found_in_both_folders(tmp_path: Path) -> None:
    original = ROOT / "scenarios" / "mean-contact.toml"
    assert shipped.shipped_scenario("mean-contact").sha256 == load_scenario(original).sha256
    installed = tmp_path / "wearsim"
    for name in ("scenario", "scenarios"):
        (installed / name).mkdir(parents=True)
    module = shutil.copy(str(shipped.__file__), installed / "scenario")
    text = original.read_text().replace("300 N", "301 N")
    (installed / "scenarios" / "mean-contact.toml").write_text(text)
    assert runpy.run_path(str(module))["shipped_scenario"]("mean-contact").text == text


def test_wheel_contains_the_scenarios(tmp_path: Path) -> None:
    wheel = pytest.importorskip("hatchling.builders.wheel")
    builder = wheel.WheelBuilder(str(ROOT))
    files = {item.distribution_path for item in builder.recurse_included_files()}
    for path in (ROOT / "scenarios").glob("*.toml"):
        assert f"wearsim/scenarios/{path.name}" in {file.replace("\\", "/") for file in files}
