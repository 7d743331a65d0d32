"""The figure of a run that starts from a worn profile."""

import numpy as np
import pytest

import wearsim
from tests.evolution import SCENARIOS
from wearsim.report.figures.run import _draw_profiles, run_figure
from wearsim.report.text import shown


class Lines:
    """Replacement of axes that stores the plotted heights."""

    def __init__(self):
        self.heights = []

    def plot(self, y, height, **style):
        self.heights.append(np.asarray(height))

    def __getattr__(self, name):
        return lambda *values, **named: ([], [])


class Colours:
    """Replacement of the colours of two records."""

    records = (0, -1)

    def of(self, record):
        return "black"


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    path = tmp_path_factory.mktemp("start") / "start.csv"
    path.write_text("y [mm], height [um]\n-12, 0\n-3, 0\n0, -9\n3, 0\n12, 0\n")
    scenario = wearsim.load_scenario(
        SCENARIOS / "rig-450min.toml",
        overrides={"cylinder.profile": str(path), "operation.passes": 3000},
    )
    return wearsim.run(scenario)


def test_profiles_are_drawn_from_the_start_profile_on(result):
    axes = Lines()
    _draw_profiles(axes, result, Colours(), ())
    expected = np.interp(result.y, [-3e-3, 0.0, 3e-3], [0.0, -9.0, 0.0])
    np.testing.assert_allclose(axes.heights[0], expected, atol=1e-9)
    np.testing.assert_allclose(axes.heights[1], expected - result.profiles[-1] * 1e6, atol=1e-9)
    assert result.start_height.min() < -8e-6


def test_caption_names_both_depths(result):
    figure = run_figure(result)
    depth = shown(float(result.depth[-1]), "um")
    below = shown(float(result.depth_below_nominal[-1]), "um")
    expected = f"depth {depth} worn since the start, depth below nominal {below}"
    assert expected in figure.get_suptitle()
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert "Depth worn since the start" in titles
