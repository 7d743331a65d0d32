"""Surfaces of cams for CAD and CAM: chords, closure, worn depth, and DXF as ezdxf reads it."""

from __future__ import annotations

import math

import numpy as np
import pytest

import wearsim
from tests.studies.cam.cam_text import cam
from wearsim.errors import PluginError
from wearsim.mechanics.cam import surface_points
from wearsim.report.surfaces import Sampling, Surface, closed_spline
from wearsim.studies.cam.grooves import grooves_at
from wearsim.studies.cam.turn import CamTurn
from wearsim.studies.run.result import Result

CHORD = 0.5e-6
EVERY = np.linspace(0.0, math.tau, 4_001)


@pytest.fixture(scope="module")
def worn() -> Result:
    changes = {"operation.turns": 50_000, "evolution.tolerance": 1e-2, "contact.strips": 41}
    return wearsim.run(cam("cycloidal").changed(changes))


def places(surface: Surface, name: str) -> np.ndarray:
    """Return the points of a curve, x + i y [m]."""
    (curve,) = [curve for curve in surface.curves if curve.name == name]
    return np.asarray(curve.x + 1j * curve.y)


def distance(points: np.ndarray, polygon: np.ndarray) -> np.ndarray:
    """Return the distance of points from the closed polygon through others."""
    first, chord = polygon, np.roll(polygon, -1) - polygon
    along = (points[:, None] - first) * np.conj(chord) / np.abs(chord) ** 2
    near = first + np.clip(along.real, 0.0, 1.0) * chord
    return np.asarray(np.abs(points[:, None] - near).min(axis=1))


def true_surface(result: Result, theta: np.ndarray, depth: np.ndarray | float) -> np.ndarray:
    turn = CamTurn(result.scenario)
    x, y = surface_points(turn.cam.follower, turn.at_angles(theta).kinematics, theta, depth)[1]
    return np.asarray(x + 1j * y)


@pytest.mark.parametrize("chord", [10e-6, CHORD])
def test_chords_stay_within_their_tolerance(worn: Result, chord: float) -> None:
    surface = worn.view.surface(Sampling(chord))
    theta = EVERY[::4]
    away = distance(true_surface(worn, theta, 0.0), places(surface, "unworn")).max()
    assert 0.5 * chord < away < chord * (1.0 + 1e-6)
    # it is computed at places on the chords, ten for each
    assert away == pytest.approx(surface.deviation, rel=0.02)
    # about as few as chords of a circle of the same length
    radius = 183.45e-3 / math.tau
    assert surface.count < 1.3 * math.pi / math.acos(1.0 - chord / radius)


def test_no_point_is_doubled_and_curves_close(worn: Result) -> None:
    for sampling in (Sampling(CHORD), Sampling(points=360)):
        surface = worn.view.surface(sampling)
        for name in ("unworn", "worn"):
            points = places(surface, name)
            steps = np.abs(np.roll(points, -1) - points)
            assert steps.min() > 1e-6
            assert steps.max() < 4.0 * np.median(steps)  # also from the last point to the first
            assert len(points) == len(surface.columns[0].values)
    # equally spaced points
    assert len(points) == 360
    steps = np.abs(np.diff(places(surface, "unworn")))
    assert np.ptp(steps) < 1e-3 * steps.mean()


def test_worn_surface_is_that_of_the_groove_at_a_position(worn: Result) -> None:
    for position in (0.0, 0.7e-3, 1.0):
        surface = worn.view.surface(Sampling(points=90, position=position))
        columns = {column.name: column.values for column in surface.columns}
        for angle, depth in zip(columns["angle"][::7], columns["depth"][::7], strict=True):
            profile = grooves_at(worn, float(angle))[0][-1]
            expected = np.interp(position, worn.y, profile, 0.0, 0.0)
            assert depth == pytest.approx(expected, rel=1e-3, abs=2e-9)
    deepest = worn.view.surface(Sampling(points=720)).columns[-1].values
    assert deepest.max() == pytest.approx(float(np.max(worn.depth[-1])), rel=1e-4)


def test_surface_before_wear_is_that_of_the_run(worn: Result) -> None:
    study = wearsim.study_cam(worn.scenario, [0.0])
    before = study.view.surface(Sampling(points=100))
    assert [curve.name for curve in before.curves] == ["unworn"]
    after = worn.view.surface(Sampling(points=100))
    assert places(before, "unworn") == pytest.approx(places(after, "unworn"), abs=1e-12)


