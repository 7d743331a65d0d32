"""How time and memory grow: points in processes of their own, and the orders between them."""

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from wearsim.errors import ContactError
from wearsim.plugins import manager
from wearsim_bench.growth import point as growth_point
from wearsim_bench.growth import topic as growth_module
from wearsim_bench.growth.cases import QUICK, RIG, STRIPS, Point, points, same_groove
from wearsim_bench.growth.point import Cost, Work
from wearsim_bench.growth.topic import growth, measured, measurements
from wearsim_bench.measure.measurement import Effort
from wearsim_bench.measure.memory import family_peak_bytes, peak_bytes

pytestmark = pytest.mark.bench

TINY = Path(__file__).parents[3] / "tests" / "plugins" / "data" / "tiny"
SHORT = {"operation.passes": 200, "contact.strips": 21, "outputs.records": 1}
MEGABYTES = 1_000_000


def cost(seconds, depth=1.0):
    return Cost(seconds, 3 * MEGABYTES, MEGABYTES, 100, depth, stated=1e-3)


def point(size):
    return Point(STRIPS, "slender", f"{size} strips", size, "slender", Work(RIG, {}))


def test_that_orders_are_slopes_between_neighbours():
    sizes = (10, 20, 80)
    costs = [cost(1e-6 * size**2) for size in sizes]
    rows = measurements([point(size) for size in sizes], costs, {"slender": 1.25})
    assert "order" not in rows[0].counts
    assert [row.counts["order"] for row in rows[1:]] == pytest.approx([2.0, 2.0])
    assert [row.errors["depth"] for row in rows] == pytest.approx([0.2, 0.2, 0.2])
    assert rows[0].counts["peak_bytes"] == 3 * MEGABYTES


def test_that_a_point_which_fails_is_told_and_passed_over():
    sizes = (10, 20, 40)
    found = [cost(1.0), "took longer than 120 s", cost(16.0)]
    rows = measurements([point(size) for size in sizes], found, {})
    assert [row.failed for row in rows] == ["", "took longer than 120 s", ""]
    assert rows[2].counts["order"] == pytest.approx(2.0)
    assert set(rows[2].errors) == {"stated"}


def test_that_what_is_raised_in_a_point_is_told(monkeypatch):
    told = []
    for error in (ContactError("no contact\nmore"), TypeError("no number")):

        def fail(work, error=error):
            raise error

        monkeypatch.setattr(growth_point, "cost_of", fail)
        growth_point.main(['{"scenario": "rig-450min", "changes": {}}'], told.append)
    assert told == ['{"failed": "no contact"}', '{"failed": "raised TypeError: no number"}']


def test_that_a_model_which_is_not_there_is_told():
    assert "no-such" in measured(Work(RIG, {"contact.model": "no-such"}))


def test_that_a_process_that_gives_no_answer_has_failed(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(growth_module, "POINT", "point_of_a_plugin")
    for script in ("", "import sys; open(sys.argv[2], 'w').write('{')", "print('{}')"):
        (tmp_path / "point_of_a_plugin.py").write_text(script)
        assert measured(Work(RIG, {})).startswith("ended without an answer")


def test_that_a_depth_that_is_no_number_has_failed():
    (row,) = measurements([point(10)], [cost(1.0, depth=math.nan)], {"slender": 1.0})
    assert row.failed == "its error 'depth' is nan, not finite"
    assert not row.errors


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="peaks are read from /proc")
def test_that_a_peak_is_that_of_the_process_alone():
    script = (
        "import sys, numpy as np; from wearsim_bench.measure.memory import peak_bytes;"
        "before = peak_bytes(); np.ones(int(sys.argv[1]), dtype=np.int8);"
        "print(before, peak_bytes())"
    )
    ours = np.ones(300 * MEGABYTES, dtype=np.int8)  # which a child must not be charged with
    assert peak_bytes() > ours.nbytes
    command = [sys.executable, "-c", script, str(200 * MEGABYTES)]
    told = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    before, after = (int(word) for word in told.split())
    assert before < 200 * MEGABYTES
    # what was freed before is filled again first
    assert 150 * MEGABYTES < after - before < 250 * MEGABYTES


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="peaks are read from /proc")
def test_that_the_peak_of_a_family_holds_its_children():
    alone = family_peak_bytes(1)
    held = "held = np.ones(100_000_000, dtype=np.int8)"
    script = f"import numpy as np; {held}; print(flush=True); input()"
    command = [sys.executable, "-c", script]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        child.stdout.readline()
        together = family_peak_bytes(1)
        child.communicate(b"\n")
    assert together - alone > 80 * MEGABYTES


def test_that_any_number_of_passes_leaves_the_same_groove():
    few, many = (Work(RIG, same_groove(count)).asked() for count in (10**4, 10**9))
    for scenario in (few, many):
        law = scenario.wear.build()
        worn = law.depth_per_dissipation("cylinder", 1.0) * scenario.total_passes
        assert worn == pytest.approx(1.1e-11 * 1_350_000)


def test_that_a_plugin_is_measured_beside_the_default(monkeypatch):
    monkeypatch.syspath_prepend(TINY)
    manager.registry.cache_clear()
    try:
        methods = {item.method for item in points(QUICK, Effort(quick=True, plugin="foundation"))}
        assert {"slender", "foundation"} <= methods
        found = measured(Work(RIG, {"contact.model": "foundation", **SHORT}))
    finally:
        monkeypatch.undo()
        manager.registry.cache_clear()
    assert isinstance(found, Cost), found
    assert found.depth > 0.0


@pytest.mark.slow
def test_that_all_that_grows_is_measured():
    told = []
    topic = growth(Effort(quick=True, repetitions=1), lambda what, part: told.append(part))
    assert topic.groups == ["strips", "passes", "recorded profiles", "realisations", "workers"]
    assert told == sorted(told)
    assert told[-1] == 1.0
    for row in topic.measurements:
        assert row.failed == ""
        assert row.seconds > 0.0
        assert row.counts["file_bytes"] > 0.0
        assert 0.0 < row.errors["stated"] < 0.01
    # of single tests the truth is known, every pass solved by itself
    for group in topic.groups[:3]:
        assert all(0.0 <= row.errors["depth"] < 2e-3 for row in topic.of(group))
    assert any(row.default for row in topic.of("strips"))
