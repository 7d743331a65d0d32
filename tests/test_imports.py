"""Lazy imports: slow libraries are loaded only where they are needed."""

from __future__ import annotations

import subprocess
import sys
from functools import cache
from pathlib import Path

SLOW = {"numpy", "numba", "h5py", "pint", "pydantic", "matplotlib", "scipy"}
RIG = Path(__file__).parents[1] / "scenarios" / "rig-450min.toml"
READ = f"wearsim.load_scenario({str(RIG)!r})"
HELP = """
import contextlib, io, sys
from wearsim.cli.app import app
for arguments in {arguments!r}:
    with contextlib.redirect_stdout(io.StringIO()) as output, contextlib.suppress(SystemExit):
        app(arguments, prog_name="wearsim")
    assert "wearsim" in output.getvalue(), output.getvalue()
"""


@cache
def modules_after(code: str, *, whole: bool = False) -> set[str]:
    """Return the modules loaded by `code` in a separate process, by the first or `whole` name."""
    tail = "\nimport sys\nsys.stderr.write('\\n'.join(sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", code + tail], capture_output=True, text=True, check=True
    )
    return {name if whole else name.split(".")[0] for name in done.stderr.split("\n")}


def test_importing_wearsim_loads_nothing_slow():
    assert not modules_after("import wearsim") & (SLOW | {"typer", "rich", "pluggy"})


def test_public_names_are_listed_without_loading_them():
    assert not modules_after("import wearsim\nassert 'run' in dir(wearsim)") & SLOW


def test_public_name_is_loaded_at_its_first_use():
    assert modules_after("import wearsim\nwearsim.load_scenario") >= {"pydantic", "numpy"}


def test_help_loads_nothing_slow():
    assert not modules_after(HELP.format(arguments=[["--help"], ["--version"]])) & SLOW


def test_help_of_a_verb_loads_nothing_slow():
    # typer itself loads pydantic to read the type of some parameters
    verbs = [[verb, "--help"] for verb in ("check", "run", "resume", "show", "plot")]
    assert not modules_after(HELP.format(arguments=verbs)) & (SLOW - {"pydantic"})


STUDIES = "wearsim.open_results, wearsim.run, wearsim.ensemble, wearsim.solve_contact"
LOADED = f"import wearsim\n{STUDIES}\n{READ}"


def test_numba_is_not_loaded_before_a_kernel_is_called():
    assert not modules_after(LOADED) & {"numba", "h5py"}


def test_reading_a_scenario_loads_no_display():
    assert not modules_after(LOADED) & {"matplotlib", "typer", "rich"}


def test_a_run_loads_neither_ensembles_nor_the_json_schema():
    loaded = modules_after(f"import wearsim.cli.progress\nwearsim.run\n{READ}", whole=True)
    unused = "execution", "ensemble.result", "uq.estimation.estimates", "csv_export", "examples"
    assert not {name for name in loaded if name.startswith("wearsim.") and name.endswith(unused)}


def test_command_and_module_give_the_same_help():
    outputs = [
        subprocess.run(command, capture_output=True, text=True, check=True).stdout
        for command in (
            [sys.executable, "-m", "wearsim", "--help"],
            [sys.executable, "-c", "from wearsim.cli.app import main; main()", "--help"],
        )
    ]
    assert outputs[0] == outputs[1]
    assert "Usage: wearsim" in outputs[0]


VERB = """
import sys
from wearsim.cli.app import main
try:
    sys.argv[1:] = {arguments!r}
    main()
except SystemExit as ended:
    assert not ended.code, ended.code
"""


def test_verbs_load_only_what_they_use(tmp_path: Path):
    file = str(tmp_path / "run.h5")
    run = ["run", str(RIG), "--set", "operation.duration=1 min", "-o", file, "--quiet"]
    loaded = modules_after(VERB.format(arguments=run), whole=True)
    assert loaded >= {"numba", "h5py"}
    unused = {"scipy.linalg", "scipy.special", "scipy.stats", "scipy.optimize"}
    assert not loaded & (unused | {"matplotlib", "loky"})
    checked = modules_after(VERB.format(arguments=["check", str(RIG)]), whole=True)
    assert "numba" in checked
    assert not checked & (unused | {"matplotlib", "loky", "h5py"})
    shown = modules_after(VERB.format(arguments=["show", file]))
    assert not shown & {"numba", "scipy", "matplotlib"}
