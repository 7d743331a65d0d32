"""Measured profiles: CSV with chosen columns, rows of SDF and X3P surfaces, and their mistakes."""

from __future__ import annotations

import hashlib
import io
import math
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

from wearsim.errors import ScenarioError
from wearsim.profiles import ProfileChoice, gaussian_filtered, read_profile
from wearsim.scenario import load_scenario, parse_scenario
from wearsim.scenario.examples import starter_scenario
from wearsim.types import Profile

HEIGHT = 1e-6 * np.array([[0.0, -1.0, -2.0, 0.5], [0.0, -3.0, np.nan, 0.5], [1.0, -2.0, -4.0, 0.0]])
Y = 1e-3 * np.array([-1.5, -0.5, 0.5, 1.5])


def _sdf(height: np.ndarray = HEIGHT) -> bytes:
    sdfio = pytest.importorskip("sdfio")
    stream = io.BytesIO()
    sdfio.write(stream, height, x_scale=1e-3, y_scale=2e-3)
    return stream.getvalue()


def _x3p(height: np.ndarray = HEIGHT) -> bytes:
    x3pio = pytest.importorskip("x3pio")
    stream = io.BytesIO()
    scales = {"x_scale": 1e-3} if height.ndim == 1 else {"x_scale": 1e-3, "y_scale": 2e-3}
    x3pio.write(stream, height, **scales)
    return stream.getvalue()


@pytest.mark.parametrize("write", [_sdf, _x3p])
@pytest.mark.parametrize(
    ("choice", "y", "height"),
    [
        (ProfileChoice(row=0), Y, [0.0, -1.0, -2.0, 0.5]),
        (ProfileChoice(row=1), Y[[0, 1, 3]], [0.0, -3.0, 0.5]),
        (ProfileChoice(at=3.2e-3), Y, [1.0, -2.0, -4.0, 0.0]),
        (ProfileChoice(mean_rows=(0, 2)), Y, [0.0, -2.0, -2.0, 0.5]),
        (ProfileChoice(mean_rows=(0, 3)), Y, [1.0 / 3.0, -2.0, -3.0, 1.0 / 3.0]),
    ],
)
def test_row_of_a_surface_is_a_profile(write, choice, y, height) -> None:  # type: ignore[no-untyped-def]
    profile = read_profile(write(), "map", choice)
    np.testing.assert_allclose(profile.y, y, atol=1e-15)
    np.testing.assert_allclose(profile.height, 1e-6 * np.array(height), atol=1e-15)


@pytest.mark.parametrize("content", [_sdf(HEIGHT[:1]), _x3p(HEIGHT[0])])
def test_single_row_needs_no_choice(content: bytes) -> None:
    np.testing.assert_allclose(read_profile(content, "line").height, HEIGHT[0], atol=1e-15)


@pytest.mark.parametrize(
    ("choice", "message"),
    [
        (
            ProfileChoice(),
            (
                "map: has several rows, got 3 rows, 0 to 4 mm, expected one of --row 0,"
                " --mean-rows 0:10 or --at '1 mm'; in a scenario, profile_row, profile_mean_rows"
                " or profile_at"
            ),
        ),
        (ProfileChoice(row=1, at=0.0), "map: row and at are given, got 3 rows"),
        (ProfileChoice(row=3), "map: there are no such rows, got 3 to 3, expected 0 to 2"),
        (ProfileChoice(mean_rows=(2, 2)), "map: there are no such rows"),
        (ProfileChoice(at=9e-3), "map: at is not on the surface, got 9 mm, expected 3 rows"),
        (ProfileChoice(row=0, units=("mm", "um")), "map: columns and units are for CSV files"),
    ],
)
def test_wrong_choice_of_rows_is_refused(choice: ProfileChoice, message: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        read_profile(_sdf(), "map", choice)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    "content",
    [_sdf()[:40], _x3p()[:40], b"PK\x03\x04", b"bISO-2.0"],
    ids=["cut SDF", "cut X3P", "start of X3P", "start of SDF"],  # the content has the time of day
)
def test_damaged_surface_is_refused(content: bytes) -> None:
    with pytest.raises(ScenarioError, match=r"map: is no (SDF|X3P) file of one surface or profile"):
        read_profile(content, "map", ProfileChoice(row=0))


def test_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    content = _sdf()
    monkeypatch.setitem(__import__("sys").modules, "sdfio", None)
    with pytest.raises(
        ScenarioError, match=r"SDF files need another package: pip install 'wearsim"
    ):
        read_profile(content, "map.sdf")


