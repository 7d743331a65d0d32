"""Verbs of other distributions, found through the entry-point group `wearsim.commands`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from importlib.metadata import entry_points
from pathlib import Path

import pytest
from cli_examples import Command

from wearsim.cli import app as installed_verbs
from wearsim.errors import CapabilityError, PluginError

Install = Callable[..., str]
APP = """
import typer
from wearsim.errors import CapabilityError

app = typer.Typer()


@app.command()
def any_name(times: int = 1, fail: bool = False) -> None:
    '''Grind for a while.'''
    if fail:
        raise CapabilityError("no wheel")
    typer.echo("ground " * times)
"""
GROUP = """
import typer

app = typer.Typer(add_completion=False, help="Several tools.")
app.command("saw")(lambda: typer.echo("sawn"))
app.command("file")(lambda: typer.echo("filed"))
"""


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Return a function that installs a distribution with one verb; it returns its module."""
    before, count = set(sys.modules), 0

    def install(
        verb: str,
        code: str = APP,
        name: str = "shop",
        summary: str = "Shop tools.",
        app: str = "app",
    ) -> str:
        nonlocal count
        count += 1
        module, site = f"verb_module_{count}", tmp_path / f"site_{count}"
        info = site / f"{name}-1.{count}.dist-info"
        info.mkdir(parents=True)
        metadata = f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.{count}\n"
        info.joinpath("METADATA").write_text(metadata + (summary and f"Summary: {summary}\n"))
        points = f"[wearsim.commands]\n{verb} = {module}:{app}\n"
        info.joinpath("entry_points.txt").write_text(points)
        (site / f"{module}.py").write_text(code)
        monkeypatch.syspath_prepend(site)
        return module

    yield install
    for module in set(sys.modules) - before:
        if module.startswith("verb_module_"):
            del sys.modules[module]


