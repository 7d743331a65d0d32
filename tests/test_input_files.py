"""Text of input files: TDMS logs and surfaces as CSV, other files decoded."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from wearsim.csv_tables import read_columns
from wearsim.errors import ScenarioError
from wearsim.input_files import read_input
from wearsim.profiles import ProfileChoice
from wearsim.scenario import load_scenario

SCENARIOS = Path(__file__).parents[1] / "scenarios"
LOAD = np.array([300.0, 301.25, 299.5])


def _tdms(path: Path, **channels: tuple[Any, dict[str, object]]) -> Path:
    nptdms = pytest.importorskip("nptdms")
    parts = [
        nptdms.ChannelObject("log", name, np.asarray(values), properties=properties)
        for name, (values, properties) in channels.items()
    ]
    stream = io.BytesIO()
    with nptdms.TdmsWriter(stream) as writer:
        writer.write_segment(parts)
    path.write_bytes(stream.getvalue())
    return path


def _columns(path: Path) -> dict[str, list[float]]:
    text = read_input(path)
    columns = read_columns(text, path.name, {"time": "s", "load": "N"}, rising="time")
    return {name: values.tolist() for name, values in columns.items()}


def test_tdms_log_is_read_from_its_channels(tmp_path: Path) -> None:
    time, load = ([0.0, 1.0, 2.5], {"unit_string": "min"}), (LOAD / 1e3, {"unit_string": "kN"})
    found = _columns(_tdms(tmp_path / "log.tdms", Time=time, Load=load, note=([1, 2, 3], {})))
    assert found["time"] == [0.0, 60.0, 150.0]
    np.testing.assert_allclose(found["load"], LOAD, rtol=1e-15)


def test_tdms_log_is_read_from_waveform_properties(tmp_path: Path) -> None:
    waveform = {"unit_string": "N", "wf_increment": 0.5, "wf_start_offset": 1.0}
    found = _columns(_tdms(tmp_path / "log.tdms", load=(LOAD, waveform)))
    assert found == {"time": [1.0, 1.5, 2.0], "load": LOAD.tolist()}


NEWTON = {"unit_string": "N"}


@pytest.mark.parametrize(
    ("channels", "message"),
    [
        ({"force": (LOAD, NEWTON)}, "the channel 'load' is needed once, got force, expected one"),
        ({"load": (LOAD, NEWTON)}, "has no time, got load, expected a channel 'time'"),
        (
            {"load": (LOAD, {}), "time": (LOAD, {"unit_string": "s"})},
            "channel 'load': ",
        ),
        (
            {"load": (LOAD, NEWTON), "time": (LOAD[1:], {"unit_string": "s"})},
            "time and load differ in length, got 2 and 3 values",
        ),
    ],
)
def test_unsuitable_tdms_log_is_refused(
    tmp_path: Path, channels: dict[str, Any], message: str
) -> None:
    with pytest.raises(ScenarioError) as caught:
        read_input(_tdms(tmp_path / "log.tdms", **channels))
    assert str(caught.value).startswith(f"log.tdms: {message}")


def test_damaged_tdms_log_and_missing_package_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = _tdms(tmp_path / "log.tdms", load=(LOAD, NEWTON))
    path.write_bytes(path.read_bytes()[:20])
    with pytest.raises(ScenarioError, match=r"log\.tdms: (is no TDMS file|the channel 'load')"):
        read_input(path)
    monkeypatch.setitem(__import__("sys").modules, "nptdms", None)
    with pytest.raises(ScenarioError, match=r"TDMS files need another package: pip install 'wear"):
        read_input(path)


def test_surface_becomes_the_text_of_one_profile(tmp_path: Path) -> None:
    sdfio = pytest.importorskip("sdfio")
    path, heights = tmp_path / "map.sdf", 1e-6 * np.array([[0.0, 1.0], [2.0, 3.1]])
    sdfio.write(path, heights, x_scale=1e-3, y_scale=1e-3)
    text = read_input(path, ProfileChoice(row=1))
    columns = read_columns(text, "map.sdf", {"y": "m", "height": "m"})
    assert columns["height"].tolist() == heights[1].tolist()
    assert columns["y"].tolist() == [-5e-4, 5e-4]
    with pytest.raises(ScenarioError, match=r"map\.sdf: has several rows, got 2 rows"):
        read_input(path)


def test_other_files_are_decoded(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes("time [s],load [N]\n0,1\n".encode("utf-16"))
    assert read_input(path) == "time [s],load [N]\n0,1\n"


def test_columns_of_a_log_are_chosen_by_name(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("Zeit;Kraft [kN]\n23:59:00;0,3\n01:00:00;0,31\n")
    rig = (SCENARIOS / "rig-logged-load.toml").read_text()
    path = tmp_path / "rig.toml"
    path.write_text(re.sub(r"(?m)^file = .*", 'file = "log.csv"', rig))
    test = {"operation.duration": "50 min"}
    with pytest.raises(ScenarioError, match=r"choose other names with load\.columns"):
        load_scenario(path, test)
    scenario = load_scenario(path, {**test, "load.columns": ["Zeit", "Kraft"]})
    assert scenario.load.built.extremes(0.0, 3660.0) == pytest.approx((300.0, 310.0))
    with pytest.raises(ScenarioError, match="time and load need two columns"):
        load_scenario(path, {**test, "load.columns": ["Zeit", "Zeit"]})
