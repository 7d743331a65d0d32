"""Skid of a free roller against closed forms of its slip."""

from __future__ import annotations

import math

import numpy as np
import pytest
from cams import segments_of
from scipy.optimize import brentq

from wearsim.mechanics.cam import Panel
from wearsim.mechanics.cam.skid import Rolling, SkidArc, skid_arcs

HALVES = [Panel(0, 0.0, math.pi, False), Panel(1, math.pi, math.tau, False)]
WHOLE = [Panel(0, 0.0, math.tau, False)]


def stepped(reach: float, drag: float = 0.0, sign: float = 1.0):
    """Return requirements of a roller that turns twice as fast in the second half of a turn."""

    def rolling(panels: list[Panel], theta: np.ndarray) -> Rolling:
        one, segments = np.ones_like(theta), segments_of(panels)
        return Rolling(sign * (1.0 + segments) * one, 0.0 * one, drag * one, reach * one)

    return rolling


def test_demand_is_the_torque_over_that_of_the_traction() -> None:
    found = Rolling(
        np.array([1.0, -1.0, 0.0, 1.0]),
        np.array([0.3, 0.3, 0.3, 0.0]),
        np.full(4, 0.1),
        np.array([2.0, 2.0, 2.0, 0.0]),
    ).demand()
    assert found[:3] == pytest.approx([0.2, 0.1, 0.15])
    assert found[3] == pytest.approx(1e299)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("reach", "drag"), [(0.9, 0.0), (2.0, 0.3)])
def test_slip_after_a_jump_falls_with_the_traction(reach: float, drag: float, sign: float) -> None:
    first, second = skid_arcs(HALVES, stepped(reach, drag, sign))
    # the drag makes the roller slower: it adds to the slip of a forward roller
    for arc, start, slip, rate in (
        (first, 0.0, -sign, sign * (reach + drag)),
        (second, math.pi, sign, sign * (drag - reach)),
    ):
        end = start - slip / rate
        assert (arc.theta[0], arc.theta[-1]) == pytest.approx((start, end), rel=1e-9)
        assert (arc.slip[0], arc.slip[-1]) == pytest.approx((slip, 0.0), abs=1e-12)
        inside = np.linspace(start, end, 7)
        assert arc.slip_at(inside) == pytest.approx(slip + rate * (inside - start), abs=1e-9)
        assert arc.slip_per_rad[1:-1] == pytest.approx(np.full(len(arc.theta) - 2, rate))
        assert arc.slip_at(np.array([end + 1.0]))[0] == pytest.approx(0.0, abs=1e-12)
    assert (first.panel, second.panel) == (0, 1)


def test_slip_goes_on_through_a_jump_and_turns() -> None:
    # too slow to roll before the next jump: of one half of a turn each, the jumps cancel
    arcs = skid_arcs(HALVES, stepped(0.2, 0.1))
    slips = {
        arc.panel: (arc.slip[0], arc.slip[-1]) for arc in arcs if arc.theta[0] in (0.0, math.pi)
    }
    # at half a turn the slip rises by 1 and falls at 0.1 per rad, at its start it falls by 1 and
    # rises at 0.3 per rad
    low = -1.0 + slips[1][1]
    assert slips[0][0] == pytest.approx(low, abs=1e-6)
    assert slips[0][1] == pytest.approx(min(low + 0.3 * math.pi, 0.0), abs=1e-6)
    assert slips[1][0] == pytest.approx(1.0 + slips[0][1], abs=1e-6)
    assert slips[1][1] == pytest.approx(max(slips[1][0] - 0.1 * math.pi, 0.0), abs=1e-6)


def accelerated(reach: float, drag: float = 0.0, size: float = 1.0):
    """Return requirements of a roller at the speed 3 + size sin(angle)."""

    def rolling(_: list[Panel], theta: np.ndarray) -> Rolling:
        one = np.ones_like(theta)
        return Rolling(3.0 + size * np.sin(theta), size * np.cos(theta), drag * one, reach * one)

    return rolling


