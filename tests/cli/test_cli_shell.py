import os
import re
import subprocess
import sys
from importlib.metadata import entry_points, version
from pathlib import Path
from typing import Annotated

import numpy as np
import pytest
from cli_examples import Command
from pydantic import AfterValidator, BaseModel

import wearsim.cli.commands.scenarios
from wearsim.cli.app import BUILT_IN
from wearsim.cli.solver_state import solver_state
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
            "error: lost contact\nstate at the failure: gap 1e+06 um, load 2\n",
        ),
        (SolverError("no strip", {"contact_model": "hertz"}), 1, "error: no strip\n"),
        (FileNotFoundError(2, "No such file or directory", "x"), 1, "error: x: No such file"),
        (ZeroDivisionError("oh"), 1, "internal error: ZeroDivisionError: oh\n"),
        (MemoryError("8 GiB"), 1, "error: not enough memory (8 GiB); fewer strips"),
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


OPTIONS = ("option", "option of the verb")


def test_verbs_of_a_group_take_the_traceback_option(command: Command) -> None:
    assert "--traceback" in command("new", "scenario", "--help").output


@pytest.mark.parametrize("by", [*OPTIONS, "environment"])
def test_traceback_is_shown_on_request(
    command: Command, monkeypatch: pytest.MonkeyPatch, by: str
) -> None:
    def fail(*_: object) -> None:
        raise CapabilityError("cannot")

    monkeypatch.setattr(wearsim.cli.commands.scenarios, "read_scenario", fail)
    monkeypatch.setenv("WEARSIM_TRACEBACK", "1" if by == "environment" else "0")
    before, after = (["--traceback"] if by == where else [] for where in OPTIONS)
    result = command(*before, "check", "a.toml", *after)
    assert result.exit_code == 2
    assert result.stderr.startswith("Traceback")
    assert "CapabilityError: cannot" in result.stderr


@pytest.mark.parametrize("verb", BUILT_IN)
def test_help_line_of_a_verb_is_its_own_summary(command: Command, verb: str) -> None:
    shown = " ".join(command(verb, "--help").output.split())
    assert BUILT_IN[verb] in shown


def _refuse(value: int) -> int:
    raise ValueError("must be even")


class _Outer(BaseModel):
    values: list[Annotated[int, AfterValidator(_refuse)]]


def test_error_of_pydantic_is_shown_without_its_prefix(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        wearsim.cli.commands.scenarios, "read_scenario", lambda *_: _Outer(values=[3])
    )
    message = command("check", "a.toml").stderr
    assert message.startswith("internal error: ValidationError: values.0: must be even\n")


def test_state_at_a_failure_has_engineering_units() -> None:
    state = {
        "line_load": np.array([0.0, 2.5e4]),
        "steps": np.array([3]),
        "half_length": 1e-4,
        "contact_y": np.zeros(3),
        "fill_level": 0.25,
        "names": "text",
    }
    assert solver_state(state) == (
        "line load 0 to 25 N/mm, steps 3, half-length 0.1 mm, fill level 0.25"
    )


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("wearsim ens", "ensemble"),
        ("wearsim run --fo", "--force"),
        ("wearsim new ", "plugin"),
    ],
)
def test_shell_completes_verbs_and_options(words: str, expected: str) -> None:
    completed = subprocess.run(
        [sys.executable, "-m", "wearsim"],
        env=os.environ
        | {
            "_WEARSIM_COMPLETE": "complete_bash",
            "COMP_WORDS": words,
            "COMP_CWORD": str(words.count(" ")),
        },
        capture_output=True,
        text=True,
        check=False,
    )
    assert completed.stdout.split()[0] == expected


@pytest.mark.slow
def test_check_and_contact_count_the_kernels_that_they_compile(tmp_path: Path) -> None:
    scenario = Path(__file__).parents[2] / "scenarios" / "mean-contact.toml"
    for verb in ("check", "contact"):
        cache = {"NUMBA_CACHE_DIR": str(tmp_path / verb)}
        completed = subprocess.run(
            [sys.executable, "-m", "wearsim", verb, str(scenario)],
            env=os.environ | cache,
            capture_output=True,
            text=True,
            check=False,
        )
        first = completed.stderr.splitlines()[0]
        assert re.fullmatch(r"compiling kernels, once after installation: 1 of \d", first)
        assert "\x1b" not in completed.stderr
