"""Benchmarks with pytest-benchmark: ``pytest tests/benchmarks --benchmark-enable``.

Without that option each benchmark runs once, as a test.
"""

from __future__ import annotations

import json
import re

import pytest

import wearsim
from tests.benchmarks import (
    calls,
    contacts,
    ensemble_cases,
    ensembles,
    models,
    persistence,
    studies,
    table,
    wear_tests,
)
from tests.benchmarks.report import QUICK, TABLES
from wearsim.studies.cam.turn import turn_of
from wearsim.studies.dissipation.monte_carlo import dissipation


def test_speed_of_hertz(benchmark):
    assert benchmark(contacts.rig_hertz).peak_pressure == pytest.approx(680.22e6, rel=1e-5)


@pytest.mark.parametrize("variant", contacts.VARIANTS)
def test_speed_of_the_mean_problem(benchmark, variant):
    mean = contacts.Mean("hertz-fastsim", kalker="line-limit", **contacts.VARIANTS[variant])
    assert benchmark(mean.solve).power == pytest.approx(contacts.FASTSIM_POWER, rel=0.05)


@pytest.mark.parametrize("start", ["cold", "warm"])
def test_speed_of_a_slender_contact(benchmark, start):
    mean = contacts.Mean("slender", strips=81)
    warm = mean.solve() if start == "warm" else None
    assert benchmark(mean.solve, warm).power == pytest.approx(contacts.EXACT_POWER, rel=0.02)


@pytest.mark.parametrize("name", wear_tests.WEAR_TESTS)
def test_speed_of_a_wear_test(benchmark, name):
    assert benchmark(wearsim.run, wear_tests.scenario(name, QUICK)).finished


def test_speed_of_the_papers_monte_carlo(benchmark):
    result = benchmark(dissipation, studies.paper(), 100)
    assert result.summaries["power"].mean == pytest.approx(studies.MEAN_POWER, rel=0.2)


@pytest.mark.slow
def test_rows_of_the_report_have_numbers():
    functions = [
        *TABLES["One contact"],
        *TABLES["Random inputs"],
        *TABLES["Whole tests, in-process, once compiled"],
    ]
    rows = [row for function in functions for row in function(QUICK)]
    assert all(row.seconds > 0.0 for row in rows)
    text = table.markdown("One contact", rows)
    assert "| case | measured | target | error |" in text
    assert "nan" not in text


def test_realisations_are_compared_to_single_passes():
    rows = ensembles.accuracy(quick=True)
    assert all(row.seconds > 0.0 for row in rows)
    assert "nan" not in table.markdown("accuracy", rows)


@pytest.mark.slow
def test_scatter_is_tabulated_by_persistence(monkeypatch):
    monkeypatch.setattr(persistence, "SINGLE_PASSES", 200)
    monkeypatch.setattr(persistence, "SINGLE_TESTS", 3)
    text = persistence.table(persistence.spreads(ensemble_cases.Size(4, 1500)), 1.35e6)
    assert text.count("\n| ") == 4
    assert "nan" not in text


def test_tables_of_models_contain_every_model():
    tables = []
    found = models.report(tables.append, share=0.0005, repetitions=1)
    assert [part.splitlines()[0][:3] for part in tables] == ["## "] * 3
    whole = tables[2].splitlines()[4:]
    rows = [line for line in whole if line.startswith("|")]
    assert len(rows) == len(models.normal_models())
    assert models.FAILED not in tables[2]
    drawn = found["Tangential theories on elliptic contacts"]
    assert all(label in drawn for label in models.TANGENTIAL)


def test_saved_tables_have_date_machine_and_cells(tmp_path):
    row = table.Row("a | b", 0.012, error="1 %")
    file = tmp_path / "saved" / "report.json"
    escaped = table.markdown("One", [row]).replace("a | b", r"a \| b")
    table.save_tables(file, "python -m x", {"One": escaped + "\nA note.\n"})
    saved = json.loads(file.read_text())
    assert saved["command"] == "python -m x"
    assert re.fullmatch(r"\d{4}-\d\d-\d\d", saved["machine"]["date"])
    assert saved["tables"]["One"] == {
        "columns": ["case", "measured", "target", "error"],
        "rows": [["a | b", "12 ms", "", "1 %"]],
        "notes": ["A note."],
    }


def test_facts_of_a_test_are_computed_once():
    scenario = wearsim.load_scenario(calls.SCENARIOS / f"{calls.CAM}.toml")
    found = calls.start_of(lambda: wearsim.run(scenario))
    assert found["pair of materials"] == 0  # it is known since the scenario was read
    assert found["turn of the cam"] == 1
    assert found["groove"] == 2  # in full and in partial slip
    # at the stations, and at two curvatures and the greatest load
    assert found["patch after Hertz"] <= turn_of(scenario).stations.count + 3
