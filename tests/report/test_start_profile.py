"""The figure of a run that starts from a worn profile."""

import numpy as np
import pytest

import wearsim
from tests.evolution import SCENARIOS
from tests.report.drawn import ensemble_figure, run_figure
from wearsim.levelling import Measured
from wearsim.report.text import shown
from wearsim.scenario import parse_scenario


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
    (axes, *_) = run_figure(result).axes
    heights = [line.get_ydata() for line in axes.get_lines()]
    expected = np.interp(result.y, [-3e-3, 0.0, 3e-3], [0.0, -9.0, 0.0])
    np.testing.assert_allclose(heights[0], expected, atol=1e-9)
    np.testing.assert_allclose(heights[-1], expected - result.profiles[-1] * 1e6, atol=1e-9)
    assert result.start_height.min() < -8e-6


def test_caption_names_both_depths(result):
    figure = run_figure(result)
    depth = shown(float(result.depth[-1]), "um")
    below = shown(float(result.depth_below_nominal[-1]), "um")
    expected = f"depth {depth} worn since the start, depth below nominal {below}"
    assert expected in figure.get_suptitle()
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert "Depth worn since the start" in titles
    labels = {axes.get_title(loc="left"): axes.get_ylabel() for axes in figure.axes}
    assert labels["Depth worn since the start"] == "depth worn since the start [um]"


def test_figure_of_an_ensemble_starts_from_the_start_profile(result, tmp_path):
    random = {"distribution": "lognormal", "median": "2e-11 1/Pa", "factor": 1.5}
    text = result.scenario.text.replace('k_over_h = "1.1e-11 1/Pa"', "")
    overrides = {"wear.cylinder.k_over_h": random, "contact.strips": 41}
    scenario = parse_scenario(text, "a.toml", result.scenario.files.__getitem__, overrides)
    found = wearsim.ensemble(scenario, 3, tmp_path / "e.h5", scheduler="serial")
    figure = ensemble_figure(found, [Measured("probe", np.zeros(1), np.full(1, -8e-6))])
    (axes,) = [a for a in figure.axes if a.get_title(loc="left").startswith("Worn profile")]
    lines = {line.get_label(): line.get_ydata() for line in axes.get_lines()}
    y = found.raw.variables["y"]
    start = np.interp(y, [-3e-3, 0.0, 3e-3], [0.0, -9.0, 0.0])
    np.testing.assert_allclose(lines["start of the tests"], start, atol=1e-9)
    np.testing.assert_allclose(lines["mean"], start - found.band().mean * 1e6, atol=1e-9)
    np.testing.assert_allclose(lines["measured: probe"], [-8.0])
    assert axes.get_ylabel() == "height above nominal [um]"
    lowest = shown(-float(lines["mean"].min()) * 1e-6, "um")
    assert f"worn since the start, mean profile {lowest} below nominal" in figure.get_suptitle()


def test_warning_of_a_rough_start_profile_names_a_filter_that_helps(result, tmp_path):
    rng, y = np.random.default_rng(1), np.linspace(-12.0, 12.0, 2401)
    height = rng.normal(0.0, 1.0, 2401) - np.maximum(20.0 - y**2, 0.0)
    rows = "\n".join(f"{place},{value}" for place, value in zip(y, height, strict=True))
    (tmp_path / "rough.csv").write_text(f"y [mm],height [um]\n{rows}\n")
    changes = {"cylinder.profile": str(tmp_path / "rough.csv"), "operation.passes": 3000}
    rough = wearsim.run(wearsim.load_scenario(SCENARIOS / "rig-450min.toml", changes))
    (warning,) = [text for text in rough.warnings if text.startswith("estimated error")]
    assert 'cylinder.profile_filter = "0.8 mm"' in warning
    filtered = wearsim.run(rough.scenario.changed({"cylinder.profile_filter": "0.8 mm"}))
    assert filtered.depth_error[-1] < 0.2 * rough.depth_error[-1]
    assert not any("profile_filter" in text for text in filtered.warnings)


@pytest.mark.parametrize("passes", [3000, 100_000])
def test_depth_below_nominal_states_an_error_that_holds(result, passes):
    """The start profile has its lowest point in the middle of a strip or between two strips."""

    def run(**changes):
        changes = {name.replace("__", "."): value for name, value in changes.items()}
        return wearsim.run(result.scenario.changed({"operation.passes": passes, **changes}))

    fine = run(contact__strips=401, evolution__tolerance=1e-5, evolution__strip_error=False)
    for strips in (80, 81, 121):
        coarse = run(contact__strips=strips)
        below, error = coarse.depth_below_nominal[-1], coarse.depth_below_nominal_error
        assert abs(below - fine.depth_below_nominal[-1]) <= error < 0.06 * below, strips
        assert coarse.final["depth_below_nominal_error_m"] == error
        (row,) = [row for row in coarse.view.rows() if row.label == "depth below nominal"]
        assert row.text.endswith(f" ± {shown(error, 'um', 2)}")
