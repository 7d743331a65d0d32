"""Edges of contacts resolved within a strip: pressure in a growing groove."""

from pathlib import Path

import numpy as np
import pytest

import wearsim
from tests.evolution.test_strip_errors import RIG
from wearsim.errors import Interrupted
from wearsim.types import BoolArray, FloatArray

PLAIN = {"evolution.strip_error": False}
SHORT = {**PLAIN, "operation.duration": "20 min"}
GRIDS: dict[str, dict[str, object]] = {
    "automatic": {},
    "wide": {"contact.strips": 77, "contact.width": "20 mm"},
    "other": {"contact.strips": 151, "contact.width": "20 mm"},
    "small steps": {"evolution.tolerance": 1e-4},
}
CASES = {
    "one": {},
    "both wear": {"wear.roller.k_over_h": "1e-11 1/Pa"},
    "three": {"roller.offset": ["-1 mm", "0.3 mm", "1 mm"]},
}


def run(changes: dict[str, object], **options: object) -> wearsim.Result:
    return wearsim.run(wearsim.load_scenario(RIG, overrides=changes), **options)


def rigid(result: wearsim.Result, late: BoolArray) -> FloatArray:
    """Return the peak pressure of rigid bodies at the same depths [Pa]."""
    half_width = np.sqrt(2.0 * 0.5 * result.depth[late])
    curvature, modulus = 1.0 / 0.02 + 1.0 / 0.025, 200e9 / (2.0 * (1.0 - 0.3**2))
    return np.asarray(np.sqrt(300.0 / (2.0 * half_width) * modulus * curvature / np.pi))


@pytest.fixture(scope="module")
def groove() -> wearsim.Result:
    return run({})


@pytest.fixture(scope="module")
def fine() -> wearsim.Result:
    """Test on strips of a third of the width, the centre of every third one that of a strip."""
    spacing = 0.12768  # of the automatic strips [mm], to some digits
    width = f"{151 * spacing!r} mm"
    small = {"evolution.tolerance": 1e-4}
    return run({**PLAIN, **small, "contact.strips": 453, "contact.width": width})


@pytest.mark.parametrize("grid", list(GRIDS))
def test_peak_pressure_is_that_of_rigid_bodies_and_falls(grid: str) -> None:
    result = run({**PLAIN, **GRIDS[grid]})
    late = result.time > 100.0 * 60.0
    pressure = result.peak_pressure[late]
    assert pressure == pytest.approx(rigid(result, late), rel=5e-3)
    assert (np.diff(pressure) < 2e-3 * pressure[1:]).all()


def test_stated_error_of_the_peak_pressure_holds_and_is_small(groove: wearsim.Result) -> None:
    late = groove.time > 0.5 * groove.time[-1]
    stated, pressure = groove.errors["peak_pressure"][late], groove.peak_pressure[late]
    assert (np.abs(pressure - rigid(groove, late)) < stated).all()
    assert (stated < 0.03 * pressure).all()


def test_line_load_at_the_edge_converges(groove: wearsim.Result, fine: wearsim.Result) -> None:
    spacing, narrow = (one.y[1] - one.y[0] for one in (groove, fine))
    ends = np.append(fine.y - 0.5 * narrow, fine.y[-1] + 0.5 * narrow)
    sums = np.append(0.0, np.cumsum(fine.line_load[-1])) * narrow
    sides = np.append(groove.y - 0.5 * spacing, groove.y[-1] + 0.5 * spacing)
    true = np.diff(np.interp(sides, ends, sums)) / spacing
    edge = np.sqrt(2.0 * 0.5 * groove.depth[-1])
    outer = (np.abs(groove.y) > edge - 0.5e-3 - 0.5 * spacing) & (true > 0.0)
    difference = np.abs(groove.line_load[-1] - true)
    assert difference[outer].sum() < 0.02 * true[outer].sum()
    last = outer & (np.abs(groove.y) > edge - 0.5 * spacing)
    assert (difference < 0.01 * true)[outer & ~last].all()


def test_line_load_falls_towards_the_edge(groove: wearsim.Result) -> None:
    load = groove.line_load[-1]
    right = load[np.argmax(groove.y >= 0.0) :]
    assert (np.diff(right) <= 2e-3 * right.max()).all()


def test_depth_volume_and_energy_converge(groove: wearsim.Result, fine: wearsim.Result) -> None:
    assert groove.depth[-1] == pytest.approx(fine.depth[-1], rel=1e-4)
    assert groove.worn_volume[-1] == pytest.approx(fine.worn_volume[-1], rel=1e-5, abs=0.0)
    energy = groove.dissipated_energy[-1] * 1.1e-11
    assert groove.worn_volume[-1] == pytest.approx(energy, rel=1e-11, abs=0.0)


