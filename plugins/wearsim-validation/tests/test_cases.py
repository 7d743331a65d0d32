"""Cases that are shipped, and what is computed for them."""

import hashlib
from pathlib import Path

import numpy as np
import pytest

import wearsim
from wearsim_validation.case import VERDICTS, Jump
from wearsim_validation.comparison import Comparison, _judge_depths, compare, exponent
from wearsim_validation.compute import RUN, computed, jumped, rigid_depth, scenario_of
from wearsim_validation.files import SHIPPED, read_case, shipped

SECONDS = ("rolling-spheres", "suros", "chevalier-widths")


def quiet(_what: str) -> None:
    """Show no progress."""


@pytest.mark.parametrize("name", shipped())
def test_shipped_case_names_source_and_reading(name):
    case = read_case(SHIPPED / f"{name}.toml")
    assert len(case.file.source) > 20
    assert len(case.file.read) > 10
    assert case.file.reasons
    for series in case.file.series:
        assert scenario_of(case, series).file.endswith(f"{name}.toml")


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in SECONDS else pytest.mark.slow) for name in shipped()],
)
def test_verdict_of_shipped_case_is_the_recorded_one(name):
    outcome = compare(read_case(SHIPPED / f"{name}.toml"), quiet)
    assert outcome.verdict == outcome.case.file.verdict
    assert outcome.expected
    assert all(one.facts for one in outcome.comparisons)


def test_exponent_of_power_law_is_exact():
    x = np.array([1.0, 3.0, 10.0])
    found, error = exponent(x, 5.0 * x**0.67, 0.1)
    assert found == pytest.approx(0.67, rel=1e-12)
    drawn = np.random.default_rng(2).normal(5.0 * x**0.67, 0.1, (4000, 3))
    assert np.std([exponent(x, row)[0] for row in drawn]) == pytest.approx(error, rel=0.1)


def test_rigid_depth_is_the_limit_of_full_slip():
    case = read_case(SHIPPED / "twin-discs.toml")
    series, full = case.file.series[0], case.file.variant[1]
    assert full.name == "full slip"
    elastic = computed(case, series, full)
    rigid = rigid_depth(scenario_of(case, series), case.columns["passes"].values)
    loss = 1.0 - elastic / rigid
    assert (np.diff(loss) < 0.0).all()
    assert 0.0 < loss[-1] < 0.02


def test_short_jumps_approach_the_run():
    case = read_case(SHIPPED / "twin-discs.toml")
    scenario = scenario_of(
        case,
        case.file.series[0],
        {"operation.passes": 400, "contact.width": "2 mm", "contact.strips": 41},
    )
    depth = RUN["both depths"](wearsim.run(scenario))[-1]
    errors = [jumped(scenario, Jump(passes=n))[1][-1] / depth - 1.0 for n in (100, 50, 25)]
    assert errors == sorted(errors, reverse=True)
    assert errors[2] == pytest.approx(0.25 * errors[0], rel=0.3)


def test_smoothing_of_a_jump_preserves_the_volume():
    case = read_case(SHIPPED / "twin-discs.toml")
    changes = {"operation.passes": 100, "contact.width": "3 mm", "contact.strips": 61}
    scenario = scenario_of(case, case.file.series[0], changes)
    sharp, smooth = (jumped(scenario, Jump(passes=100, smoothing=s))[1][-1] for s in (0.0, 2e-4))
    assert 0.6 * sharp < smooth < 0.95 * sharp


def test_fit_finds_the_factor_of_synthetic_values(tmp_path):
    text = (SHIPPED / "suros.toml").read_text()
    case = read_case(SHIPPED / "suros.toml")
    power = computed(case, case.file.series[0], None, {"friction.creep_factor": 0.6})
    rows = zip(case.columns["slip"].values, power, strict=True)
    data = "slip [%],heat generated [W]\n" + "".join(f"{x},{float(w)!r}\n" for x, w in rows)
    outcome = compare(written(tmp_path, text, case.file.sha256, data), quiet)
    alone = outcome.comparisons[0].fits["friction.creep_factor"]
    assert alone[:3] == pytest.approx([0.6] * 3, abs=0.01)
    assert alone[3:] == [None] * 5
    assert "friction.creep_factor 0.60" in outcome.comparisons[0].columns


def written(folder: Path, text: str, checksum: str, data: str, name: str = "suros"):
    """Return a shipped case with other published values."""
    (folder / f"{name}.csv").write_text(data)
    found = hashlib.sha256(data.encode()).hexdigest()
    (folder / f"{name}.toml").write_text(text.replace(checksum, found))
    return read_case(folder / f"{name}.toml")


def test_width_of_suros_contact_follows_from_flash_temperatures():
    """The flash temperature of each of two equal discs, as for a line contact that moves fast.

    T = 1.064 (q/k) sqrt(a chi/U)/2 with q = Q/(2 a b), and chi = U a/(2 Pe); k = chi rho c.
    """
    columns = read_case(SHIPPED / "suros.toml").columns
    speed, half_length, peclet = 400.0 / 60.0 * np.pi * 0.047, 0.315e-3, 10.3
    diffusivity = speed * half_length / (2.0 * peclet)
    conductivity = diffusivity * 8000.0 * 500.0
    heat, rise = columns["heat generated"].values, columns["flash temperature in K"].values
    root = np.sqrt(half_length * diffusivity / speed)
    width = 1.064 * heat * root / (2.0 * half_length * conductivity * 2.0 * rise)
    assert np.median(width) == pytest.approx(0.010, rel=0.03)
    assert diffusivity == pytest.approx(1.5e-5, rel=0.02)  # of steel
    modulus = 210e9 / (2.0 * (1.0 - 0.3**2))
    assert 2.0 * 1.5e9 * 0.5 * 0.0235 / modulus == pytest.approx(half_length, rel=0.04)


@pytest.mark.parametrize(
    ("depths", "verdict"), [([45.0, 50.0, 55.0], "scatter"), ([10.0, 50.0, 200.0], "not")]
)
def test_scatter_of_tests_is_judged_by_their_probability(depths, verdict):
    case = read_case(SHIPPED / "chevalier.toml")
    sample = np.exp(np.random.default_rng(3).normal(0.0, 0.3, 256))
    one = Comparison(case.file.series[0], "um", "1", np.arange(3.0), np.array(depths))
    _judge_depths(one, sample)
    assert one.verdict == verdict
    assert np.exp(np.log(one.columns["median"][0])) == pytest.approx(
        np.exp(np.mean(np.log(depths))), rel=0.05
    )


def test_every_verdict_has_words():
    assert len(set(VERDICTS.values())) == 5
