"""Command `wearsim bench`: output, files and refused arguments."""

import json
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from wearsim_bench.hard_cases import topic as hard
from wearsim_bench.hard_cases.verdict import Criterion, Verdict
from wearsim_bench.measure.measurement import Measurement, Topic
from wearsim_bench.stepping import topic as stepping


def artificial(name):
    def measure(effort, on_progress):
        on_progress("something", 0.5)
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
    """Replace slow topics."""
    monkeypatch.setitem(
        sys.modules, "wearsim_bench.growth.topic", SimpleNamespace(growth=artificial("growth"))
    )
    monkeypatch.setattr(stepping, "stepping", artificial("stepping"))


@pytest.mark.usefixtures("quick_topics")
def test_topic_is_printed_and_saved(command, tmp_path):
    result = command("bench", "growth", "-o", "results", "--quick", "-q")
    assert result.exit_code == 0, result.output
    assert "About growth" in result.stdout
    assert "one yardstick is" in " ".join(result.stdout.split())
    assert "50 %" in result.stdout
    folder = tmp_path / "results"
    names = {path.name for path in folder.iterdir()}
    assert names == {"growth.json", "growth.md", "growth.png"}
    saved = json.loads((folder / "growth.json").read_text())
    effort = {"quick": True, "repetitions": 1, "plugin": None, "against": None}
    assert saved["effort"] == effort
    assert saved["machine"]["yardstick"] > 0.0
    assert [row["front"] for row in saved["measurements"]] == [True, True, False]
    assert "| method | fine | 10 ms |" in (folder / "growth.md").read_text()


@pytest.mark.usefixtures("quick_topics")
def test_json_is_one_object(command):
    result = command("bench", "growth", "stepping", "--json", "-q")
    data = json.loads(result.stdout)
    assert set(data) == {"machine", "effort", "growth", "stepping", "files"}
    assert len(data["files"]) == 6


@pytest.mark.usefixtures("quick_topics")
def test_files_are_overwritten_only_with_force(command):
    assert command("bench", "growth", "-q").exit_code == 0
    refused = command("bench", "growth", "-q")
    assert refused.exit_code == 2
    assert "bench/growth.json exists" in refused.stderr
    assert command("bench", "stepping", "-q").exit_code == 0
    assert command("bench", "growth", "-q", "--force").exit_code == 0


def test_options_of_random_tests_reach_their_topic(command, monkeypatch, tmp_path):
    options = []

    def measure(effort, on_progress, **given):
        options.append(given)
        topic = artificial("stated-errors")(effort, on_progress)
        return replace(topic, files={"1-0.toml": 'title = "missed"'})

    monkeypatch.setattr("wearsim_bench.stated_errors.topic.stated_errors", measure)
    topic = "bench", "stated-errors", "-q"
    assert (
        command(*topic, "--tests", 7, "--seed", 2, "--references", "kept", "-j", 2).exit_code == 0
    )
    assert command(*topic, "--force").exit_code == 0
    assert options == [{"number": 7, "seed": 2, "references": Path("kept"), "jobs": 2}, {}]
    written = tmp_path / "bench" / "stated-errors" / "1-0.toml"
    assert written.read_text() == 'title = "missed"'
    assert (tmp_path / "bench" / "stated-errors.json").exists()
    refused = command("bench", "growth", "--seed", 2, "-q")
    assert refused.exit_code == 2
    assert "applies to the topics stated-errors and random" in " ".join(refused.stderr.split())
    refused = command("bench", "random", "--references", "kept", "-q")
    assert refused.exit_code == 2
    assert "applies to the topic stated-errors" in " ".join(refused.stderr.split())


@pytest.mark.usefixtures("quick_topics")
def test_plugin_option_selects_topics_of_models(command, monkeypatch):
    plugins = []
    monkeypatch.setattr(
        "wearsim_bench.contact.topic.contact",
        lambda effort, on_progress: (
            plugins.append(effort.plugin) or artificial("contact")(effort, on_progress)
        ),
    )
    result = command("bench", "--plugin", "hertz", "-q", "-o", "hertz")
    assert result.exit_code == 0, result.output
    assert plugins == ["hertz"]
    assert "About stepping" in result.stdout
    unknown = command("bench", "--plugin", "sponge", "-q")
    assert unknown.exit_code == 2
    assert "no installed contact model is named 'sponge'" in unknown.stderr
    wrong = command("bench", "sampling", "--plugin", "hertz", "-q")
    assert wrong.exit_code == 2
    assert "sampling does not measure contact models" in wrong.stderr


@pytest.mark.usefixtures("quick_topics")
def test_unusable_paths_are_refused_first(command, tmp_path):
    (tmp_path / "taken").write_text("")
    result = command("bench", "growth", "-q", "-o", "taken")
    assert result.exit_code == 2
    assert "taken is a file; name a folder" in " ".join(result.stderr.split())
    (tmp_path / "bench" / "growth.png").mkdir(parents=True)
    result = command("bench", "growth", "-q", "--force")
    assert result.exit_code == 2
    assert "growth.png is a folder" in " ".join(result.stderr.split())


@pytest.mark.usefixtures("quick_topics")
def test_completed_topics_are_saved_on_interruption(command, monkeypatch, tmp_path):
    def interrupted(effort, on_progress):
        raise KeyboardInterrupt

    monkeypatch.setattr(stepping, "stepping", interrupted)
    result = command("bench", "growth", "stepping", "-q")
    assert result.exit_code == 130
    assert "written: bench/growth.png" in result.stderr
    assert {path.stem for path in (tmp_path / "bench").iterdir()} == {"growth"}


@pytest.mark.parametrize(("value", "code"), [(1e-12, 0), (1e-2, 1)])
def test_hard_cases_set_the_exit_code(command, monkeypatch, tmp_path, value, code):
    verdict = Verdict("a groove with a step", criteria=(Criterion("volume", value, 1e-9),))
    refused = Verdict("tilted off", error="tilted off.toml: does not fit")
    monkeypatch.setattr(hard, "hard", lambda effort, on_progress: (verdict, refused))
    result = command("bench", "--hard", "-q")
    assert result.exit_code == code
    assert f"{2 - code} of 2 pass" in result.stdout
    assert "a groove with a step" in (tmp_path / "bench" / "hard.md").read_text()
    saved = json.loads((tmp_path / "bench" / "hard.json").read_text())
    assert [case["holds"] for case in saved["cases"]] == [code == 0, True]
    assert {path.name for path in (tmp_path / "bench").iterdir()} == {"hard.md", "hard.json"}
