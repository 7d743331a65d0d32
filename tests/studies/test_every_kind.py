"""Every kind of study by every display, on small real results.

A kind or a display that is added later is in this test without being named: the kinds are those
that are installed, the displays those of the conformance tests.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import wearsim
from tests.stable_names import json_keys, stored
from wearsim.plugins import StudyKind
from wearsim.results.viewed import study_kinds
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.identify.measurements import Measurement
from wearsim.testing.study_kinds import STUDY_KIND, StudyKindFixture

SHORT = {"operation.duration": "1 min", "outputs.records": 3, "contact.strips": 41}


def run(folder: Path) -> Any:
    return wearsim.run(shipped_scenario("rig-450min", SHORT), folder / "run.h5")


def cam_run(folder: Path) -> Any:
    cam = shipped_scenario("cam-eccentric", {"operation.turns": 2000, "outputs.records": 3})
    return wearsim.run(cam, folder / "cam.h5")


def contact(folder: Path) -> Any:
    return wearsim.study_contact(shipped_scenario("mean-contact"), with_fields=True)


def cam(folder: Path) -> Any:
    return wearsim.study_cam(shipped_scenario("cam-groove"))


def dissipation(folder: Path) -> Any:
    friction = {"distribution": "uniform", "low": 0.08, "high": 0.12}
    scenario = shipped_scenario("mean-contact", {"friction.coefficient": friction})
    return wearsim.dissipation(scenario, 30, folder / "powers.h5")


def ensemble(folder: Path) -> Any:
    scenario = shipped_scenario("rig-ensemble", SHORT)
    return wearsim.ensemble(scenario, 24, folder / "tests.h5", scheduler="serial")


def life(folder: Path) -> Any:
    scenario, options = shipped_scenario("rig-life", {"contact.strips": 41}), {"target": 20_000}
    path = folder / "life.h5"
    return wearsim.life(
        scenario, 12, path, limits=["depth 5 um"], scheduler="serial", most="1e6", **options
    )


def identification(folder: Path) -> Any:
    depths = [Measurement(f"{d}.csv", depth=d * 1e-6, depth_std=1e-6) for d in (45, 48)]
    scenario = shipped_scenario("rig-identify")
    return wearsim.identify(scenario, depths, folder / "k.h5", draws=16)


def posterior_lives(folder: Path) -> Any:
    """Return the lives with a small posterior of K/H."""
    medians = [f"{k}e-11,{t},1" for k in (0.8, 1.0, 1.3) for t in (0.2, 0.4)]
    (folder / "K.csv").write_text("\n".join(["median [1/Pa],scatter,weight", *medians]))
    return made("life", 0).with_posterior(folder / "K.csv")


def returns(folder: Path) -> Any:
    units = ["life,state", "9000,failed", "12000,suspended", "15000,suspended"]
    (folder / "returns.csv").write_text("\n".join(units))
    return wearsim.field_returns(posterior_lives(folder), folder / "returns.csv")


def demonstration(folder: Path) -> Any:
    lives = posterior_lives(folder)
    return wearsim.demonstration([lives, lives], "R=0.9 C=0.95 at 0.1 h", labels=["a", "b"])


def comparison(folder: Path) -> Any:
    return wearsim.compare([made("run", 0), made("ensemble", 0)], ["run", "tests"])


SAMPLES: dict[str, list[Callable[[Path], Any]]] = {
    "run": [run, cam_run],
    "contact": [contact],
    "cam": [cam],
    "dissipation": [dissipation],
    "ensemble": [ensemble],
    "life": [life],
    "returns": [returns],
    "demonstration": [demonstration],
    "identification": [identification],
    "comparison": [comparison],
}
FOLDER: list[Path] = []


@pytest.fixture(scope="module", autouse=True)
def folder(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Keep the files of the samples in one folder."""
    FOLDER[:] = [tmp_path_factory.mktemp("kinds")]


@cache
def made(name: str, number: int) -> Any:
    """Return a sample of a kind, computed once."""
    return SAMPLES[name][number](FOLDER[0])


@cache
def fixture_of(kind: StudyKind, number: int) -> StudyKindFixture:
    """Return a sample with its view and panels, computed once."""
    return StudyKindFixture(kind, made(kind.name, number))


CASES = [
    (kind, number)
    for kind in study_kinds()
    for number in range(len(SAMPLES.get(kind.name, [run])))
    if kind.result.startswith("wearsim.")
]


@pytest.mark.parametrize("check", STUDY_KIND.values(), ids=lambda check: check.name)
@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case[0].name}-{case[1]}")
def test_every_kind_in_every_display(case: Any, check: Any) -> None:
    kind, number = case
    assert kind.name in SAMPLES, f"add a small result of the kind '{kind.name}' to SAMPLES"
    check(fixture_of(kind, number))


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case[0].name}-{case[1]}")
def test_every_kind_as_a_table_of_pandas(case: Any) -> None:
    table = made(case[0].name, case[1]).to_dataframe()
    assert len(table)
    assert list(table.attrs["units"]) == list(table.columns)


def json_of_every_kind() -> list[str]:
    """Return the keys of the JSON of every kind of study; computes the samples."""
    names = sorted({kind.name for kind, _ in CASES})
    samples = [(name, number) for name in names for number in range(len(SAMPLES[name]))]
    return sorted(
        {key for name, n in samples for key in json_keys(name, made(name, n).view.data())}
    )


def test_keys_of_the_json_of_every_kind_are_listed() -> None:
    found, listed = json_of_every_kind(), stored("json-keys")
    changed = sorted(set(found) ^ set(listed))
    assert found == listed, f"stable names have changed, see docs/compatibility.md: {changed}"


@pytest.mark.parametrize("name", ["identification", "dissipation", "life", "run", "cam", "contact"])
def test_rows_state_numbers_by_name(name: str) -> None:
    answers = made(name, 0).view.answers()
    assert answers
    assert any(answer.value > 0.0 for answer in answers.values())
