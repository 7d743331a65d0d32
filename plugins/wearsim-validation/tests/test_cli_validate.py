"""The verb `wearsim validate`: output, cases of third parties, bad input."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

from wearsim_validation.files import SHIPPED

Command = Callable[..., Result]
CASE = "rolling-spheres"


def copied(folder: Path, name: str = CASE) -> Path:
    """Copy a shipped case and its files, as a third party would."""
    folder.mkdir(exist_ok=True)
    for file in (f"{name}.toml", f"{name}.csv", "sphere.csv"):
        (folder / file).write_bytes((SHIPPED / file).read_bytes())
    return folder / f"{name}.toml"


def test_list_names_the_cases(command: Command) -> None:
    result = command("validate", "--list")
    assert result.exit_code == 0
    assert [line.split()[0] for line in result.stdout.splitlines()] == sorted(
        path.stem for path in SHIPPED.glob("*.toml")
    )


def test_case_prints_table_and_verdict_and_writes_files(command: Command) -> None:
    result = command("validate", CASE, "-o", "out", "-q")
    assert result.exit_code == 0
    assert "0.657" in result.stdout
    assert "verdict: within the tolerance" in result.stdout
    assert (Path("out") / f"{CASE}.png").stat().st_size > 10_000
    data = json.loads((Path("out") / "validation.json").read_text())
    assert data["cases"][CASE]["verdict"] == "tolerance"
    assert data["command"] == f"wearsim validate {CASE}"
    heads = data["tables"][f"{CASE}: tractive force"]["columns"]
    assert heads[:3] == ["case", "published", "computed"]


def test_existing_files_are_kept_without_force(command: Command) -> None:
    Path("out").mkdir()
    Path("out/validation.json").write_text("kept")
    result = command("validate", CASE, "-o", "out")
    assert result.exit_code == 2
    assert Path("out/validation.json").read_text() == "kept"


def test_case_of_a_third_party_is_run_from_its_file(command: Command, tmp_path: Path) -> None:
    path = copied(tmp_path / "own")
    text = path.read_text().replace('model = "halfspace"\n', 'model = "hertz"\n')
    path.write_text(text.replace("tolerance = 0.02", "tolerance = 0.2"))
    result = command("validate", path, "--json", "-q")
    assert result.exit_code == 0
    assert json.loads(result.stdout)["cases"][CASE]["as_recorded"] is True


def test_exit_code_is_1_where_a_verdict_is_not_recorded(command: Command, tmp_path: Path) -> None:
    path = copied(tmp_path / "own")
    path.write_text(path.read_text().replace("tolerance = 0.02", "tolerance = 1e-6"))
    result = command("validate", path, "-q")
    assert result.exit_code == 1
    assert "verdict: not; recorded: within the tolerance" in result.stdout


def test_unknown_case_is_one_line(command: Command) -> None:
    result = command("validate", "rolling-sphere")
    assert result.exit_code == 2
    assert "did you mean 'rolling-spheres'?" in result.stderr


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('data = "', 'data = "no-', "No such file or directory"),
        ('kind = "contact"', 'kind = "race"', "kind: Input should be 'run', 'contact'"),
        ('published = "p0"', 'published = "p1"', "no column 'p1' in rolling-spheres.csv"),
        ('computed = "peak pressure"', 'computed = "colour"', "unknown quantity 'colour'"),
        ('normal_force = "0.4705 N"', 'normal_force = "0.4705"', "needs a unit"),
    ],
)
def test_mistake_in_a_case_is_one_line(
    command: Command, tmp_path: Path, old: str, new: str, message: str
) -> None:
    path = copied(tmp_path / "own")
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    result = command("validate", path, "-q")
    assert result.exit_code == 2
    lines = result.stderr.strip().splitlines()
    assert len(lines) == 1
    assert message in lines[0]
    assert str(tmp_path / "own") in lines[0]


def test_changed_published_values_are_refused(command: Command, tmp_path: Path) -> None:
    path = copied(tmp_path / "own")
    data = path.with_suffix(".csv")
    data.write_text(data.read_text().replace("0.657", "0.646"))
    result = command("validate", path, "-q")
    assert result.exit_code == 2
    assert "the published values have changed" in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


def test_quick_leaves_out_long_cases(command: Command, tmp_path: Path) -> None:
    path = copied(tmp_path / "own")
    path.write_text(path.read_text().replace("verdict =", "quick = false\nverdict ="))
    result = command("validate", path, "--quick", "--json")
    assert result.exit_code == 0
    assert json.loads(result.stdout)["cases"] == {}
