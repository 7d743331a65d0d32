"""The verb report."""

import sys
from pathlib import Path

import pytest
from cli_examples import Command


def test_report_writes_a_page_and_keeps_existing_files(command: Command, finished: Path) -> None:
    Path("trace.csv").write_text("y [mm],depth [um]\n-1,0\n0,2\n1,0\n")
    done = command("report", finished, "--measured", "trace.csv")
    assert done.exit_code == 0
    assert "page: short.html" in done.stderr
    page = Path("short.html").read_text(encoding="utf-8")
    assert "measured: trace" in page
    assert "residual rms" in page
    again = command("report", finished)
    assert again.exit_code == 2
    assert "short.html" in again.stderr
    assert Path("short.html").read_text(encoding="utf-8") == page
    assert command("report", finished, "--force").exit_code == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("none.h5",), "none.h5: there is no such file"),
        (
            ("short.h5", "-o", "page.pdf"),
            "'page.pdf' has no known format of a page, expected .html",
        ),
        (("short.h5", "-o", "nowhere/page.html"), "folder nowhere does not exist"),
    ],
)
def test_report_refuses_what_it_cannot_write(
    command: Command, finished: Path, arguments: tuple[str, ...], message: str
) -> None:
    result = command("report", *arguments)
    assert result.exit_code == 2
    assert message in result.stderr


def test_report_without_its_extra_says_how_to_install_it(
    command: Command, finished: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "bokeh.embed", None)
    result = command("report", finished)
    assert result.exit_code == 2
    assert "pip install 'wearsim[report]'" in result.stderr
    assert not Path("short.html").exists()
