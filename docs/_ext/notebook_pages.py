"""IPython extension of the notebooks on the site: shell cells as in a terminal, figures as SVG."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

WIDTH = 10.5  # greatest width of a figure [in], so that its letters are readable on a page
SCENARIOS = Path(__file__).parents[2] / "scenarios"

# the kernel asks programs for colours and control codes, which pages do not show
FORCED = {"FORCE_COLOR", "CLICOLOR_FORCE", "CLICOLOR", "JPY_PARENT_PID"}


def run_shell(_line: str, cell: str) -> None:
    """Run the commands of a cell and print their output in one piece.

    Raises
    ------
    RuntimeError
        If a command fails.
    """
    kept = {name: value for name, value in os.environ.items() if name not in FORCED}
    done = subprocess.run(
        ["sh", "-e", "-c", cell],
        env={**kept, "COLUMNS": "88", "TERM": "dumb", "NO_COLOR": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    print("\n".join(line.rstrip() for line in done.stdout.splitlines()))  # noqa: T201
    if done.returncode:
        raise RuntimeError(f"exit status {done.returncode}: {cell}")


def load_ipython_extension(shell: Any) -> None:
    """Register `%%sh`, show figures as SVG, and copy the scenarios next to the notebook."""
    shell.register_magic_function(run_shell, "cell", "sh")
    shell.run_line_magic("matplotlib", "inline")
    shell.run_line_magic("config", "InlineBackend.figure_formats = ['svg']")
    formatter = shell.display_formatter.formatters["image/svg+xml"]
    drawn = formatter.lookup_by_type(Figure)

    def draw(figure: Figure) -> str:
        factor = min(1.0, WIDTH / figure.get_figwidth())
        figure.set_size_inches(factor * figure.get_size_inches())
        text: str = drawn(figure)
        return text

    formatter.for_type(Figure, draw)
    shutil.copytree(SCENARIOS, SCENARIOS.name, dirs_exist_ok=True)