def test_columns_and_units_are_chosen_by_name() -> None:
    text = "position,trace,y\n0,1,5\n1,2,4\n"
    choice = ProfileChoice(columns=("position", "trace"), units=("mm", "um"))
    profile = read_profile(text.encode("utf-16"), "p.csv", choice)
    np.testing.assert_allclose(profile.y, [0.0, 1e-3], rtol=1e-15)
    np.testing.assert_allclose(profile.height, [1e-6, 2e-6], rtol=1e-15)
    with pytest.raises(ScenarioError, match="column 'position' has no unit"):
        read_profile(text, "p.csv", ProfileChoice(columns=("position", "trace")))
    with pytest.raises(ScenarioError, match="position and height need two columns, got y"):
        read_profile(text, "p.csv", ProfileChoice(columns=("y", "y")))
    with pytest.raises(ScenarioError, match="row is for the rows of a surface, and this is a CSV"):
        read_profile(text, "p.csv", ProfileChoice(row=1))


# written by hand after the standards, to check the reading packages by more than their own output
SDF_TEXT = """aISO-1.0
ManufacID  = handmade
CreateDate = 310520240800
ModDate    = 310520240800
NumPoints  = 3
NumProfiles = 2
Xscale     = 1.0e-3
Yscale     = 2.0e-3
Zscale     = 1.0e-9
Zresolution = -1
Compression = 0
DataType   = 5
CheckType  = 0
*
0 -1500 250
10 -2500 BAD
*
*
"""
X3P_XML = """<?xml version="1.0" encoding="UTF-8"?>
<p:ISO5436_2 xmlns:p="http://www.opengps.eu/2008/ISO5436_2">
  <Record1>
    <Revision>ISO5436 - 2000</Revision><FeatureType>SUR</FeatureType>
    <Axes>
      <CX><AxisType>I</AxisType><DataType>D</DataType><Increment>1e-3</Increment><Offset>0</Offset></CX>
      <CY><AxisType>I</AxisType><DataType>D</DataType><Increment>2e-3</Increment><Offset>0</Offset></CY>
      <CZ><AxisType>A</AxisType><DataType>D</DataType></CZ>
    </Axes>
  </Record1>
  <Record3>
    <MatrixDimension><SizeX>3</SizeX><SizeY>2</SizeY><SizeZ>1</SizeZ></MatrixDimension>
    <DataLink>
      <PointDataLink>bindata/data.bin</PointDataLink>
      <MD5ChecksumPointData>{digest}</MD5ChecksumPointData>
    </DataLink>
  </Record3>
  <Record4><ChecksumFile>md5checksum.hex</ChecksumFile></Record4>
</p:ISO5436_2>
"""


def _handmade_x3p() -> bytes:
    heights = struct.pack("<6d", 0.0, -1.5e-6, 0.25e-6, 0.01e-6, -2.5e-6, math.nan)
    xml = X3P_XML.format(digest=hashlib.md5(heights, usedforsecurity=False).hexdigest()).encode()
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("main.xml", xml)
        archive.writestr("bindata/data.bin", heights)
        digest = hashlib.md5(xml, usedforsecurity=False).hexdigest()
        archive.writestr("md5checksum.hex", f"{digest} *main.xml\n")
    return stream.getvalue()


@pytest.mark.parametrize("kind", ["sdfio", "x3pio"])
def test_files_written_by_hand_are_read_exactly(kind: str) -> None:
    pytest.importorskip(kind)
    content = SDF_TEXT.encode() if kind == "sdfio" else _handmade_x3p()
    first = read_profile(content, "map", ProfileChoice(row=0))
    np.testing.assert_allclose(first.height, [0.0, -1.5e-6, 0.25e-6], rtol=1e-12, atol=0.0)
    np.testing.assert_allclose(first.y, [-1e-3, 0.0, 1e-3], rtol=1e-12, atol=1e-18)
    second = read_profile(content, "map", ProfileChoice(at=2e-3))
    np.testing.assert_allclose(second.height, [1e-8, -2.5e-6], rtol=1e-12, atol=0.0)


def test_gaussian_filter_transmits_waves_as_the_standard_says() -> None:
    y = np.linspace(0.0, 40e-3, 8001)
    for wavelength in (0.4e-3, 0.8e-3, 1.6e-3, 8e-3):
        wave = Profile(y, 1e-6 * np.sin(2.0 * np.pi * y / wavelength))
        found = gaussian_filtered(wave, 0.8e-3)
        inner = slice(500, -500)
        part = found.height[inner] @ wave.height[inner] / (wave.height[inner] @ wave.height[inner])
        expected = math.exp(-math.log(2.0) * (0.8e-3 / wavelength) ** 2)
        assert part == pytest.approx(expected, abs=2e-4)
    assert expected > 0.99


