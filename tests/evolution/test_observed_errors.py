"""Estimated errors of power, pressure, width and other observables, against finer tests."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

import wearsim
from wearsim.evolution.observed_errors import (
    COVER,
    COVER_OF_FREE,
    OF_PEAKS,
    OF_SEVERAL_PEAKS,
    observed_errors,
)
from wearsim.evolution.strip_errors import Course
from wearsim.types import FloatArray

RIG = Path(__file__).parents[2] / "scenarios" / "rig-450min.toml"
SPRING: dict[str, object] = {
    "operation.duration": "60 min",
    "operation.rollers": 1,
    "contact.strips": 61,
    "load.kind": "spring",
    "load.stiffness": "2000 N/mm",
    "creepage.longitudinal": 2e-4,
    "wear.cylinder.k_over_h": "2e-10 1/Pa",
    "wear.roller.k_over_h": "1e-10 1/Pa",
}


def run(changes: dict[str, object]) -> wearsim.Result:
    return wearsim.run(wearsim.load_scenario(RIG, overrides=changes))


@pytest.fixture(scope="module")
def spring() -> wearsim.Result:
    return run(SPRING)


def test_stated_errors_cover_those_against_a_finer_test(spring: wearsim.Result) -> None:
    strips: dict[str, object] = {
        "contact.strips": 4 * len(spring.y),
        "contact.width": f"{float(len(spring.y) * (spring.y[1] - spring.y[0]))!r} m",
        "evolution.tolerance": 1e-5,
        "evolution.strip_error": False,
    }
    true = run({**SPRING, **strips})
    for name, errors in spring.errors.items():
        if name in {"depth", "worn_volume"}:
            continue
        error = abs(float(spring.values(name)[-1] - true.values(name)[-1]))
        size = abs(float(true.values(name)[-1]))
        assert error <= errors[-1] + 1e-6 * size, name
        assert errors[-1] < 0.5 * size, name
        assert np.isnan(true.errors[name]).all()  # without the coarse test they are not known


def test_first_steps_under_a_spring_have_no_error_of_its_estimated_slope() -> None:
    first: dict[str, object] = {"load.stiffness": "20 kN/mm", "evolution.strip_error": False}
    result = run({**SPRING, **first})
    assert (result.depth_error[1:8] < 0.05 * result.depth[1:8]).all()


def test_errors_are_in_final_state_and_summary(spring: wearsim.Result) -> None:
    final = spring.final
    assert final["peak_pressure_error_Pa"] == spring.errors["peak_pressure"][-1]
    assert final["normal_force_error_N"] == spring.errors["normal_force"][-1] > 0.0
    assert set(spring.errors) >= {"depth", "worn_volume", "width", "power", "descent"}


@pytest.mark.parametrize("gain", [0.0, 50.0], ids=["known load", "load term"])
def test_error_under_a_logged_load_is_not_that_of_interpolation(
    gain: float, tmp_path: Path
) -> None:
    time = np.linspace(0.0, 1800.0, 361)
    log = np.column_stack([time, 300.0 + 20.0 * np.sin(time / 100.0)])
    header = "time [s],force [N]"
    np.savetxt(tmp_path / "log.csv", log, delimiter=",", header=header, comments="")
    content = tomllib.loads(RIG.read_text())
    content["operation"]["duration"] = "30 min"
    content["load"] = {"kind": "recorded", "file": "log.csv"}
    if gain:
        content["load"]["thermal"] = {"gain": f"{gain} N/W", "time_constant": "20 min"}
    result, true = (
        wearsim.run(wearsim.Scenario.from_dict({**content, **changes}, folder=tmp_path))
        for changes in ({}, {"contact": {"strips": 241}, "evolution": {"tolerance": 1e-5}})
    )
    for name in ("normal_force", "power", "peak_pressure", "elastic_approach"):
        error = abs(float(result.values(name)[-1] - true.values(name)[-1]))
        size = abs(float(true.values(name)[-1]))
        assert error <= result.errors[name][-1] + 1e-6 * size, name
        most = 0.1 if name in {"peak_pressure", "elastic_approach"} else 0.003
        assert result.errors[name][-1] < most * size, name
    assert (result.errors["normal_force"][-1] == 0.0) == (gain == 0.0)


def of_exact_sizes(
    course: Course | None, passes: FloatArray, observed: dict[str, FloatArray], free: bool = False
) -> dict[str, FloatArray]:
    """Return the errors of observables of a test whose depths and volume have none."""
    sizes = np.ones((3, len(passes)))
    return observed_errors(course, passes, observed, sizes, 0.0 * sizes, free=free)


@pytest.mark.parametrize(("free", "cover"), [(False, COVER), (True, COVER_OF_FREE)])
@pytest.mark.parametrize(
    ("name", "rollers", "of_peaks"),
    [("power", 1, 1.0), ("peak_pressure", 1, OF_PEAKS), ("peak_pressure", 2, OF_SEVERAL_PEAKS)],
)
def test_error_is_the_greatest_of_the_last_differences(
    free: bool, cover: float, name: str, rollers: int, of_peaks: float
) -> None:
    passes = np.array([0.0, 10.0, 20.0, 40.0, 80.0])
    values = np.repeat([[3.0], [2.0], [2.0], [2.0], [2.0]], rollers, axis=1)
    other = values * np.array([[1.0], [1.1], [1.0], [1.0], [1.0]])
    course = Course(passes[1:].tolist(), observed={name: other})
    found = of_exact_sizes(course, passes, {name: values}, free)[name]
    np.testing.assert_allclose(found[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(found[1], cover * of_peaks * 0.2, atol=1e-12)
    np.testing.assert_allclose(found[3:], 0.0, atol=1e-12)  # it is no longer recent
    known = np.ones((3, len(passes)))
    of_cam = observed_errors(
        course, passes, {name: values}, known, 0.0 * known, free=free, cam=True
    )[name]
    np.testing.assert_allclose(of_cam[1], cover * 0.2, atol=1e-12)


def test_peaks_of_the_coarse_test_at_one_or_two_steps_are_no_error() -> None:
    passes = np.arange(13.0)
    pressure, coarse = 300.0 - 2.0 * passes, 303.0 - 2.02 * passes
    spoilt = coarse.copy()
    spoilt[[3, 4, 8, 12]] *= [1.5, 1.1, 1.3, 1.2]

    def errors(other: FloatArray) -> FloatArray:
        course = Course(passes[1:].tolist(), observed={"peak_pressure": other[:, None]})
        return of_exact_sizes(course, passes, {"peak_pressure": pressure[:, None]})["peak_pressure"]

    assert errors(spoilt)[:, 0] == pytest.approx(errors(coarse)[:, 0], rel=0.2)
    assert errors(1.01 * coarse)[-1] > 1.5 * errors(coarse)[-1]


def test_power_laws_are_compared_without_error_of_interpolation() -> None:
    passes = np.geomspace(1.0, 1e6, 40)
    steps = np.geomspace(2.0, 1e6, 13)
    course = Course(steps.tolist(), observed={"descent": np.append(0.0, steps) ** 0.6})
    observed = {"descent": np.append(0.0, passes) ** 0.6}
    found = of_exact_sizes(course, np.append(0.0, passes), observed)["descent"]
    assert (found[2:] <= 2e-2 * observed["descent"][2:]).all()
    assert found[-1] <= 1e-6 * observed["descent"][-1]


def test_roller_has_at_least_the_error_of_both_bodies() -> None:
    course = Course([1.0], observed={"descent": np.ones(2)})
    sizes, errors = np.full((3, 2), 2.0), np.full((3, 2), 0.1)
    ones = np.ones(2)
    found = observed_errors(course, np.array([0.0, 1.0]), {"descent": ones}, sizes, errors)
    np.testing.assert_allclose(found["descent"], 0.05)


@pytest.mark.parametrize("feedback", [False, True])
def test_pauses_are_not_compared_with_steps_beside_them(feedback: bool) -> None:
    passes, steps = np.arange(7.0), np.array([0.0, 2.0, 3.2, 4.0, 6.0])
    force, of_coarse = 3.0 * (passes != 3.0), 3.0 * (steps != 3.2)
    test, coarse = (
        {"normal_force": one, "power": 0.1 * one, "peak_pressure": np.sqrt(one)}
        for one in (force, of_coarse)
    )
    course, sizes = Course(steps[1:].tolist(), observed=coarse), np.ones((3, 7))
    about = (course, passes, test, sizes, 0.0 * sizes)

    def load(points: FloatArray) -> FloatArray:
        return np.where(np.isin(points, (3.0, 3.2)), 0.0, 4.0)

    found = observed_errors(*about, load=load, feedback=feedback)
    assert found["normal_force"] == pytest.approx(0.0, abs=1e-12)
    assert found["power"] == pytest.approx(0.0, abs=1e-12)
    assert found["peak_pressure"] == pytest.approx(0.0, abs=1e-12)


def test_angles_differ_by_less_than_half_a_turn() -> None:
    course = Course([1.0], observed={"depth_angle": np.full(2, 6.2)})
    found = of_exact_sizes(course, np.array([0.0, 1.0]), {"depth_angle": np.array([0.1, 0.1])})
    assert found["depth_angle"][-1] == pytest.approx(COVER * (0.1 + 2.0 * np.pi - 6.2))


def test_unknown_errors_are_not_a_number() -> None:
    found = of_exact_sizes(None, np.array([0.0, 1.0]), {"power": np.ones((2, 3))})
    assert np.isnan(found["power"]).all()
    assert found["power"].shape == (2, 3)
