"""The figures of runs and contacts: drawn data against the results."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from tests.report.drawn import contact_figure, identification_figure, run_figure
from wearsim.errors import PluginError, ResultsFileError
from wearsim.levelling import Measured
from wearsim.report.figures import save_figure
from wearsim.scenario import load_scenario
from wearsim.studies.contact.single import ContactStudy, study_contact
from wearsim.studies.identify.api import identify
from wearsim.studies.identify.measurements import Measurement
from wearsim.studies.run import run as study_run
from wearsim.studies.run.result import Result

SCENARIOS = Path(__file__).parents[2] / "scenarios"
SHORT = {"operation.duration": "3 min", "outputs.records": 4}


@pytest.fixture(scope="module")
def result() -> Result:
    overrides = {**SHORT, "wear.roller.k_over_h": "1e-11 1/Pa"}
    return study_run.run(load_scenario(SCENARIOS / "rig-450min.toml", overrides))


@pytest.fixture(scope="module")
def study() -> ContactStudy:
    return study_contact(load_scenario(SCENARIOS / "mean-contact.toml"), with_fields=True)


def panel(figure: Figure, title: str) -> object:
    (axes,) = [axes for axes in figure.axes if axes.get_title(loc="left").startswith(title)]
    return axes


def test_profiles_are_drawn_downwards_in_mm_and_um(result: Result) -> None:
    axes = panel(run_figure(result), "Worn profile")
    lines = axes.get_lines()  # type: ignore[attr-defined]
    assert len(lines) == 5 + 1  # the records, and the roller
    assert lines[4].get_xdata() == pytest.approx(result.y * 1e3)
    assert lines[4].get_ydata() == pytest.approx(-result.profiles[-1] * 1e6)
    assert lines[5].get_ydata() == pytest.approx(-result.roller_profiles[-1] * 1e6)
    assert lines[5].get_linestyle() == "--"


def test_unworn_rollers_are_not_drawn() -> None:
    fresh = study_run.run(load_scenario(SCENARIOS / "rig-450min.toml", SHORT))
    axes = panel(run_figure(fresh), "Worn profile")
    assert len(axes.get_lines()) == 5  # type: ignore[attr-defined]


def test_measurements_are_drawn_last_and_within_the_panel(result: Result) -> None:
    probe = Measured("probe", np.array([-9e-3, 9e-3]), np.array([-1e-6, 1e-6]))
    axes = panel(run_figure(result, [probe]), "Worn profile")
    last = axes.get_lines()[-1]  # type: ignore[attr-defined]
    assert last.get_xdata() == pytest.approx([-9.0, 9.0])
    assert last.get_ydata() == pytest.approx([-1.0, 1.0])
    left, right = axes.get_xlim()  # type: ignore[attr-defined]
    assert left <= -9.0
    assert right >= 9.0


def test_depth_is_drawn_for_every_worn_step(result: Result) -> None:
    axes = panel(run_figure(result), "Depth")
    drawn = axes.get_lines()[-1].get_ydata()  # type: ignore[attr-defined]
    assert drawn[-1] == pytest.approx(result.depth[-1] * 1e6)


def test_depth_of_every_roller_pass_has_no_stepping_error() -> None:
    options = {"operation.duration": "0.1 min", "evolution.stepper": "per-pass"}
    axes = panel(
        run_figure(study_run.run(load_scenario(SCENARIOS / "rig-450min.toml", options))), "Depth"
    )
    (label,) = axes.get_legend_handles_labels()[1]  # type: ignore[attr-defined]
    assert label == "depth\n(no stepping error: every roller pass is solved)"


def test_figure_states_the_limit_at_which_a_run_stopped() -> None:
    scenario = load_scenario(SCENARIOS / "rig-450min.toml", SHORT)
    stopped = study_run.run(scenario, until="depth 0.1 um")
    title = run_figure(stopped).get_suptitle()
    assert "(slender, implicit, stopped at depth 0.1 um)" in title
    assert title.endswith("width 0 mm, not deeper than 1.000 um")


def test_different_rollers_have_separate_curves_of_dissipation() -> None:
    three = study_run.run(load_scenario(SCENARIOS / "rig-three-rollers.toml", SHORT))
    axes = panel(run_figure(three), "Dissipated")
    names = axes.get_legend_handles_labels()[1]  # type: ignore[attr-defined]
    assert names == ["roller 1", "roller 2", "roller 3"]
    assert len(axes.get_lines()) == 5 * 3 + 3  # type: ignore[attr-defined]


def test_logged_load_is_drawn_with_that_at_the_steps(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    logged = study_run.run(load_scenario(SCENARIOS / "rig-logged-load.toml", SHORT))
    log, steps = panel(run_figure(logged), "Normal force").get_lines()  # type: ignore[attr-defined]
    # a line between the steps would contradict the log
    assert (log.get_linestyle(), steps.get_linestyle(), steps.get_marker()) == ("-", "None", "o")

    def fail(self: Result) -> None:
        raise PluginError("not here")

    monkeypatch.setattr(Result, "scenario", property(fail))
    assert len(panel(run_figure(logged), "Normal force").get_lines()) == 1  # type: ignore[attr-defined]


def test_run_stopped_before_its_first_step_can_be_drawn(result: Result, tmp_path: Path) -> None:
    raw = result.raw
    fresh = replace(
        raw,
        history={name: array[:1] for name, array in raw.history.items()},
        records={name: array[:1] for name, array in raw.records.items()},
        finished=False,
    )
    save_figure(run_figure(Result(fresh)), tmp_path / "fresh.png")
    assert (tmp_path / "fresh.png").stat().st_size > 10_000


def test_contact_has_its_hertzian_peak_and_all_panels(study: ContactStudy) -> None:
    figure = contact_figure(study, "title")
    axes = panel(figure, "Pressure")
    top = float(np.max(axes.collections[0].get_array()))  # type: ignore[attr-defined]
    assert top == pytest.approx(study.solution.peak_pressure / 1e6, rel=2e-3)
    for title in ("Traction", "Adhesion", "Dissipated power density", "Line load"):
        panel(figure, title)
    panel(figure, "Dissipated power per length")


def test_contact_without_fields_has_strips_only(study: ContactStudy) -> None:
    figure = contact_figure(replace(study, fields=None), "title")
    assert len(figure.axes) == 2
    line = figure.axes[1].get_lines()[0]
    assert np.max(line.get_ydata()) == pytest.approx(study.solution.dissipation.max() / 1e3)


def test_figure_is_written_completely_or_not_at_all(
    study: ContactStudy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    figure = contact_figure(replace(study, fields=None), "title")
    path = tmp_path / "x.png"
    path.write_text("mine")

    def fail(*_: object, **__: object) -> None:
        raise OSError("disk full")

    with monkeypatch.context() as patch:
        patch.setattr(figure, "draw", fail)
        with pytest.raises(ResultsFileError, match=r"x\.png: cannot be written \(disk full\)"):
            save_figure(figure, path)
    assert [item.name for item in tmp_path.iterdir()] == ["x.png"]
    assert path.read_text() == "mine"
    save_figure(figure, path)
    assert path.read_bytes().startswith(b"\x89PNG")
    assert path.stat().st_mode & 0o044  # readable by others, unlike a temporary file


def test_wear_factors_within_a_decade_have_several_ticks() -> None:
    depths = [Measurement("one", depth=1e-6 * depth, depth_std=1e-6) for depth in (46, 50, 53)]
    found = identify(load_scenario(SCENARIOS / "rig-450min.toml"), depths)
    for axes in identification_figure(found).axes:
        low, high = axes.get_xlim()
        assert high < 10.0 * low
        places = [place for place in axes.get_xticks() if low < place < high]
        assert len(places) >= 4
        assert [axes.xaxis.get_major_formatter()(place) for place in places] == [
            f"{place:g}" for place in places
        ]
        assert not len(axes.xaxis.get_ticklocs(minor=True))
