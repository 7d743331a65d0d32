"""Traces: levelling, spikes, differences, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.studies.identify.grooves import NOISE, groove, write
from wearsim.errors import ScenarioError
from wearsim.studies.identify import traces
from wearsim.studies.identify.measurements import Measurement, measurements_of
from wearsim.studies.identify.traces import (
    Trace,
    half_depth_width,
    level,
    measured_depth,
    read_trace,
)
from wearsim.types import Profile

CROWN = 0.5
DEPTH = 48.1e-6


def trace(path: Path, **options: object) -> Trace:
    """Return the trace in a file."""
    return read_trace(Measurement(path.name, path, **options), CROWN)  # type: ignore[arg-type]


def test_shoulders_are_found_and_level_the_trace(tmp_path: Path):
    found = trace(write(tmp_path / "t.csv", *groove(np.random.default_rng(1))))
    assert found.depth == pytest.approx(DEPTH, abs=1.5e-6)
    assert found.middle == pytest.approx(0.2e-3, abs=0.05e-3)
    assert found.inclination == pytest.approx(2e-4, abs=0.4e-4)
    unworn = found.y[found.unworn]
    # the groove ends 6.93 mm from its middle
    assert np.abs(unworn - 0.2e-3).min() == pytest.approx(7.3e-3, abs=0.2e-3)
    assert found.noise is not None
    assert found.noise.std == pytest.approx(NOISE.std, rel=0.3)
    assert "(found)" in found.levelled


def test_given_shoulders_are_used(tmp_path: Path):
    path = write(tmp_path / "t.csv", *groove(np.random.default_rng(1)))
    found = trace(path, shoulders=9e-3)
    assert np.abs(found.y[found.unworn] - found.middle).min() >= 9e-3
    with pytest.raises(ScenarioError, match="no unworn surface on both sides beyond 10"):
        trace(path, shoulders=10.9e-3)


def test_spikes_and_dropouts_are_left_out(tmp_path: Path):
    y, height = groove(np.random.default_rng(1))
    rough = height.copy()
    rough[[50, 300, 301, 420]] += [90e-6, -200e-6, -200e-6, 500e-6]
    rough[200:225] = -9e-4
    found = trace(write(tmp_path / "t.csv", y, rough))
    assert found.depth == pytest.approx(DEPTH, abs=1.5e-6)
    assert found.notes == ("29 spikes or dropouts left out",)
    rough[::3] += 3e-4 * (1.0 + np.arange(len(rough[::3])) % 2)
    with pytest.raises(ScenarioError, match="are spikes or dropouts"):
        trace(write(tmp_path / "bad.csv", y, rough))


def test_trace_without_noise_is_refused_as_such(tmp_path: Path):
    """A computed profile has shoulders of one height, which are no dropouts."""
    y = np.linspace(-10e-3, 10e-3, 501)
    path = write(tmp_path / "computed.csv", y, -np.maximum(DEPTH - y**2, 0.0))
    with pytest.raises(ScenarioError, match="greatest or least height, 10 or more"):
        trace(path)


def test_good_points_of_an_inclined_trace_are_kept(tmp_path: Path):
    y, height = groove(np.random.default_rng(1), inclination=20e-3)
    found = trace(write(tmp_path / "t.csv", y, height))
    assert len(found.y) == len(y)
    assert found.notes == ()
    assert found.inclination == pytest.approx(20e-3, rel=5e-3)


def test_measured_depth_is_not_biased_by_noise():
    rng = np.random.default_rng(5)
    found = []
    for _ in range(40):
        y, height = groove(rng, half=12e-3)
        unworn = np.zeros(len(y), dtype=bool)
        one = level(Trace("t", y, height, unworn, "", None, None, None, 0.0), None, CROWN)
        found.append(measured_depth(one, CROWN))
    values, errors = np.array(found).T
    assert values.mean() == pytest.approx(DEPTH, abs=0.2e-6)
    assert 0.7 < errors.mean() / values.std() < 1.6


def test_difference_of_traces_removes_the_form(tmp_path: Path):
    y, height = groove(np.random.default_rng(1))
    form = 8e-6 * np.sin(y / 2e-3)
    after = write(tmp_path / "t.csv", y, height + form)
    before = write(tmp_path / "b.csv", y, form)
    found = trace(after, before=before)
    assert found.difference
    assert found.levelled.endswith("less the trace before")
    assert found.depth == pytest.approx(DEPTH, abs=1.5e-6)
    with pytest.raises(ValueError, match="2 profiles before the tests for 1"):
        measurements_of([after], [before, before])


def test_trace_without_shoulders_gives_shape_only(tmp_path: Path):
    found = trace(write(tmp_path / "t.csv", *groove(np.random.default_rng(1), half=7.2e-3)))
    assert found.depth is None
    assert found.noise is None
    assert found.notes == (
        "no unworn shoulders: its depth is unknown, and K/H follows from shape and width only",
    )


def test_reversed_sign_is_refused(tmp_path: Path):
    y, height = groove(np.random.default_rng(1))
    with pytest.raises(ScenarioError, match="positive up"):
        trace(write(tmp_path / "t.csv", y, -height))
    # a column named depth is positive downwards
    found = trace(write(tmp_path / "d.csv", y, -height, "y [mm],depth [um]"))
    assert found.depth == pytest.approx(DEPTH, abs=1.5e-6)


def test_wrong_units_are_refused(tmp_path: Path):
    y, height = groove(np.random.default_rng(1))
    message = (
        r"t\.csv: column height: has a range that cannot be, got 0\.0\d+ m over 0\.0\d+ m of y,"
    )
    with pytest.raises(ScenarioError, match=message):
        trace(write(tmp_path / "t.csv", y, height, "y [mm],height [mm]"))
    # a unit of y may be the wrong one
    message = r"got [\d.]+e-05 m over [\d.]+e-05 m of y, expected the right units .* y \[mm"
    with pytest.raises(ScenarioError, match=message):
        trace(write(tmp_path / "t.csv", y, height, "y [um],height [um]"))


def test_width_at_half_depth_of_a_parabola():
    y = np.linspace(-8e-3, 8e-3, 801)
    worn = np.maximum(50e-6 - y**2, 0.0)  # metres: a radius of 0.5 m
    assert half_depth_width(y, worn) == pytest.approx(2.0 * np.sqrt(25e-6), rel=1e-3)
    assert np.isnan(half_depth_width(y[100:-300], worn[100:-300] + 40e-6))


def test_lines_of_a_map_are_averaged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    rng = np.random.default_rng(1)
    lines = [Profile(*groove(rng)) for _ in range(9)]
    path = write(tmp_path / "map.csv", lines[0].y, lines[0].height)
    monkeypatch.setattr(traces, "load_lines", lambda _: lines)
    found = trace(path)
    monkeypatch.setattr(traces, "load_lines", lambda _: lines[:1])
    single = trace(path)
    assert found.noise is not None
    assert single.noise is not None
    # a median scatters 1.25 times as much as a mean
    assert found.noise.std == pytest.approx(1.25 * single.noise.std / 3.0, rel=0.3)
    assert "mean of 9 lines" in found.notes


def test_spread_of_lines_is_noise(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    rng = np.random.default_rng(1)
    lines = []
    for number in range(5):
        y, height = groove(rng)
        # the groove differs around the circumference, the shoulders do not
        inside = np.abs(y - 0.2e-3) < 6e-3
        lines.append(Profile(y, height + 4e-6 * (number - 2) * inside))
    monkeypatch.setattr(traces, "load_lines", lambda _: lines)
    found = trace(write(tmp_path / "map.csv", lines[0].y, lines[0].height))
    assert found.noise is not None
    # offsets are removed from the lines, which leaves half of the scatter
    assert found.noise.std == pytest.approx(0.5 * 4e-6 * np.sqrt(2.5 / 5.0), rel=0.2)
    assert any("spread of the lines" in note for note in found.notes)