@pytest.mark.parametrize("case", list(CASES))
def test_error_by_steps_is_covered(case: str) -> None:
    result = run({**SHORT, **CASES[case]})
    fine = {"contact.strips": len(result.y), "evolution.tolerance": 1e-5}
    width = f"{float(len(result.y) * (result.y[1] - result.y[0]))!r} m"
    true = run({**SHORT, **CASES[case], **fine, "contact.width": width})
    assert result.depth_error[-1] < 5e-3 * result.depth[-1]
    assert abs(result.depth[-1] - true.depth[-1]) <= result.depth_error[-1]
    assert abs(result.worn_volume[-1] - true.worn_volume[-1]) <= result.volume_error[-1]


@pytest.mark.slow
def test_error_by_steps_is_within_the_tolerance_where_half_of_a_groove_adheres() -> None:
    changes = {
        **PLAIN,
        "operation.rollers": 1,
        "operation.duration": "11000 min",
        "roller.radius": "10 mm",
        "roller.crown_radius": "195 mm",
        "cylinder.radius": "8 mm",
        "load.normal_force": "14 N",
        "friction.coefficient": 0.076,
        "creepage": {"longitudinal": 5e-5, "tilt": "0.6 mrad"},
        "wear.cylinder.k_over_h": "3e-10 1/Pa",
        "wear.roller.k_over_h": "4e-10 1/Pa",
    }
    result, true = (run({**changes, "evolution.tolerance": one}) for one in (1e-3, 1e-4))
    assert 0.3 < result.values("adhesion_fraction")[-1].max() < 0.5
    assert result.worn_volume[-1] == pytest.approx(true.worn_volume[-1], rel=1e-3, abs=0.0)
    assert result.depth[-1] == pytest.approx(true.depth[-1], rel=1e-3)


def test_separate_rollers_wear_like_identical_ones() -> None:
    wear: dict[str, object] = {"wear.roller.k_over_h": "1e-11 1/Pa"}
    one = run({**SHORT, **wear})
    three = run({**SHORT, **wear, "roller.offset": ["0 mm", "1e-9 mm", "-1e-9 mm"]})
    assert three.depth[-1] == pytest.approx(one.depth[-1], rel=1e-3)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
@pytest.mark.parametrize("offsets", [["-1 mm", "0.3 mm", "1 mm"], ["0 mm", "0.9 mm", "0 mm"]])
def test_both_bodies_of_every_strip_wear_in_a_constant_ratio(
    offsets: list[str], tolerance: float
) -> None:
    result = run(
        {
            **PLAIN,
            "evolution.tolerance": tolerance,
            "wear.roller.k_over_h": "5e-12 1/Pa",
            "roller.offset": offsets,
        }
    )
    records = result.raw.records
    cylinder, rollers = (
        records[f"{body}_depth_profile"][-1].reshape(-1, len(result.y))
        for body in ("cylinder", "roller")
    )
    by_rollers = result.raw.static["multiplicity"] @ rollers
    ratio = cylinder.sum() / by_rollers.sum()
    # what the volume of a body lacks is spread over its strips
    wanted, allowed = ratio * by_rollers, 0.3 * tolerance * cylinder.max()
    np.testing.assert_allclose(cylinder[0], wanted, atol=allowed)


def test_strips_that_reach_the_ends_of_a_roller_wear_in_the_groove_only() -> None:
    wide = {**PLAIN, "friction.coefficient": 0.12}
    ended, endless = run({**wide, "roller.width": "20 mm"}), run(wide)
    assert ended.y[-1] > 10e-3  # strips have grown to the ends, which the groove does not reach
    assert ended.depth[-1] == pytest.approx(endless.depth[-1], rel=2e-4)
    assert ended.worn_volume[-1] == pytest.approx(endless.worn_volume[-1], rel=1e-5, abs=0.0)
    assert not ended.profiles[-1][np.abs(ended.y) > 8e-3].any()


def test_groove_on_strips_that_grow_keeps_its_volume() -> None:
    result = run({**PLAIN, "operation.duration": "4500 min"})
    energy = result.dissipated_energy[-1] * 1.1e-11
    assert result.worn_volume[-1] == pytest.approx(energy, rel=1e-9, abs=0.0)
    assert result.peak_pressure[-1] == pytest.approx(177.75e6, rel=1e-2)


def test_resumed_test_is_equal_to_the_bit(tmp_path) -> None:
    file = tmp_path / "part.h5"
    steps = iter(range(1000))
    with pytest.raises(Interrupted):
        run(SHORT, output=file, stop_requested=lambda: next(steps) > 12)
    resumed, whole = wearsim.resume(file), run(SHORT)
    assert np.array_equal(resumed.depth, whole.depth)
    assert np.array_equal(resumed.profiles[-1], whole.profiles[-1])
    assert np.array_equal(resumed.peak_pressure, whole.peak_pressure)


