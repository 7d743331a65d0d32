"""Topic `growth`: studies in separate processes, orders of time, memory."""

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from wearsim.errors import ContactError
from wearsim.plugins import manager
from wearsim_bench.growth import point as growth_point, topic as growth_module
from wearsim_bench.growth.cases import QUICK, RIG, STRIPS, Point, points, same_groove
from wearsim_bench.growth.point import Cost, Workload
from wearsim_bench.growth.topic import growth, measured, measurements
from wearsim_bench.measure.measurement import Effort
from wearsim_bench.measure.memory import family_peak_bytes, peak_bytes

TINY = Path(__file__).parents[3] / "tests" / "plugins" / "data" / "tiny"
SHORT = {"operation.passes": 200, "contact.strips": 21, "outputs.records": 1}
MEGABYTES = 1_000_000


def cost(seconds, depth=1.0):
    return Cost(seconds, 3 * MEGABYTES, MEGABYTES, 100, depth, stated=1e-3)


def point(size):
    return Point(STRIPS, "slender", f"{size} strips", size, "slender", Workload(RIG, {}))


def test_orders_are_slopes_between_neighbours():
    sizes = (10, 20, 80)
    costs = [cost(1e-6 * size**2) for size in sizes]
    rows = measurements([point(size) for size in sizes], costs, {"slender": 1.25})
    assert "order" not in rows[0].counts
    assert [row.counts["order"] for row in rows[1:]] == pytest.approx([2.0, 2.0])
    assert [row.errors["depth"] for row in rows] == pytest.approx([0.2, 0.2, 0.2])
    assert rows[0].counts["peak_bytes"] == 3 * MEGABYTES


def test_failed_study_is_reported_and_skipped():
    sizes = (10, 20, 40)
    costs = [cost(1.0), "took longer than 120 s", cost(16.0)]
    rows = measurements([point(size) for size in sizes], costs, {})
    assert [row.failed for row in rows] == ["", "took longer than 120 s", ""]
    assert rows[2].counts["order"] == pytest.approx(2.0)
    assert set(rows[2].errors) == {"stated"}


def test_errors_of_a_study_are_written(monkeypatch):
    output = []
    for error in (ContactError("no contact\nmore"), TypeError("no number")):

        def fail(work, error=error):
            raise error

        monkeypatch.setattr(growth_point, "cost_of", fail)
        growth_point.main(['{"scenario": "rig-450min", "changes": {}}'], output.append)
    assert output == ['{"failed": "no contact"}', '{"failed": "raised TypeError: no number"}']


def test_unknown_model_is_reported():
    assert "no-such" in measured(Workload(RIG, {"contact.model": "no-such"}))


def test_process_without_a_result_has_failed(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(growth_module, "POINT", "point_of_a_plugin")
    for script in ("", "import sys; open(sys.argv[2], 'w').write('{')", "print('{}')"):
        (tmp_path / "point_of_a_plugin.py").write_text(script)
        assert measured(Workload(RIG, {})).startswith("ended without a result")


def test_nan_depth_has_failed():
    (row,) = measurements([point(10)], [cost(1.0, depth=math.nan)], {"slender": 1.0})
    assert row.failed == "the error 'depth' is nan, not finite"
    assert not row.errors


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="peaks are read from /proc")
def test_peak_excludes_the_parent_process():
    script = (
        "import sys, numpy as np; from wearsim_bench.measure.memory import peak_bytes;"
        "before = peak_bytes(); np.ones(int(sys.argv[1]), dtype=np.int8);"
        "print(before, peak_bytes())"
    )
    ours = np.ones(300 * MEGABYTES, dtype=np.int8)  # not counted for the child
    assert peak_bytes() > ours.nbytes
    command = [sys.executable, "-c", script, str(200 * MEGABYTES)]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    before, after = (int(word) for word in output.split())
    assert before < 200 * MEGABYTES
    # memory freed before is reused first
    assert 150 * MEGABYTES < after - before < 250 * MEGABYTES


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="peaks are read from /proc")
def test_family_peak_includes_children():
    alone = family_peak_bytes(1)
    allocation = "array = np.ones(100_000_000, dtype=np.int8)"
    script = f"import numpy as np; {allocation}; print(flush=True); input()"
    command = [sys.executable, "-c", script]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        child.stdout.readline()
        together = family_peak_bytes(1)
        child.communicate(b"\n")
    assert together - alone > 80 * MEGABYTES


def test_all_numbers_of_passes_wear_the_same_groove():
    few, many = (Workload(RIG, same_groove(count)).scenario_with() for count in (10**4, 10**9))
    for scenario in (few, many):
        law = scenario.wear.built
        worn = law.depth_per_dissipation("cylinder", 1.0) * scenario.total_passes
        assert worn == pytest.approx(1.1e-11 * 1_350_000)


def test_plugin_option_adds_a_model_to_the_default(monkeypatch):
    monkeypatch.syspath_prepend(TINY)
    manager.registry.cache_clear()
    try:
        methods = {item.method for item in points(QUICK, Effort(quick=True, plugin="foundation"))}
        assert {"slender", "foundation"} <= methods
        cost = measured(Workload(RIG, {"contact.model": "foundation", **SHORT}))
    finally:
        monkeypatch.undo()
        manager.registry.cache_clear()
    assert isinstance(cost, Cost), cost
    assert cost.depth > 0.0


@pytest.mark.slow
def test_all_sizes_are_measured():
    progress = []
    topic = growth(Effort(quick=True, repetitions=1), lambda what, part: progress.append(part))
    assert topic.groups == ["strips", "passes", "recorded profiles", "realisations", "workers"]
    assert progress == sorted(progress)
    assert progress[-1] == 1.0
    for row in topic.measurements:
        assert row.failed == ""
        assert row.seconds > 0.0
        assert row.counts["file_bytes"] > 0.0
        assert 0.0 < row.errors["stated"] < 0.05  # with few strips
    # single tests have a reference with individually solved passes, in which a strip carries load
    # as a whole at the edge: it differs by the error due to the strips
    for group in topic.groups[:3]:
        for row in topic.of(group):
            assert 0.0 <= row.errors["depth"] < 2e-3 + row.errors["stated"]
    assert any(row.default for row in topic.of("strips"))