def test_groove_has_both_flanks_as_closed_curves() -> None:
    changes = {"operation.turns": 1000, "evolution.tolerance": 1e-2, "contact.strips": 31}
    result = wearsim.run(cam("groove").changed(changes))
    surface = result.view.surface(Sampling())
    names = [
        f"{flank} flank, {state}" for flank in ("outer", "inner") for state in ("unworn", "worn")
    ]
    assert [curve.name for curve in surface.curves] == names
    radius = result.scenario.roller.radius
    outer, inner = (places(surface, f"{flank} flank, unworn") for flank in ("outer", "inner"))
    gap = distance(inner, outer)
    assert gap == pytest.approx(np.full(len(gap), 2.0 * radius), abs=3e-6)
    columns = {column.name: np.array(column.values) for column in surface.columns}
    depths = [
        columns["depth"][columns["flank"] == f"{flank} flank"] for flank in ("outer", "inner")
    ]
    assert min(depth.max() for depth in depths) > 0.0
    # where the roller touches one flank, the other one does not wear
    assert all((depth == 0.0).any() for depth in depths)
    # in the animation both outlines of a flank have the same points
    assert result.view.animation().frame(0).marks


@pytest.mark.parametrize("spline", [False, True])
def test_dxf_passes_the_audit_and_has_the_surface(worn: Result, tmp_path, spline: bool) -> None:
    ezdxf = pytest.importorskip("ezdxf")
    surface = worn.view.surface(Sampling(2e-6))
    surface.save(tmp_path / "cam.dxf", spline=spline)
    drawing = ezdxf.readfile(tmp_path / "cam.dxf")
    audit = drawing.audit()
    assert not audit.errors
    assert not audit.fixes
    assert drawing.units == 4  # mm
    entities = {entity.dxf.layer: entity for entity in drawing.modelspace()}
    assert set(entities) == {"UNWORN", "WORN"}
    kind = "SPLINE" if spline else "LWPOLYLINE"
    for layer, entity in entities.items():
        assert entity.dxftype() == kind
        assert entity.closed
        points = places(surface, layer.lower())
        if spline:
            curve = entity.construction_tool()
            found = 1e-3 * np.array([complex(v.x, v.y) for v in curve.approximate(1500)])
            assert abs(found[0] - found[-1]) < 1e-12
            depth = grooves_depth(worn) if layer == "WORN" else 0.0
            away = distance(found, true_surface(worn, EVERY, depth))
            assert away.max() < 0.1e-6  # far below the tolerance of its points
        else:
            found = 1e-3 * np.array([complex(x, y) for x, y, *_ in entity])
            assert found == pytest.approx(points, abs=1e-12)


def grooves_depth(result: Result) -> np.ndarray:
    """Return the greatest depth along `EVERY` angle [m]."""
    stations = CamTurn(result.scenario).stations
    depth = np.asarray(result.raw.history["station_depth"])[-1, :, 0]
    return np.maximum(stations.values_at_angles(depth, EVERY), 0.0)


def test_closed_spline_is_smooth_at_its_end() -> None:
    angle = np.linspace(0.0, math.tau, 24, endpoint=False)
    points = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    from scipy.interpolate import BSpline

    knots, controls = closed_spline(points)
    spline = BSpline(knots, controls, 3)
    ends = knots[0], knots[-1]
    for order in (0, 1):
        first, last = (spline(end, order) for end in ends)
        assert first == pytest.approx(last, abs=1e-12)
    middle = spline(np.linspace(*ends, 500))
    assert np.hypot(*middle.T) == pytest.approx(np.ones(500), abs=2e-5)


def test_missing_package_is_named(worn: Result, tmp_path, monkeypatch) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "ezdxf", None)
    with pytest.raises(PluginError, match=r"pip install 'wearsim\[cad\]'"):
        worn.view.surface(Sampling()).save(tmp_path / "cam.dxf")
    assert not list(tmp_path.iterdir())


def test_cylinder_has_no_surface() -> None:
    from wearsim.scenario.examples import shipped_scenario

    short = {"operation.duration": "1 s", "outputs.records": 2}
    assert wearsim.run(shipped_scenario("rig-450min", short)).view.surface(Sampling()) is None