def test_peak_pressure_under_a_spring_is_that_of_rigid_bodies() -> None:
    result = run({"load.kind": "spring", "load.stiffness": "2000 N/mm", **PLAIN})
    late = result.time > 100.0 * 60.0
    force = result.normal_force[late].ravel()
    assert force[-1] < 0.8 * 300.0
    expected = rigid(result, late) * np.sqrt(force / 300.0)
    assert result.peak_pressure[late].ravel() == pytest.approx(expected, rel=1e-2)


@pytest.mark.parametrize("stepper", ["stabilised", "explicit"])
def test_pressure_of_whole_strips_is_close_and_its_stated_error_holds(stepper: str) -> None:
    result = run({"evolution.stepper": stepper, "operation.duration": "250 min"})
    late = result.time > 100.0 * 60.0
    pressure = result.peak_pressure[late].ravel()
    assert pressure == pytest.approx(rigid(result, late), rel=0.03)
    covered = np.abs(pressure - rigid(result, late)) < result.errors["peak_pressure"][late].ravel()
    assert covered.mean() >= 0.92


@pytest.mark.slow
def test_pressure_of_stabilised_steps_is_close_after_strips_are_joined() -> None:
    """While the edge crosses one strip, twenty times the elastic approach is worn."""
    result = run({"evolution.stepper": "stabilised", "operation.duration": "4500 min"})
    late = result.time > 1000.0 * 60.0
    pressure = result.peak_pressure[late].ravel()
    assert late.sum() > 100
    assert pressure == pytest.approx(rigid(result, late), rel=0.03)


@pytest.mark.slow
def test_pressure_of_stabilised_steps_of_different_rollers_is_that_of_small_steps() -> None:
    changes = {**CASES["three"], **PLAIN, "operation.duration": "1500 min"}
    stabilised, explicit = (
        run({**changes, "evolution.stepper": name}) for name in ("stabilised", "explicit")
    )
    late = stabilised.time > 300.0 * 60.0
    true, pressure = (one.peak_pressure.max(axis=1) for one in (explicit, stabilised))
    true = np.interp(stabilised.passes[late], explicit.passes, true.ravel())
    assert pressure[late].ravel() == pytest.approx(true, rel=0.03)


@pytest.mark.parametrize("load", ["ramp", "wave"])
def test_peak_pressure_under_a_load_that_varies_is_that_of_rigid_bodies(
    load: str, tmp_path: Path
) -> None:
    times = np.arange(0.0, 27_001.0, 60.0)
    wave = 300.0 + 30.0 * np.sin(times / 600.0)
    loads = 300.0 - 100.0 * times / 27_000.0 if load == "ramp" else wave
    rows = (f"{time:g}, {force:.6g}\n" for time, force in zip(times, loads, strict=True))
    (tmp_path / "log.csv").write_text("time [s], load [N]\n" + "".join(rows))
    recorded = {"kind": "recorded", "file": str(tmp_path / "log.csv")}
    result = run({"load": recorded})
    late = result.time > 100.0 * 60.0
    pressure, force = (
        column[late].ravel() for column in (result.peak_pressure, result.normal_force)
    )
    expected = rigid(result, late) * np.sqrt(force / 300.0)
    assert pressure == pytest.approx(expected, rel=0.03)
    stated = result.errors["peak_pressure"][late].ravel()
    assert (np.abs(pressure - expected) < stated).mean() >= 0.92


def test_no_roller_wears_strips_beyond_its_edges() -> None:
    changes = {
        "operation.duration": "4500 min",
        "roller.offset": ["-0.4 mm", "0.1 mm", "0.5 mm"],
        "creepage.yaw": ["0 mrad", "1 mrad", "-2 mrad"],
    }
    result = run({**changes, "evolution.strip_error": True})
    fine = run({**PLAIN, **changes, "contact.strips": 401, "evolution.tolerance": 1e-4})
    stated, pressure = result.errors["peak_pressure"][-1], result.peak_pressure[-1]
    assert (np.abs(pressure - fine.peak_pressure[-1]) < stated).all()
    assert (stated < 0.06 * pressure).all()


@pytest.mark.slow
def test_abrupt_edge_of_a_tightly_crowned_groove_is_part_of_the_stated_error() -> None:
    crowned = {"roller.crown_radius": "30 mm", "load.normal_force": "50 N"}
    short = {"operation.duration": "98 min"}
    result = run({**crowned, **short})
    fine = {"contact.strips": 193, "contact.width": "1.92 mm"}
    last = slice(-6, None)  # the peak varies from step to step
    true = run({**PLAIN, **crowned, **short, **fine}).peak_pressure[last].max()
    difference = true - result.peak_pressure[last].max()
    assert difference > 0.03 * true
    assert difference < result.errors["peak_pressure"][-1].max() < 0.3 * true
