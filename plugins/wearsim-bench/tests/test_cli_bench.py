"""`wearsim bench`: what it measures, what it writes, what it refuses."""

import json
import sys
from types import SimpleNamespace

import pytest

from wearsim_bench.hard_cases import topic as hard
from wearsim_bench.hard_cases.verdict import Check, Verdict
from wearsim_bench.measure.measurement import Measurement, Topic
from wearsim_bench.stepping import topic as stepping

pytestmark = pytest.mark.bench


def made_up(name):
    def measure(effort, tell):
        tell("something", 0.5)
        error = 0.5 if effort.quick else 0.01
        items = (
            Measurement("group", "method", "coarse", 1e-3, {"depth": error}),
            Measurement("group", "method", "fine", 1e-2, {"depth": 0.1 * error}, default=True),
            Measurement("group", str(effort.plugin), "coarse", 2e-3, {"depth": 2.0 * error}),
        )
        heads = {"depth": "depth, error"}
        return Topic(name, f"About {name}", "How.", "one test", "depth", heads, {}, items)

    return measure


@pytest.fixture
def quick_topics(monkeypatch):
    """Topics that take no time."""
    monkeypatch.setitem(
        sys.modules, "wearsim_bench.growth.topic", SimpleNamespace(growth=made_up("growth"))
    )
    monkeypatch.setattr(stepping, "stepping", made_up("stepping"))


@pytest.mark.usefixtures("quick_topics")
def test_that_a_topic_is_shown_and_kept(command, tmp_path):
    told = command("bench", "growth", "-o", "found", "--quick", "-q")
    assert told.exit_code == 0, told.output
    assert "About growth" in told.stdout
    assert "one yardstick is" in " ".join(told.stdout.split())
    assert "50 %" in told.stdout
    folder = tmp_path / "found"
    names = {path.name for path in folder.iterdir()}
    assert names == {"growth.json", "growth.md", "growth.png"}
    kept = json.loads((folder / "growth.json").read_text())
    assert kept["effort"] == {"quick": True, "repetitions": 1, "plugin": None}
    assert kept["machine"]["yardstick"] > 0.0
    assert [row["front"] for row in kept["measurements"]] == [True, True, False]
    assert "| method | fine | 10 ms |" in (folder / "growth.md").read_text()


@pytest.mark.usefixtures("quick_topics")
def test_that_json_is_one_object_and_nothing_else(command):
    told = command("bench", "growth", "stepping", "--json", "-q")
    found = json.loads(told.stdout)
    assert set(found) == {"machine", "effort", "growth", "stepping", "files"}
    assert len(found["files"]) == 6


@pytest.mark.usefixtures("quick_topics")
def test_that_nothing_is_overwritten_unless_asked(command):
    assert command("bench", "growth", "-q").exit_code == 0
    refused = command("bench", "growth", "-q")
    assert refused.exit_code == 2
    assert "bench/growth.json exists" in refused.stderr
    assert command("bench", "stepping", "-q").exit_code == 0
    assert command("bench", "growth", "-q", "--force").exit_code == 0


@pytest.mark.usefixtures("quick_topics")
def test_that_one_model_is_measured_where_models_are(command, monkeypatch):
    asked = []
    monkeypatch.setattr(
        "wearsim_bench.contact.topic.contact",
        lambda effort, tell: asked.append(effort.plugin) or made_up("contact")(effort, tell),
    )
    told = command("bench", "--plugin", "hertz", "-q", "-o", "hertz")
    assert told.exit_code == 0, told.output
    assert asked == ["hertz"]
    assert "About stepping" in told.stdout
    unknown = command("bench", "--plugin", "sponge", "-q")
    assert unknown.exit_code == 2
    assert "'sponge' is no contact model" in unknown.stderr
    wrong = command("bench", "sampling", "--plugin", "hertz", "-q")
    assert wrong.exit_code == 2
    assert "sampling does not measure contact models" in wrong.stderr


@pytest.mark.usefixtures("quick_topics")
def test_that_what_stands_in_the_way_is_told_before_anything_is_measured(command, tmp_path):
    (tmp_path / "taken").write_text("")
    told = command("bench", "growth", "-q", "-o", "taken")
    assert told.exit_code == 2
    assert "taken is a file; name a folder" in " ".join(told.stderr.split())
    (tmp_path / "bench" / "growth.png").mkdir(parents=True)
    told = command("bench", "growth", "-q", "--force")
    assert told.exit_code == 2
    assert "growth.png is a folder" in " ".join(told.stderr.split())


@pytest.mark.usefixtures("quick_topics")
def test_that_what_was_finished_is_kept_when_the_rest_is_not(command, monkeypatch, tmp_path):
    def interrupted(effort, tell):
        raise KeyboardInterrupt

    monkeypatch.setattr(stepping, "stepping", interrupted)
    told = command("bench", "growth", "stepping", "-q")
    assert told.exit_code == 130
    assert "written: bench/growth.png" in told.stderr
    assert {path.stem for path in (tmp_path / "bench").iterdir()} == {"growth"}


@pytest.mark.parametrize(("value", "code"), [(1e-12, 0), (1e-2, 1)])
def test_that_hard_cases_are_judged_and_tell_by_the_exit_code(
    command, monkeypatch, tmp_path, value, code
):
    verdict = Verdict("a groove with a step", checks=(Check("volume", value, 1e-9),))
    refused = Verdict("tilted off", said="tilted off.toml: does not fit")
    monkeypatch.setattr(hard, "hard", lambda effort, tell: (verdict, refused))
    told = command("bench", "--hard", "-q")
    assert told.exit_code == code
    assert f"{2 - code} of 2 hold" in told.stdout
    assert "a groove with a step" in (tmp_path / "bench" / "hard.md").read_text()
    kept = json.loads((tmp_path / "bench" / "hard.json").read_text())
    assert [case["holds"] for case in kept["cases"]] == [code == 0, True]
    assert {path.name for path in (tmp_path / "bench").iterdir()} == {"hard.md", "hard.json"}