@pytest.fixture
def nothing_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hide the verbs that the environment of the tests has installed."""
    monkeypatch.setattr(installed_verbs, "installed_verbs", dict)


def help_lines(command: Command) -> dict[str, str]:
    """Return the verbs that the help lists, with their lines."""
    result = command("--help")
    assert result.exit_code == 0, result.output
    listed = result.stdout[result.stdout.index("Commands:") :]
    return dict(
        line.strip().split(maxsplit=1) for line in listed.splitlines() if line.startswith("  ")
    )


def message_of(result: object) -> str:
    """Return the text of an error without its line breaks."""
    return " ".join(result.stderr.split())  # type: ignore[attr-defined]


def test_help_lists_an_installed_verb_without_its_import(
    command: Command, install: Install
) -> None:
    module = install("grind", "raise AssertionError('imported')")
    lines = help_lines(command)
    assert lines["grind"] == "Shop tools."
    assert list(lines).index("grind") > list(lines).index("run")
    assert module not in sys.modules


def test_help_names_the_distribution_without_a_summary(command: Command, install: Install) -> None:
    install("grind", summary="")
    assert help_lines(command)["grind"] == "From shop 1.1."


def test_only_the_called_verb_is_imported(command: Command, install: Install) -> None:
    called, other = install("grind"), install("saw", name="mill")
    result = command("grind", "--times", 2)
    assert (result.exit_code, result.stdout) == (0, "ground ground \n")
    assert called in sys.modules
    assert other not in sys.modules


def test_built_in_verbs_import_no_installed_verb(command: Command, install: Install) -> None:
    module = install("grind")
    assert command("schema").exit_code == 0
    assert module not in sys.modules


def test_help_of_an_installed_verb_has_its_name(command: Command, install: Install) -> None:
    install("grind")
    result = command("grind", "--help")
    assert result.exit_code == 0
    assert "Usage: wearsim grind [OPTIONS]" in result.output.replace("root", "wearsim")
    assert "Grind for a while." in result.output
    assert "completion" not in result.output


def test_installed_verb_may_have_verbs(command: Command, install: Install) -> None:
    install("tools", GROUP)
    result = command("tools", "saw")
    assert (result.exit_code, result.stdout) == (0, "sawn\n")
    assert "No such command 'drill'" in message_of(command("tools", "drill"))


def test_wrong_options_of_an_installed_verb_exit_with_2(command: Command, install: Install) -> None:
    install("grind")
    result = command("grind", "--speed", 1)
    assert result.exit_code == 2
    assert "No such option" in result.stderr


def test_errors_of_an_installed_verb_set_the_exit_code(command: Command, install: Install) -> None:
    install("grind")
    result = command("grind", "--fail")
    assert (result.exit_code, result.stderr) == (CapabilityError.exit_code, "error: no wheel\n")


@pytest.mark.parametrize(
    ("code", "cause"),
    [
        ("import a_library_nobody_has", "ModuleNotFoundError: No module named 'a_library_nobody_"),
        ("app = 1 / 0", "ZeroDivisionError: division by zero"),
        ("raise SystemExit('goodbye')", "SystemExit: goodbye"),
        ("", "AttributeError: module 'verb_module_1' has no attribute 'app'"),
        ("app = print", "TypeError: verb_module_1:app is a builtin_function_or_method, expected"),
        ("import typer\napp = typer.Typer()", "RuntimeError: Could not get a command"),
    ],
    ids=["import", "crash", "exit", "no app", "no Typer app", "empty app"],
)
def test_verb_that_cannot_be_loaded_is_one_clear_error(
    command: Command, install: Install, code: str, cause: str
) -> None:
    install("grind", code)
    install("saw", name="mill")
    result = command("grind")
    assert (result.exit_code, result.stdout) == (PluginError.exit_code, "")
    assert result.stderr.startswith("error: the verb 'grind' of shop 1.1 cannot be loaded: ")
    assert cause in message_of(result)
    assert "Traceback" not in result.stderr
    # neither the help nor another verb is affected
    assert {"grind", "saw", "run"} <= set(help_lines(command))
    assert command("saw").exit_code == 0
    assert command("plugins").exit_code == 0


def test_traceback_of_a_failed_import_is_shown_on_request(
    command: Command, install: Install, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WEARSIM_TRACEBACK", "0")  # restored after the test
    install("grind", "app = 1 / 0")
    result = command("--traceback", "grind")
    assert result.exit_code == 2
    assert result.stderr.startswith("Traceback")
    assert "ZeroDivisionError" in result.stderr


def test_built_in_verb_takes_precedence_over_installed_one(
    command: Command, install: Install
) -> None:
    before, module = help_lines(command)["schema"], install("schema")
    assert help_lines(command)["schema"] == before
    result = command("schema")
    assert result.exit_code == 0
    assert "properties" in result.stdout
    assert module not in sys.modules


def test_verb_of_two_distributions_is_an_error_naming_both(
    command: Command, install: Install
) -> None:
    modules = [install("grind", name="shop"), install("grind", name="mill", summary="Mills.")]
    assert help_lines(command)["grind"] in {"Shop tools.; Mills.", "Mills.; Shop tools."}
    result = command("grind")
    assert (result.exit_code, result.stdout) == (2, "")
    assert message_of(result) == (
        "error: the verb 'grind' is added by mill 1.2 and by shop 1.1; uninstall one of them"
    )
    assert not set(modules) & set(sys.modules)


@pytest.mark.usefixtures("nothing_installed")
@pytest.mark.parametrize(
    ("verb", "distribution", "extra"),
    [
        ("bench", "wearsim-bench", "wearsim[bench]"),
        ("explore", "wearsim-explore", "wearsim[explore]"),
        ("reproduce", "wearsim-chevalier2005", "wearsim[chevalier2005]"),
        ("validate", "wearsim-validation", "wearsim[validation]"),
        ("optimise", "wearsim-optimise", "wearsim[optimise]"),
    ],
)
def test_missing_verb_of_this_project_has_a_hint(
    command: Command, verb: str, distribution: str, extra: str
) -> None:
    assert verb not in help_lines(command)
    for arguments in ([verb], [verb, "--help"], [verb, "--quick"]):
        result = command(*arguments)
        assert (result.exit_code, result.stdout) == (2, "")
        message = message_of(result)
        assert f"No such command '{verb}'. It is part of {distribution}" in message
        assert f"pip install '{extra}'" in message
        assert f"pip install ./plugins/{distribution}" in message


def test_hints_name_distributions_and_extras_that_exist() -> None:
    import tomllib

    root = Path(__file__).parents[2]
    extras = tomllib.loads((root / "pyproject.toml").read_text())["project"]
    for verb, distribution in installed_verbs.FIRST_PARTY.items():
        path = root / "plugins" / distribution / "pyproject.toml"
        project = tomllib.loads(path.read_text())["project"]
        assert project["name"] == distribution
        assert verb in project["entry-points"][installed_verbs.GROUP]
        extra = distribution.removeprefix("wearsim-")
        requirements = extras["optional-dependencies"][extra]
        assert f"{distribution}=={project['version']}" in requirements


def test_unknown_verb_has_only_the_nearest_name_as_hint(command: Command, install: Install) -> None:
    install("grind")
    message = message_of(command("grnid"))
    assert "No such command 'grnid'. Did you mean 'grind'?" in message
    assert "pip install" not in message


@pytest.mark.bench
def test_verbs_of_this_project_are_installed(command: Command) -> None:
    names = {point.name for point in entry_points(group=installed_verbs.GROUP)}
    assert set(installed_verbs.FIRST_PARTY) <= names
    assert set(installed_verbs.FIRST_PARTY) <= set(help_lines(command))