@pytest.mark.parametrize(("reach", "drag"), [(0.8, 0.0), (0.9, 0.1), (0.95, 0.02)])
def test_roller_skids_where_acceleration_exceeds_the_traction(reach: float, drag: float) -> None:
    arcs = skid_arcs(WHOLE, accelerated(reach, drag))
    # forwards from cos = reach - drag on, before and after the end of a turn
    limit = reach - drag
    begin = math.tau - math.acos(limit)

    def forwards(theta: float) -> float:
        return math.sin(theta) - math.sin(begin) - limit * (theta - begin)

    end = brentq(forwards, begin + 0.1, math.tau + 2.0)
    assert arcs[-1].theta[0] == pytest.approx(begin, abs=2e-4)
    assert arcs[-1].theta[-1] == pytest.approx(math.tau, abs=1e-12)
    assert (arcs[0].theta[0], arcs[0].theta[-1]) == pytest.approx((0.0, end - math.tau), abs=2e-3)
    inside = np.linspace(begin + 0.05, math.tau, 5)
    known = [forwards(theta) for theta in inside]
    assert arcs[-1].slip_at(inside) == pytest.approx(known, abs=1e-6)
    # backwards from -cos = reach + drag on
    if reach + drag < 1.0:
        limit = reach + drag
        turned = math.pi - math.acos(limit)

        def backwards(theta: float) -> float:
            return math.sin(theta) - math.sin(turned) + limit * (theta - turned)

        stop = brentq(backwards, turned + 0.05, turned + 3.0)
        (middle,) = arcs[1:-1]
        assert (middle.theta[0], middle.theta[-1]) == pytest.approx((turned, stop), abs=4e-3)
        inside = np.linspace(turned + 0.05, stop - 0.05, 5)
        assert middle.slip_at(inside) == pytest.approx([backwards(x) for x in inside], abs=1e-6)
    for arc in arcs:
        assert isinstance(arc, SkidArc)
        assert (np.diff(arc.theta) > 0.0).all()


def test_roller_with_enough_traction_does_not_skid() -> None:
    assert skid_arcs(WHOLE, accelerated(1.0 + 1e-9)) == []
    assert skid_arcs(HALVES, accelerated(1.0 + 1e-9)) == []
    assert skid_arcs(WHOLE, accelerated(0.999)) != []
    short = skid_arcs(WHOLE, accelerated(0.9999))  # begins and ends next to a sample
    assert [len(arc.theta) for arc in short] == [3, 4, 2]


@pytest.mark.parametrize("panels", [WHOLE, HALVES])
@pytest.mark.parametrize("reach", [0.3, 0.02])
def test_heavy_roller_skids_forwards_and_backwards_in_turn(panels: list, reach: float) -> None:
    # half a turn each: w = sin(x) - sin(x0) - r (x - x0) from x0, where w(x0 + pi) = 0
    arcs = skid_arcs(panels, accelerated(reach))
    first = math.asin(-0.5 * math.pi * reach)

    def slip(theta: np.ndarray) -> np.ndarray:
        since = np.mod(theta - first, math.tau)
        half = np.mod(since, math.pi)
        one = np.sin(first + half) - math.sin(first) - reach * half
        return np.where(since < math.pi, one, -one)

    for arc in arcs:
        assert arc.slip == pytest.approx(slip(arc.theta), abs=1e-4)
        rate = np.cos(arc.theta) - np.sign(arc.slip[1]) * reach
        assert arc.slip_per_rad[1:-1] == pytest.approx(rate[1:-1], abs=1e-9)
        assert arc.slip_per_rad[-1] == pytest.approx(rate[-1], abs=2e-4)
    # parts end where the slip turns, at the ends of panels and where rolling could begin
    assert len(arcs) == 3 + len(panels)
    lengths = [arc.theta[-1] - arc.theta[0] for arc in arcs]
    assert sum(lengths) == pytest.approx(math.tau, abs=0.03)


def test_roller_that_never_rolls_is_refused() -> None:
    with pytest.raises(ValueError, match="rolls nowhere: the traction never suffices"):
        skid_arcs(WHOLE, accelerated(0.5, 1.6))
