"""What is loaded when: slow libraries only where they are needed."""

from __future__ import annotations

import subprocess
import sys

import pytest

SLOW = {"numpy", "numba", "h5py", "pint", "pydantic", "matplotlib", "scipy"}
HELP = """
import contextlib, io, sys
from wearsim.cli.app import app
with contextlib.redirect_stdout(io.StringIO()) as told, contextlib.suppress(SystemExit):
    app({arguments!r}, prog_name="wearsim")
assert "wearsim" in told.getvalue(), told.getvalue()
"""


def modules_after(code: str) -> set[str]:
    """Return the top-level modules loaded by `code` in a process of its own."""
    tail = "\nimport sys\nsys.stderr.write('\\n'.join({n.split('.')[0] for n in sys.modules}))"
    done = subprocess.run(
        [sys.executable, "-c", code + tail], capture_output=True, text=True, check=True
    )
    return set(done.stderr.split("\n"))


def test_that_importing_wearsim_loads_nothing_slow():
    assert not modules_after("import wearsim") & (SLOW | {"typer", "rich", "pluggy"})


def test_that_its_names_are_known_before_they_are_loaded():
    assert not modules_after("import wearsim\nassert 'run' in dir(wearsim)") & SLOW


def test_that_a_name_is_loaded_when_it_is_used():
    assert modules_after("import wearsim\nwearsim.load_scenario") >= {"pydantic", "numpy"}


@pytest.mark.parametrize("arguments", [["--help"], ["--version"]], ids=" ".join)
def test_that_help_loads_nothing_slow(arguments: list[str]):
    assert not modules_after(HELP.format(arguments=arguments)) & SLOW


@pytest.mark.parametrize("verb", ["check", "run", "resume", "show", "plot"])
def test_that_the_help_of_a_verb_loads_nothing_slow(verb: str):
    # typer itself loads pydantic to read the type of some parameters
    loaded = modules_after(HELP.format(arguments=[verb, "--help"]))
    assert not loaded & (SLOW - {"pydantic"})


def test_that_reading_a_results_file_loads_no_compiler():
    assert "numba" not in modules_after("import wearsim\nwearsim.open_results")


def test_that_reading_a_scenario_loads_no_plotting():
    assert not modules_after("import wearsim\nwearsim.load_scenario\nwearsim.run") & {
        "matplotlib",
        "typer",
        "rich",
    }


def test_that_the_command_and_the_module_are_the_same():
    told = [
        subprocess.run(command, capture_output=True, text=True, check=True).stdout
        for command in (
            [sys.executable, "-m", "wearsim", "--help"],
            [sys.executable, "-c", "from wearsim.cli.app import main; main()", "--help"],
        )
    ]
    assert told[0] == told[1]
    assert "Usage: wearsim" in told[0]