def test_gaussian_filter_keeps_a_straight_line_to_its_ends() -> None:
    y = np.array([0.0, 0.1, 0.25, 0.3, 1.0, 2.0, 2.1]) * 1e-3
    line = Profile(y, 3e-6 + 2e-3 * y)
    found = gaussian_filtered(line, 0.8e-3)
    np.testing.assert_allclose(found.height, 3e-6 + 2e-3 * found.y, rtol=1e-11)
    assert (found.y[0], found.y[-1]) == (y[0], y[-1])
    assert np.diff(found.y).max() <= 0.05e-3 * (1.0 + 1e-9)


@pytest.mark.parametrize("cutoff", [0.0, -1e-3, math.nan, 3e-3])
def test_impossible_cutoff_is_refused(cutoff: float) -> None:
    with pytest.raises(ValueError, match="must be positive and at most the length"):
        gaussian_filtered(Profile(Y, HEIGHT[0]), cutoff + (1e-3 if cutoff == 3e-3 else 0.0))


def test_cutoff_below_the_distance_of_points_is_refused() -> None:
    y = np.array([-6e-3, -2e-3, 2e-3, 6e-3])
    with pytest.raises(ValueError, match="at least twice the distance of points, 4 mm"):
        gaussian_filtered(Profile(y, 0.0 * y), 5e-3)


def test_column_chosen_as_depth_is_positive_downwards() -> None:
    choice = ProfileChoice(columns=("x", "Depth"), units=("mm", "um"))
    profile = read_profile("x,Depth\n0,1\n1,2\n", "p.csv", choice)
    np.testing.assert_allclose(profile.height, [-1e-6, -2e-6], rtol=1e-15)


def _rig(tmp_path: Path, cylinder: str) -> Path:
    path = tmp_path / "rig.toml"
    path.write_text(starter_scenario().replace("[operation]", f"{cylinder}\n\n[operation]", 1))
    return path


def test_scenario_starts_from_a_row_of_a_surface(tmp_path: Path) -> None:
    heights = np.vstack([np.zeros(201), 1e-6 * np.sin(np.linspace(0.0, 60.0, 201))])
    (tmp_path / "map.sdf").write_bytes(_sdf(heights))
    keys = 'profile = "map.sdf"\nprofile_row = 1'
    scenario = load_scenario(_rig(tmp_path, keys))
    assert scenario.cylinder.profile is not None
    np.testing.assert_array_equal(scenario.cylinder.profile.height, heights[1])
    assert scenario.paths[1] == tmp_path / "map.sdf"
    # results hold the chosen row, so that the scenario can be read again without the surface
    stored = parse_scenario(scenario.text, scenario.file, scenario.files.__getitem__)
    assert stored.cylinder.profile is not None
    np.testing.assert_array_equal(stored.cylinder.profile.height, heights[1])
    smooth = load_scenario(_rig(tmp_path, f'{keys}\nprofile_filter = "60 mm"'))
    assert smooth.cylinder.profile is not None
    assert np.ptp(smooth.cylinder.profile.height) < 0.4 * np.ptp(heights[1])


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ('profile = "map.sdf"', "[cylinder] profile: has several rows, got 3 rows"),
        ('profile = "map.sdf"\nprofile_row = 7', "[cylinder] profile: there are no such rows"),
        ('profile = "map.sdf"\nprofile_at = "2 kg"', "[cylinder] profile: the file cannot be read"),
        ("profile_row = 1", "[cylinder] profile_row: has no meaning without profile"),
        (
            'profile = "map.sdf"\nprofile_row = 1\nprofile_filter = "2 m"',
            "[cylinder] profile_filter: the cutoff of 2000 mm must be positive and at most",
        ),
    ],
)
def test_wrong_choice_of_a_start_profile_is_refused(
    tmp_path: Path, keys: str, message: str
) -> None:
    (tmp_path / "map.sdf").write_bytes(_sdf())
    with pytest.raises(ScenarioError) as caught:
        load_scenario(_rig(tmp_path, keys))
    assert message in str(caught.value)


def test_results_file_as_a_profile_names_the_export() -> None:
    with pytest.raises(ScenarioError, match=r"w.h5: this is a results file; wearsim export"):
        read_profile(b"\x89HDF\r\n\x1a\n\0\0", "w.h5")
