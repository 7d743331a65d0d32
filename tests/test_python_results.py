"""Results in Python: tables, datasets, figures, progress, sweeps, unknown names, identity."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray
from matplotlib.figure import Figure
from rig_text import short_rig

import wearsim
from wearsim import Profile, Scenario, UnknownNameError
from wearsim.studies.comparison.compare import compare

FRICTION = {"distribution": "uniform", "low": 0.08, "high": 0.12}
LOAD = {
    "distribution": "uniform",
    "low": "290 N",
    "high": "310 N",
    "persistence": "per-roller",
}
SERIAL = {"scheduler": "serial", "workers": 1}


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return Scenario.from_toml(short_rig())


@pytest.fixture(scope="module")
def random(scenario: Scenario) -> Scenario:
    return scenario.changed({"friction.coefficient": FRICTION, "load.normal_force": LOAD})


@pytest.fixture(scope="module")
def results(
    scenario: Scenario, random: Scenario, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, object]:
    """Return a result of every kind, with its file."""
    folder = tmp_path_factory.mktemp("results")
    three = scenario.changed({"roller.offset": ["-1 mm", "0 mm", "1 mm"]})
    return {
        "run": wearsim.run(scenario, folder / "run.h5"),
        "three rollers": wearsim.run(three, folder / "three.h5"),
        "dissipation": wearsim.dissipation(random, 5, folder / "dissipation.h5"),
        "ensemble": wearsim.ensemble(random, 3, folder / "ensemble.h5", **SERIAL),
    }


KINDS = ["run", "three rollers", "dissipation", "ensemble"]


@pytest.mark.parametrize("kind", KINDS)
def test_dataset_equals_that_of_the_file(kind: str, results: dict) -> None:
    result = results[kind]
    made = result.to_xarray()
    with xarray.open_dataset(result.path, engine="h5netcdf", decode_cf=False) as read:
        assert set(made.variables) == set(read.variables)
        for name in read.variables:
            assert made[name].dims == read[name].dims
            assert made[name].attrs == {key: read[name].attrs[key] for key in made[name].attrs}
            if read[name].dtype.kind in "fiu":
                np.testing.assert_array_equal(made[name].values, read[name].values)
        assert made.attrs["title"] == read.attrs["title"]
        assert set(made.attrs) == set(read.attrs)


def test_history_is_a_table(results: dict) -> None:
    table, result = results["run"].to_dataframe(), results["run"]
    assert table.index.name == "step"
    np.testing.assert_array_equal(table["depth"], result.depth)
    np.testing.assert_array_equal(table["normal_force"], result.normal_force)
    assert table.attrs["units"]["depth"] == "m"
    rollers = results["three rollers"].to_dataframe()
    np.testing.assert_array_equal(
        rollers["normal_force.2"], results["three rollers"].normal_force[:, 1]
    )


def test_realisations_are_tables(results: dict) -> None:
    study, tests = results["dissipation"], results["ensemble"]
    table = study.to_dataframe()
    np.testing.assert_array_equal(table["power"], study.power)
    np.testing.assert_array_equal(
        table["friction.coefficient"], study.inputs["friction.coefficient"]
    )
    table = tests.to_dataframe()
    assert table.index.tolist() == [0, 1, 2]
    np.testing.assert_array_equal(table["depth"], tests.at_end("depth"))
    np.testing.assert_array_equal(
        table["load.normal_force.3"], tests.inputs["load.normal_force"][:, 2]
    )
    assert table.attrs["units"]["load.normal_force.3"] == "N"


@pytest.mark.parametrize(
    ("method", "library"), [("to_xarray", "xarray"), ("to_dataframe", "pandas")]
)
def test_missing_library_is_named_with_its_extra(
    method: str, library: str, results: dict, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(ModuleNotFoundError, match=rf"{library} is not.*'wearsim\[data\]'"):
        getattr(results["run"], method)()


@pytest.mark.parametrize("kind", KINDS)
def test_results_are_drawn(kind: str, results: dict) -> None:
    figure = results[kind].plot()
    assert isinstance(figure, Figure)
    assert len(figure.axes) >= 4
    axes = Figure().subplots()
    assert results[kind].plot(ax=axes) is axes
    assert axes.lines or axes.patches
    assert axes.get_xlabel()


@pytest.mark.parametrize("kind", KINDS)
def test_unknown_variables_list_the_known_ones(kind: str, results: dict) -> None:
    with pytest.raises(UnknownNameError, match=r"'dpth' is not a variable.*known:.*y"):
        results[kind].values("dpth")
    with pytest.raises(AttributeError, match=r"'titel' is not an attribute.*'title'\?\); known:"):
        results[kind].titel  # noqa: B018
    assert not hasattr(results[kind], "_private")


def test_observable_as_an_attribute_names_the_method(results: dict) -> None:
    with pytest.raises(AttributeError, match=r"values\('depth'\) returns this variable"):
        results["ensemble"].depth  # noqa: B018


def test_unknown_observables_list_the_known_ones(results: dict) -> None:
    tests = results["ensemble"]
    for call in (tests.at_end, tests.estimate, tests.course, tests.sensitivity, tests.independent):
        with pytest.raises(UnknownNameError, match=r"mean 'depth'\?\); known: depth, width"):
            call("dpth")
    with pytest.raises(UnknownNameError, match=r"'0.9' is not a probability.*known: 0.025, 0.05"):
        tests.estimate("depth").quantile(0.9)
    with pytest.raises(UnknownNameError, match="known: depth, width"):
        compare([tests, tests], ["a", "b"], "dpth")


def test_unknown_names_of_a_scenario_list_the_known_ones(scenario: Scenario) -> None:
    for key, value, known in (
        ("contact.model", "slendr", "slender"),
        ("contact.model", "xyz", "semi-hertzian"),
        ("wear.law", "xyz", "t-gamma"),
        ("load.kind", "xyz", "spring"),
        ("load.xyz", 1, "normal_force"),
        ("xyz.a", 1, "operation"),
        ("friction.coefficient", {"distribution": "xyz"}, "uniform"),
    ):
        with pytest.raises(wearsim.WearsimError, match=known):
            scenario.changed({key: value})
    with pytest.raises(AttributeError, match=r"no attribute 'rnu'; it has .*load_scenario"):
        wearsim.rnu  # noqa: B018


def test_exceptions_are_public() -> None:
    from wearsim import errors

    classes = {
        name
        for name, item in vars(errors).items()
        if isinstance(item, type) and issubclass(item, Exception)
    }
    assert len(classes) > 10
    assert classes <= set(dir(wearsim))
    assert all(issubclass(getattr(wearsim, name), wearsim.WearsimError) for name in classes)


def test_results_compare_and_hash_by_identity(scenario: Scenario, results: dict) -> None:
    solution = wearsim.study_contact(scenario, with_fields=True)
    profile = Profile([-1e-2, 1e-2], [0.0, 0.0])
    tests = results["ensemble"]
    for item in (
        *results.values(), solution, solution.solution, solution.fields, solution.grid,
        solution.point, profile, tests.course("depth"), tests.band(), scenario,
        compare([tests, tests]),
    ):  # fmt: skip
        other = pickle.loads(pickle.dumps(item))
        assert item == item  # noqa: PLR0124
        assert item != other
        assert len({item, other, item}) == 2
    again = pickle.loads(pickle.dumps(results["run"]))
    np.testing.assert_array_equal(again.depth, results["run"].depth)
    np.testing.assert_array_equal(copy.deepcopy(results["run"]).depth, again.depth)


@pytest.mark.parametrize(
    ("y", "height", "message"),
    [
        ([0.0, 1e-3, 1e-3], [0, 0, 0], "y: does not increase, got 0.001 m, then 0.001 m"),
        ([2e-3, 1e-3], [0, 0], "reverse both arrays"),
        ([0, 1e-3], [0, 0, 0], "2 values of y and 3 of height"),
        ([-9.0, 9.0], [0, 0], "y: has a range that cannot be, got 18 m, expected metres"),
        ([-9e-3, 9e-3], [0, -50], "range that cannot be, got 50 m over 0.018 m of y, expected me"),
        ([0, float("nan")], [0, 0], "y: is not finite at point 1"),
        ([0], [0], "y: is not a sequence of points"),
        ("ab", [0, 0], "y: is not a sequence of numbers"),
        ([[0, 1e-3]], [0, 0], "y: is not a sequence of points"),
    ],
)
def test_mistakes_of_a_profile_are_errors_of_wearsim(
    y: object, height: object, message: str
) -> None:
    with pytest.raises(wearsim.ScenarioError, match="profile:") as caught:
        Profile(y, height)  # type: ignore[arg-type]
    assert message in str(caught.value)


def test_profile_takes_lists_and_whole_numbers(scenario: Scenario) -> None:
    flat = Profile([-0.01, 0, 0.01], (0, 0, 0))
    assert flat.y.dtype == float
    power = wearsim.solve_contact(scenario, flat).power
    assert power == pytest.approx(wearsim.solve_contact(scenario).power, rel=1e-3)


def test_profile_is_read_from_its_file(scenario: Scenario, tmp_path: Path) -> None:
    file = tmp_path / "worn.csv"
    file.write_text("y [mm],height [um]\n-9,0\n0,-2\n9,0\n")
    profile = Profile([-9e-3, 0, 9e-3], [0, -2e-6, 0])
    for path in (file, str(file)):
        assert wearsim.solve_contact(scenario, path).power == pytest.approx(
            wearsim.solve_contact(scenario, profile).power
        )
    with pytest.raises(wearsim.ScenarioError, match=r"gone\.csv: the file cannot be read"):
        wearsim.solve_contact(scenario, tmp_path / "gone.csv")
    with pytest.raises(TypeError, match="profile must be a Profile or the path of a file"):
        wearsim.solve_contact(scenario, ([0, 1e-3], [0, 0]))  # type: ignore[arg-type]


def test_arguments_of_another_kind_are_named(scenario: Scenario) -> None:
    with pytest.raises(TypeError, match="values must be a list, got '300 N'"):
        wearsim.sweep(scenario, "load.normal_force", "300 N")
    with pytest.raises(
        TypeError, match="overrides must be a mapping of values by dotted key, got a list"
    ):
        scenario.changed(["seed=3"])  # type: ignore[arg-type]


def test_messages_hold_no_text_of_pydantic(scenario: Scenario) -> None:
    for key, value in (
        ("friction.coefficient", -0.1),
        ("friction.coefficient", "a"),
        ("roller.radius", 0.02),
        ("operation.rollers", 2.5),
        ("wear.cylinder.k_over_h", {"distribution": "normal"}),
        ("sampling.correlation", [["a", "b", 2]]),
        ("sampling.correlation", 3),
        ("outputs.records", "many"),
    ):
        with pytest.raises(wearsim.ScenarioError) as caught:
            scenario.changed({key: value})
        text = str(caught.value)
        assert key.split(".")[1] in text
        assert not [words for words in ("Value error", "Input should", "pydantic") if words in text]


def test_sweep_runs_tests_in_memory_and_in_files(scenario: Scenario, tmp_path: Path) -> None:
    values = [0.05, np.float64(0.1)]
    seen: list[tuple[str, Path | None]] = []
    swept = wearsim.sweep(
        scenario, "friction.coefficient", values, on_value=lambda *item: seen.append(item)
    )
    assert seen == [("0.05", None), ("0.1", None)]
    assert swept[1].depth[-1] == wearsim.run(scenario).depth[-1]
    assert swept[0].depth[-1] < swept[1].depth[-1]
    output = tmp_path / "a.h5"
    for _ in range(2):  # the second call finds the files of the first one
        filed = wearsim.sweep(scenario, "friction.coefficient", values, output)
        assert [result.path.name for result in filed] == ["a-0.05.h5", "a-0.1.h5"]
    assert filed[0].depth[-1] == swept[0].depth[-1]
    with pytest.raises(wearsim.ResultsFileError, match="already exists; force=True"):
        wearsim.sweep(scenario.changed({"seed": 3}), "friction.coefficient", values, output)


def test_sweep_runs_ensembles(random: Scenario, tmp_path: Path) -> None:
    output = tmp_path / "a.h5"
    swept = wearsim.sweep(random, "operation.rollers", [1, 2], output, realisations=2, **SERIAL)
    assert [result.count for result in swept] == [2, 2]
    assert [result.scenario.operation.rollers for result in swept] == [1, 2]
    with pytest.raises(TypeError, match="name one with output"):
        wearsim.sweep(random, "operation.rollers", [1], realisations=2)
    with pytest.raises(wearsim.ScenarioError, match="did you mean 'rollers'"):
        wearsim.sweep(random, "operation.rolers", [1])
    with pytest.raises(ValueError, match="one or more values"):
        wearsim.sweep(random, "operation.rollers", [])


def test_progress_is_shown_on_request(
    scenario: Scenario, random: Scenario, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    events: list[object] = []
    wearsim.run(scenario)
    assert capsys.readouterr().err == ""
    wearsim.run(scenario, tmp_path / "a.h5", progress=True, on_event=events.append)
    assert "running 1,500 passes" in (shown := capsys.readouterr().err)
    assert "done in" in shown
    assert events
    wearsim.dissipation(random, 2, progress=True)
    wearsim.ensemble(random, 2, tmp_path / "b.h5", progress=True, **SERIAL)
    wearsim.resume(tmp_path / "a.h5", progress=True)
    wearsim.resume_ensemble(tmp_path / "b.h5", progress=True, **SERIAL)
    with pytest.raises(wearsim.Interrupted):
        wearsim.ensemble(random, 3, tmp_path / "c.h5", stop_requested=lambda: True, **SERIAL)
    capsys.readouterr()
    wearsim.resume_ensemble(tmp_path / "c.h5", progress=True, **SERIAL)


def test_import_of_wearsim_needs_no_heavy_library() -> None:
    heavy = ("pandas", "xarray", "matplotlib", "rich", "typer", "scipy.stats", "h5py")
    code = f"import sys, wearsim; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
