"""Skids that move with wear: stations placed again where the roller starts and ends to slip."""

from __future__ import annotations

import numpy as np
import pytest
from cam_text import SCENARIOS

import wearsim
from wearsim.errors import Interrupted
from wearsim.evolution.contacts import contact_batch, fresh_state
from wearsim.evolution.relocation import moved_depth, relocated
from wearsim.studies.cam.turn import CamTurn
from wearsim.studies.effort import restarts_of
from wearsim.studies.run.assemble import assemble_problem
from wearsim.studies.run.draws import draw


def scenario(
    inertia: str = "3e-3 kg m^2", turns: str = "60000", feedback: str = "static"
) -> wearsim.Scenario:
    """Return the cycloidal cam with a heavy roller, which skids, and a stiff spring."""
    values = {
        "cam.stations": 7,
        "roller.inertia": inertia,
        "operation.turns": int(turns),
        "load.preload": "200 N",
        "load.stiffness": "60 N/mm",
        "load.feedback": feedback,
        "contact.strips": 21,
        "evolution.tolerance": 1e-2,
    }
    return wearsim.load_scenario(SCENARIOS / "cam-cycloidal.toml", values)


def watched_moves(monkeypatch):
    """Return a list that receives stations before and after, and the states, of each movement."""
    found = []

    def watched(problem, state):
        moved, end = relocated(problem, state)
        if moved is not problem:
            found.append((problem.kinematics.track, moved.kinematics.track, state, end))
        return moved, end

    monkeypatch.setattr("wearsim.evolution.integrate.relocated", watched)
    return found


@pytest.fixture
def moves(monkeypatch):
    """Return the movements of a test, in a list that each of them is added to."""
    return watched_moves(monkeypatch)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return the run of the heavy roller, and its movements."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        moves = watched_moves(monkeypatch)
        return wearsim.run(scenario(), tmp_path_factory.mktemp("whole") / "whole.h5"), moves


def test_ends_of_skids_follow_the_load_and_keep_volume_and_energy(whole):
    test = scenario()
    result, moves = whole
    assert len(moves) >= 4
    problem, _, _ = assemble_problem(draw(test))
    both_bodies = result.depth[-1] + result.roller_depth[-1].max()
    assert 1.0 / 3.0 < restarts_of(problem, both_bodies) / len(moves) < 3.0
    for old, new, before, after in moves:
        lengths = [one.along.length.ravel()[:, None] for one in (old, new)]
        volumes = [
            (length * depth).sum(axis=0)
            for length, depth in zip(
                lengths,
                (before.cylinder_depth[old.places][:, 0, 0], after.cylinder_depth[:, 0, 0]),
                strict=True,
            )
        ]
        scale = volumes[0].max()
        np.testing.assert_allclose(volumes[1], volumes[0], rtol=1e-12, atol=1e-15 * scale)
        assert (after.roller_depth == before.roller_depth).all()
        assert (after.energy == before.energy).all()
        assert (after.cylinder_depth >= 0.0).all()
    first, last = moves[0][0].skids, moves[-1][1].skids
    assert np.degrees(np.abs(first - last).max()) > 1.0
    final, factor = result.final, 1.1e-11
    for name in ("worn_volume_m3", "roller_worn_volume_m3"):
        assert final[name] == pytest.approx(
            factor * final["dissipated_energy_J"], rel=1e-12, abs=0.0
        )
    # the ends are those of the roller on the cam as it is worn
    turn = CamTurn(test)
    change = moves[-1][3].skid_loads[0, :, 0]
    arcs = turn.worn(change).arcs
    assert np.degrees(np.abs(last[0] - (arcs[0].theta[0], arcs[0].theta[-1])).max()) == 0.0
    assert change.max() < 0.0
    records = np.asarray(result.raw.records["cylinder_depth_profile"])
    assert records.shape[1] == len(result.raw.static["station_angle"]) == turn.stations.count


def test_small_changes_leave_the_stations_alone(moves):
    wearsim.run(scenario(turns="200"))
    assert not moves


def test_resumed_run_with_moved_skids_is_bit_for_bit(tmp_path, whole, moves):
    unbroken, moves_of_unbroken = whole
    count = [0]

    def stop() -> bool:
        count[0] += 1
        return count[0] % 20 == 0

    with pytest.raises(Interrupted):
        wearsim.run(scenario(), tmp_path / "parts.h5", stop_requested=stop)
    moved = len(moves)
    for _ in range(50):
        try:
            parts = wearsim.resume(tmp_path / "parts.h5", stop_requested=stop)
        except Interrupted:
            continue
        break
    assert len(moves) > moved
    assert moves_of_unbroken
    for of in ("history", "records", "checkpoint"):
        ours, theirs = getattr(parts.raw, of), getattr(unbroken.raw, of)
        assert ours.keys() == theirs.keys()
        for name, values in theirs.items():
            np.testing.assert_array_equal(ours[name], values, err_msg=name)


def test_only_cams_whose_skids_may_move_are_followed():
    followed = [
        assemble_problem(draw(scenario(**change)))[0].kinematics.track
        for change in ({}, {"feedback": "none"}, {"inertia": "2.94e-5 kg m^2"})
    ]
    assert [cam.relocated is not None for cam in followed] == [True, False, False]
    # their stations differ from test to test, so that they are stepped alone
    assert not followed[0].matches(followed[0])
    assert followed[2].matches(followed[2])


def test_depth_at_moved_stations_is_that_of_the_worn_cam():
    test = scenario()
    cam = assemble_problem(draw(test))[0].kinematics.track.along
    change = np.full(cam.panels.count, -20.0)
    new = cam.relocated(change)
    lift = test.cam.motion.lift  # smooth, and constant on the dwells
    smooth, expected = (1e-5 + 1e-3 * lift(one.angle.ravel())[0] for one in (cam, new))
    moved = moved_depth(smooth[:, None], cam, new)[:, 0]
    np.testing.assert_allclose(moved, expected, rtol=2e-3)
    same = moved_depth(smooth[:, None], cam, cam)[:, 0]
    assert (same == smooth).all()


def test_roller_with_less_lever_rolls_on_next_to_its_skids():
    values = {"load.feedback": "static", "contact.strips": 31, "cam.stations": 7}
    groove = wearsim.load_scenario(SCENARIOS / "cam-groove.toml", values)
    problem, _, _ = assemble_problem(draw(groove))
    state = fresh_state(problem)
    loads = np.broadcast_to(problem.force(np.zeros(1)), problem.shape)
    worn = np.full_like(state.roller_depth, 0.05 * groove.roller.radius)
    gap = problem.gap(state.cylinder_depth, worn)
    batch = contact_batch(problem, gap, loads, state.cylinder_depth, worn)
    solved = problem.model.solve(batch)
    rolls = np.isfinite(batch.bearing_torque)
    assert 0 < rolls.sum() < len(rolls)
    radius = 0.95 * groove.roller.radius
    most = groove.friction.coefficient * batch.normal_force * radius
    assert (np.abs(batch.bearing_torque[rolls]) <= most[rolls]).all()
    balanced = np.abs(solved.force_x[rolls]) * radius
    assert balanced == pytest.approx(np.abs(batch.bearing_torque[rolls]), rel=0.02, abs=1e-6)
