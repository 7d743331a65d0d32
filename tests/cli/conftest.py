"""Fixtures of the command line: an in-process command, a short scenario, a finished run."""

from __future__ import annotations

from pathlib import Path

import pytest
from cli_examples import SHORT, Command
from matplotlib.figure import Figure
from typer.testing import CliRunner, Result

from wearsim.cli.app import app
from wearsim.report import figures


@pytest.fixture(autouse=True)
def quick_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let texts of coarse figures overlap, as a layout takes most of the time.

    Layouts and full sizes are in tests/report.
    """
    monkeypatch.setattr(figures, "DPI", 60)
    monkeypatch.setattr(Figure, "get_layout_engine", lambda figure: None)


@pytest.fixture
def unwritten_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Write an empty file for each figure, for tests of the printed output only."""
    monkeypatch.setattr(figures, "save_figure", lambda figure, path: path.touch())


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    """Run `wearsim` with arguments in an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("WEARSIM_TRACEBACK", raising=False)

    def run(*args: object) -> Result:
        return CliRunner().invoke(app, [str(arg) for arg in args])

    return run


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    """A short scenario."""
    path = tmp_path / "short.toml"
    path.write_text(SHORT)
    return path


@pytest.fixture(scope="session")
def finished_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("finished")
    (folder / "short.toml").write_text(SHORT)
    result = CliRunner().invoke(
        app, ["run", str(folder / "short.toml"), "-o", str(folder / "short.h5"), "-q"]
    )
    assert result.exit_code == 0, result.output
    return folder / "short.h5"


@pytest.fixture
def finished(finished_once: Path, tmp_path: Path) -> Path:
    """A copy of the results file of a finished run."""
    path = tmp_path / "short.h5"
    path.write_bytes(finished_once.read_bytes())
    return path
