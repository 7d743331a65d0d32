"""Runs that end where the contact models are not valid, and implausible limits of runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from study_examples import after, run_differences, short

from wearsim.errors import Interrupted, ScenarioError, StepError
from wearsim.scenario import Scenario
from wearsim.studies import schedule
from wearsim.studies.opening import open_results
from wearsim.studies.run import run as studies

RADIUS = 20e-3  # of the rig's roller


def deep(**overrides: object) -> Scenario:
    """Return the rig with a wear factor for a groove deeper than two millimetres."""
    factor = {"wear.cylinder.k_over_h": "1e-6 1/Pa", "contact.width": "120 mm"}
    return short(**{"evolution.tolerance": 0.01, **factor, **overrides})


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "deep.h5"


def test_run_ends_at_a_tenth_of_the_radius_and_keeps_its_results(path: Path) -> None:
    with pytest.raises(StepError, match=r"exceeds a tenth of roller.radius = 20 mm.*allow_deep"):
        studies.run(deep(), path)
    kept = open_results(path)
    assert kept.depth[-1] > 0.1 * RADIUS >= kept.depth[-2]
    assert not kept.finished
    assert "exceeds a tenth" in kept.failure


def test_deep_run_is_resumed_as_if_it_had_been_allowed(path: Path) -> None:
    with pytest.raises(StepError):
        studies.run(deep(), path)
    with pytest.raises(StepError, match="exceeds a tenth"):
        studies.resume(path)
    resumed = studies.resume(path, allow_deep=True)
    allowed = studies.run(deep(evolution__allow_deep=True))
    assert resumed.finished
    for name, values in allowed.raw.history.items():
        np.testing.assert_array_equal(resumed.raw.history[name], values)
    for name, values in allowed.raw.records.items():
        np.testing.assert_array_equal(resumed.raw.records[name], values)


@pytest.mark.parametrize(
    ("limit", "message"),
    [
        ("depth 30 mm", "beyond the validity .* got depth 30 mm, expected at most 2 mm"),
        ("clearance 2.1 mm", "expected at most 2 mm"),
        ("width 100 mm", "expected at most 89.44 mm, a groove of a depth of 2 mm"),
        ("volume 9000 mm^3", "is not reached in 1024 times the test"),
        ("peak pressure 90 GPa", "is far above the pressures of the test"),
        ("peak pressure 200 MPa", "where the test would end at once"),
    ],
)
def test_implausible_limit_is_refused_before_the_run(limit: str, message: str, path: Path) -> None:
    with pytest.raises(ScenarioError, match=message):
        studies.run(short(contact__width="90 mm", contact__strips=401), path, until=limit)
    assert not path.exists()


def test_limit_far_beyond_the_test_gives_a_warning() -> None:
    wide = short(contact__width="12 mm", evolution__tolerance=0.01)
    result = studies.run(wide, until="depth 5 um")
    (text,) = (text for text in result.warnings if text.startswith("until"))
    times = float(text.split(" times")[0].rsplit(" ", 1)[1])
    assert 0.5 <= times / (result.passes[-1] / wide.total_passes) <= 2.0


def test_records_of_a_prolonged_run_are_thinned_and_resumed(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(schedule, "MOST_RECORDS", 10)
    scenario = short(evolution__tolerance=0.02, contact__width="8 mm")
    studies.run(scenario, path)
    other = tmp_path / "other.h5"
    other.write_bytes(path.read_bytes())
    unbroken = studies.resume(path, until=1000.0)
    # 1500 passes at first, 6000 after 30 000 passes; the end is always recorded
    assert unbroken.record_passes.tolist() == [*range(0, 50_000, 6000), 50_000]
    left = 0
    while not open_results(other).finished or left == 0:
        left += 1
        try:
            studies.resume(other, until=1000.0, stop_requested=after(2))
        except Interrupted:
            continue
    assert left > 3
    assert run_differences(open_results(other), unbroken) == []
