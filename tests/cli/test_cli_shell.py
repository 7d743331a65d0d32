import os
import subprocess
import sys
from importlib.metadata import entry_points, version

import pytest
from cli_examples import Command

import wearsim.cli.commands.scenarios
from wearsim.cli.app import BUILT_IN
from wearsim.errors import CapabilityError, PluginError, ResultsFileError, SolverError

VERBS = [
    *("check", "contact", "dissipation", "run", "ensemble", "resume", "show", "plot", "compare"),
    *("export", "maxent", "plugins", "schema", "new"),
]
INSTALLED = sorted(point.name for point in entry_points(group="wearsim.commands"))


def python(*args: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "0"}
    return subprocess.run(
        [sys.executable, *args], capture_output=True, text=True, check=False, env=environment
    )


def test_help_lists_every_verb(command: Command) -> None:
    result = command("--help")
    assert result.exit_code == 0
    listed = [line.split()[0] for line in result.stdout.splitlines() if line.startswith("  ")]
    assert [word for word in listed if word in [*VERBS, *INSTALLED]] == [*VERBS, *INSTALLED]


@pytest.mark.parametrize("verb", [*VERBS, *INSTALLED])
def test_every_verb_has_help(command: Command, verb: str) -> None:
    result = command(verb, "--help")
    assert result.exit_code == 0
    assert "Parameters" not in result.stdout
    assert f"wearsim {verb}" in result.stdout or "Usage:" in result.stdout


def test_version_is_that_of_the_distribution(command: Command) -> None:
    result = command("--version")
    assert (result.exit_code, result.stdout) == (0, f"wearsim {version('wearsim')}\n")


def test_help_imports_no_heavy_library() -> None:
    heavy = [
        "numpy",
        "scipy",
        "numba",
        "pydantic",
        "pint",
        "h5py",
        "matplotlib",
        "pluggy",
        "tomlkit",
    ]
    code = (
        "import sys\nfrom wearsim.cli.app import main\nsys.argv = ['wearsim', '--help']\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        f"print('HEAVY', [name for name in {heavy} if name in sys.modules])"
    )
    assert python("-c", code).stdout.splitlines()[-1] == "HEAVY []"


def test_python_m_wearsim_is_the_same_command() -> None:
    done = python("-m", "wearsim", "--version")
    assert (done.returncode, done.stdout) == (0, f"wearsim {version('wearsim')}\n")


@pytest.mark.parametrize("arguments", [["bogus"], ["run"], ["run", "a.toml", "--nonsense"]])
def test_wrong_usage_is_bad_input(command: Command, arguments: list[str]) -> None:
    result = command(*arguments)
    assert result.exit_code == 2
    assert "Error" in result.stderr
    assert result.stdout == ""


@pytest.mark.parametrize(
    ("error", "code", "message"),
    [
        (PluginError("two plugins"), 2, "error: two plugins\n"),
        (CapabilityError("cannot"), 2, "error: cannot\n"),
        (ResultsFileError("truncated"), 2, "error: truncated\n"),
        (
            SolverError("lost contact", {"gap": 1, "load": 2}),
            1,
            "error: lost contact\nstate at the failure: gap 1, load 2\n",
        ),
        (FileNotFoundError(2, "No such file or directory", "x"), 1, "error: x: No such file"),
        (ZeroDivisionError("oh"), 1, "internal error: ZeroDivisionError: oh\n"),
        (KeyboardInterrupt(), 130, "interrupted\n"),
    ],
)
def test_errors_print_one_line_and_set_the_exit_code(
    command: Command,
    monkeypatch: pytest.MonkeyPatch,
    error: BaseException,
    code: int,
    message: str,
) -> None:
    def fail(*_: object) -> None:
        raise error

    monkeypatch.setattr(wearsim.cli.commands.scenarios, "read_scenario", fail)
    result = command("check", "a.toml")
    assert result.exit_code == code
    assert result.stderr.startswith(message)
    assert "Traceback" not in result.stderr
    assert result.stdout == ""


@pytest.mark.parametrize("by", ["option", "environment"])
def test_traceback_is_shown_on_request(
    command: Command, monkeypatch: pytest.MonkeyPatch, by: str
) -> None:
    def fail(*_: object) -> None:
        raise CapabilityError("cannot")

    monkeypatch.setattr(wearsim.cli.commands.scenarios, "read_scenario", fail)
    monkeypatch.setenv("WEARSIM_TRACEBACK", "1" if by == "environment" else "0")
    result = command(*(["--traceback"] if by == "option" else []), "check", "a.toml")
    assert result.exit_code == 2
    assert result.stderr.startswith("Traceback")
    assert "CapabilityError: cannot" in result.stderr


@pytest.mark.parametrize("verb", BUILT_IN)
def test_help_line_of_a_verb_is_its_own_summary(command: Command, verb: str) -> None:
    shown = " ".join(command(verb, "--help").output.split())
    assert BUILT_IN[verb] in shown
