"""Arguments in Python: profiles from arrays, files of results, lists of values; final progress."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from rig_text import short_rig

import wearsim
from tests.fixed_batches import batches_of
from wearsim import Profile, Scenario, ScenarioError, UnknownNameError
from wearsim.studies.ensemble import driver

Y = np.linspace(-8e-3, 8e-3, 161)
GROOVE = Profile(Y, -20e-6 * np.exp(-((Y / 3e-3) ** 2)))


@pytest.fixture
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Scenario:
    """Return a scenario, and write its file in the current folder."""
    monkeypatch.chdir(tmp_path)
    Path("rig.toml").write_text(short_rig())
    return wearsim.load_scenario("rig.toml")


def test_test_starts_from_a_profile_of_arrays(scenario: Scenario) -> None:
    rows = [
        f"{y!r},{height!r}" for y, height in zip(Y.tolist(), GROOVE.height.tolist(), strict=True)
    ]
    Path("worn.csv").write_text("\n".join(["y [m],height [m]", *rows]))
    expected = wearsim.run(scenario.changed({"cylinder.profile": "worn.csv"}))
    for given in (
        scenario.changed({"cylinder.profile": GROOVE}),
        wearsim.load_scenario("rig.toml", {"cylinder.profile": GROOVE}),
    ):
        result = wearsim.run(given, "rig.h5", force=True)
        np.testing.assert_array_equal(result.profiles, expected.profiles)
        assert given.cylinder.profile is not None
        np.testing.assert_array_equal(given.cylinder.profile.height, GROOVE.height)
    stored = wearsim.open_results("rig.h5").scenario.cylinder.profile
    assert stored is not None
    np.testing.assert_array_equal(stored.y, Y)
    level = Profile(Y, np.zeros(len(Y)))
    again = given.changed({"cylinder.profile": level, "operation.rollers": 1})
    assert again.cylinder.profile is not None
    assert not again.cylinder.profile.height.any()


def test_profile_of_arrays_replaces_the_reading_of_a_file(scenario: Scenario) -> None:
    Path("worn.csv").write_text("position,trace\n-8,0\n0,-9\n8,0\n")
    columns = {"cylinder.profile": "worn.csv", "cylinder.profile_units": ["mm", "um"]}
    columns["cylinder.profile_columns"] = ["position", "trace"]
    changed = scenario.changed(columns).changed({"cylinder.profile": GROOVE})
    assert changed.cylinder.profile is not None
    np.testing.assert_array_equal(changed.cylinder.profile.height, GROOVE.height)


def test_tables_take_a_profile_of_arrays() -> None:
    steel = {"radius": "20 mm", "material": "steel"}
    scenario = Scenario.from_dict(
        {
            "roller": {**steel, "crown_radius": "500 mm"},
            "cylinder": {**steel, "profile": GROOVE},
            "operation": {"speed": "1000 rpm", "rollers": 1},
            "load": {"kind": "constant", "normal_force": "300 N"},
            "friction": {"coefficient": 0.1},
            "creepage": {"longitudinal": 1e-3},
        }
    )
    worn = wearsim.solve_contact(scenario)
    assert worn.power == wearsim.solve_contact(scenario, GROOVE).power


@pytest.mark.parametrize(
    ("height", "message"),
    [
        (np.ma.masked_greater(Y, 7e-3), "height: is not finite at point 150, got nan"),
        (Y + 1j, "height: is not a sequence of numbers"),
    ],
)
def test_missing_and_complex_heights_are_mistakes(height: Any, message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        Profile(Y, height)


def test_arrays_have_short_reprs(scenario: Scenario) -> None:
    assert repr(GROOVE) == "<Profile: 161 points, y -8 to 8 mm, height -20 to -0.01632 um>"
    solution = repr(wearsim.solve_contact(scenario))
    assert solution.startswith("<ContactSolution: ")
    assert repr(wearsim.study_contact(scenario)) == f"<ContactStudy 'slender': {solution}>"


def test_files_must_be_named_by_their_paths(scenario: Scenario) -> None:
    result = wearsim.run(scenario, "rig.h5")
    opens: list[Any] = [wearsim.resume, wearsim.open_results, wearsim.resume_ensemble]
    for function in opens:
        with pytest.raises(TypeError, match=r"its path, got a Result; result\.path is the file"):
            function(result)
    load: Any = wearsim.load_scenario
    with pytest.raises(TypeError, match="must be a Scenario or the path of its file, got a None"):
        load(None)


def test_text_of_a_scenario_is_told_from_a_file(scenario: Scenario) -> None:
    read: Any = Scenario.from_toml
    with pytest.raises(ScenarioError, match=r"is the name of a file.*load_scenario reads a file"):
        read("rig.toml")
    for other in (Path("rig.toml"), b"[roller]"):
        with pytest.raises(TypeError, match="text must be TOML in a str, got a"):
            read(other)
    tables: Any = None
    with pytest.raises(TypeError, match="tables must be a mapping by name, got a NoneType"):
        Scenario.from_dict(tables)


@pytest.mark.parametrize("until", ["50", "depth 50", -1, 0.0])
def test_wrong_limit_is_called_one(scenario: Scenario, until: str | float) -> None:
    with pytest.raises(ValueError, match=r"^'.*' is not a limit[:,] "):
        wearsim.run(scenario, until=until)


def test_lists_are_asked_for(scenario: Scenario) -> None:
    sweep: Any = wearsim.sweep
    with pytest.raises(TypeError, match=r"values must be a list, got 0\.1"):
        sweep(scenario, "friction.coefficient", 0.1)
    result, compare = wearsim.run(scenario), wearsim.compare
    with pytest.raises(TypeError, match="must be a list of two or more, got <Result"):
        compare(result)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="2 results need as many labels, got 1"):
        compare([result, result], ["a"])
    with pytest.raises(TypeError, match="only results of wear tests can be compared, got 3"):
        compare([result, 3])  # type: ignore[list-item]
    with pytest.raises(TypeError, match="ax must be one Axes of matplotlib, got a ndarray"):
        result.plot(ax=Figure().subplots(2))


def test_files_are_compared(scenario: Scenario) -> None:
    results = [wearsim.run(scenario, "a.h5"), wearsim.run(scenario, "b.h5")]
    rows = wearsim.compare(["a.h5", Path("b.h5")]).rows
    assert [row.value for row in rows] == [row.value for row in wearsim.compare(results).rows]


def test_last_progress_has_the_final_estimate(
    scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(driver, "BETWEEN_ESTIMATES", 1e9)
    monkeypatch.setattr("wearsim.studies.ensemble.driver.BatchSizes", batches_of(1))
    random = scenario.changed(
        {"friction.coefficient": {"distribution": "uniform", "low": 0.08, "high": 0.12}}
    )
    seen: list[Any] = []
    tests = wearsim.ensemble(random, 4, "b.h5", scheduler="serial", on_progress=seen.append)
    assert seen[-1].done == 4
    assert seen[-1].estimate == tests.estimate("depth").mean


def test_argument_that_is_no_path_or_list_is_named(scenario: Scenario) -> None:
    identify: Any = wearsim.identify
    report: Any = wearsim.save_report
    load: Any = wearsim.load_scenario
    friction = {"distribution": "uniform", "low": 0.08, "high": 0.12}
    random = scenario.changed({"friction.coefficient": friction})
    with pytest.raises(TypeError, match="a results file must be named by its path, got a int"):
        wearsim.run(scenario, output=3)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="a results file must be named by its path, got a int"):
        identify(scenario, "groove.csv", 3)
    with pytest.raises(TypeError, match=r"tests must be files of profiles, .* got a int"):
        identify(scenario, 3)
    with pytest.raises(
        TypeError, match=r"must be a list of results, such as \[result\], got a Res"
    ):
        report(wearsim.run(scenario), "page.html")
    with pytest.raises(TypeError, match="only results can be on a page, got 3"):
        report([3], "page.html")
    with pytest.raises(ValueError, match="no result is given for the page"):
        report([], "page.html")
    with pytest.raises(UnknownNameError, match="'3' is not a variable of a run; known: y, "):
        wearsim.run(scenario).values(3)  # type: ignore[arg-type]
    Path("kept.h5").write_text("kept")
    with pytest.raises(TypeError, match="force must be True or False, got 'no'"):
        wearsim.run(scenario, "kept.h5", force="no")  # type: ignore[arg-type]
    assert Path("kept.h5").read_text() == "kept"
    with pytest.raises(TypeError, match=r'must be a text such as "depth.mean 1%", got 0\.01'):
        wearsim.ensemble(random, 2, "e.h5", precision=0.01)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="a dotted key of overrides must be a text, got None"):
        load("rig.toml", {None: 1})


@pytest.mark.parametrize("parts", [False, True])
def test_ensemble_is_read_after_a_change_of_the_folder(
    scenario: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, parts: bool
) -> None:
    random = scenario.changed(
        {"friction.coefficient": {"distribution": "uniform", "low": 0.08, "high": 0.12}}
    )
    stops = iter([False, True]) if parts else iter([])
    monkeypatch.setattr("wearsim.studies.ensemble.driver.BatchSizes", batches_of(1))
    try:
        wearsim.ensemble(
            random, 3, "b.h5", scheduler="serial", stop_requested=lambda: next(stops, parts)
        )
    except wearsim.Interrupted:
        assert parts
    tests = wearsim.open_results("b.h5")
    assert tests.finished is not parts
    (tmp_path / "other").mkdir()
    monkeypatch.chdir(tmp_path / "other")
    assert np.isfinite(tests.values("depth")[: tests.count]).all()
    assert tests.count > 0


def test_help_of_every_function_names_its_parameters_and_what_it_returns() -> None:
    for name in wearsim.__all__:
        function = getattr(wearsim, name)
        if not inspect.isfunction(function):
            continue
        text, signature = inspect.getdoc(function) or "", inspect.signature(function)
        assert [key for key in signature.parameters if key not in text] == [], name
        assert signature.return_annotation in {None, "None"} or "Returns\n" in text, name
