"""The figure of a cam before wear: units, names of the segments, and skids."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes

from tests.report.drawn import cam_figure
from wearsim.scenario import load_scenario
from wearsim.studies.cam.study import study_cam

SCENARIOS = Path(__file__).parents[2] / "scenarios"


Panels = Callable[[str], dict[str, Axes]]


@pytest.fixture(scope="module")
def panels_of() -> Panels:
    """Return a function of the name of a cam that returns the panels of its figure."""

    @cache
    def panels(name: str) -> dict[str, Axes]:
        figure = cam_figure(study_cam(load_scenario(SCENARIOS / f"cam-{name}.toml")), "a cam")
        figure.draw_without_rendering()  # places of the texts
        return {axes.get_title(loc="left").split(",")[0]: axes for axes in figure.axes}

    return panels


@pytest.mark.parametrize(("name", "unit"), [("cycloidal", "mm"), ("swinging", "deg")])
def test_legend_of_the_motion_has_units(panels_of: Panels, name: str, unit: str) -> None:
    labels = panels_of(name)["Motion of the follower"].get_legend_handles_labels()[1]
    ends = [label[label.index("[") :] for label in labels]
    assert ends == [f"[{unit}]", f"[{unit}/rad]", f"[{unit}/rad$^2$]"]


@pytest.mark.parametrize("name", ["cycloidal", "groove"])
def test_names_of_the_segments_lie_below_the_curves(panels_of: Panels, name: str) -> None:
    panels = panels_of(name)
    for title in ("Motion of the follower", "Normal force"):
        axes = panels[title]
        assert [text.get_text() for text in axes.texts][:2] in (
            ["dwell", "cycloidal"],
            ["dwell", "modified-sine"],
        )
        top = max(text.get_window_extent().y1 for text in axes.texts)
        shared = [each for each in axes.figure.axes if each.bbox.bounds == axes.bbox.bounds]
        for each in shared:
            for line in each.lines:
                values = np.asarray(line.get_ydata(), dtype=float)
                if len(values) > 2:  # others are boundaries of segments
                    lowest = each.transData.transform((0.0, np.nanmin(values)))[1]
                    assert lowest > top
    skids = [axes for axes in panels.values() if "(skids shaded)" in axes.get_title(loc="left")]
    assert len(skids) == (2 if name == "groove" else 0)
