"""Motion laws: characteristic values, boundary conditions and tables."""

from __future__ import annotations

import math

import numpy as np
import pytest

from wearsim.errors import ScenarioError
from wearsim.models.motion import LiftSpline, kinks, read_lift
from wearsim.plugins import MotionLawSpec, registry
from wearsim.testing.checks import ConfiguredSpec

#: greatest velocity and acceleration on the unit interval
PEAKS = {
    "cycloidal": (2.0, 2.0 * math.pi),
    "polynomial-345": (1.875, 10.0 / math.sqrt(3.0)),
    "polynomial-4567": (2.1875, 7.513188),
    "modified-sine": (1.759603, 5.527957),
    "harmonic": (math.pi / 2.0, math.pi**2 / 2.0),
    "modified-trapezoid": (2.0, 8.0 * math.pi / (2.0 + math.pi)),
}


def law(name, angle=1.0, rise=1.0, unit="m", files=None, **options):
    chosen = ConfiguredSpec(registry().get(MotionLawSpec, name), options, files=files or {})
    return chosen.spec.factory(chosen.options, angle, rise, unit)


@pytest.mark.parametrize("name", PEAKS)
def test_greatest_velocity_and_acceleration(name):
    found = law(name).lift(np.linspace(0.0, 1.0, 24001))
    assert np.abs(found[1:]).max(axis=1) == pytest.approx(PEAKS[name], rel=5e-7)


def test_jerk_of_the_modified_sine():
    second = law("modified-sine").lift(np.linspace(0.0, 1e-6, 2))[2]
    assert second[1] / 1e-6 == pytest.approx(69.46636, rel=1e-6)


def test_polynomial_meets_its_boundary_conditions():
    start, end = ["3 mm/rad", "-2 mm/rad^2", "5 mm/rad^3"], ["-1 mm/rad", "4 mm/rad^2"]
    found = law("polynomial", 0.7, 8e-3, start=start, end=end)
    ends = found.lift(np.array([0.0, 0.7]))
    assert ends[:, 0] == pytest.approx([0.0, 3e-3, -2e-3], abs=1e-15)
    assert ends[:, 1] == pytest.approx([8e-3, -1e-3, 4e-3], rel=1e-10)
    third = np.diff(found.lift(np.array([0.0, 1e-6]))[2])[0] / 1e-6
    assert third == pytest.approx(5e-3, rel=1e-2)


def test_derivatives_of_an_arm_are_in_its_units():
    found = law("polynomial", 0.5, 0.1, "rad", start=["0.2 rad/rad", "1 deg/deg^2"])
    expected = [0.0, 0.2, 180.0 / math.pi]
    assert found.lift(np.zeros(1))[:, 0] == pytest.approx(expected, abs=1e-12)
    with pytest.raises(ValueError, match="wrong dimension"):
        law("polynomial", 0.5, 0.1, "rad", start=["3 mm/rad"])


def test_constant_velocity_between_its_blends():
    found = law("constant-velocity", 2.0, 1.0, blend="0.5 rad")
    inside = found.lift(np.linspace(0.5, 1.5, 11))
    assert inside[1] == pytest.approx(1.0 / 1.5, rel=1e-12)
    assert found.breaks == (0.5, 1.5)
    with pytest.raises(ValueError, match="longer than the segment"):
        law("constant-velocity", 0.5, 1.0, blend="0.5 rad")


def table(lift, degrees):
    rows = [f"{angle},{float(value)!r}" for angle, value in zip(degrees, lift, strict=True)]
    return "\n".join(["angle [deg],lift [mm]", *rows])


def test_table_follows_the_law_that_it_samples():
    degrees = np.linspace(0.0, 90.0, 61)
    exact = law("polynomial-4567", math.pi / 2.0, 8e-3)
    text = table(1e3 * exact.lift(np.radians(degrees))[0], degrees)
    spline = law("table", math.pi / 2.0, 0.0, files={"t.csv": text}, file="t.csv")
    theta = np.linspace(0.0, math.pi / 2.0, 500)
    difference = np.abs(spline.lift(theta) - exact.lift(theta)).max(axis=1)
    assert (difference < [1e-9, 1e-7, 1e-5]).all()


def test_closed_spline_of_a_turn():
    theta = np.linspace(0.0, math.tau, 73)
    spline = LiftSpline(theta, np.cos(theta), closed=True)
    found = spline(np.array([0.0, 1.0, math.tau]))
    assert found[0] == pytest.approx(np.cos([0.0, 1.0, 0.0]), abs=1e-9)
    assert found[2] == pytest.approx(-np.cos([0.0, 1.0, 0.0]), abs=1e-5)


def test_corner_of_a_table_is_an_error_with_its_angle():
    degrees = np.linspace(0.0, 90.0, 61)
    text = table(np.abs(degrees - 45.0) / 10.0, degrees)
    with pytest.raises(ScenarioError, match=r"slope of the lift jumps, got a corner at 45 deg"):
        law("table", math.pi / 2.0, 0.0, files={"t.csv": text}, file="t.csv")


def test_table_must_span_its_segment():
    text = table(np.zeros(10), np.linspace(0.0, 80.0, 10))
    with pytest.raises(ScenarioError, match="0 to 90 deg, the segment's angle"):
        law("table", math.pi / 2.0, 0.0, files={"t.csv": text}, file="t.csv")
    with pytest.raises(ScenarioError, match="too few rows for a quintic spline"):
        read_lift(table(np.zeros(5), np.arange(5.0)), "t.csv", "m")


def test_jumps_of_the_acceleration_are_found_and_smooth_laws_have_none():
    theta = np.linspace(0.0, 1.0, 101)
    parabolas = np.where(theta < 0.5, 2.0 * theta**2, 1.0 - 2.0 * (1.0 - theta) ** 2)
    assert not len(kinks(theta, parabolas)[0])
    assert kinks(theta, parabolas)[1] == pytest.approx([0.5], abs=0.011)
    for name in PEAKS:
        lift = law(name).lift(theta)[0]
        around = np.concatenate([np.zeros(20), lift, np.ones(20)])
        angle = np.linspace(0.0, 1.4, 141)
        corners, steps = kinks(angle, around)
        assert not len(corners), name
        assert len(steps) == (2 if name == "harmonic" else 0), name
