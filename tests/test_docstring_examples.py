"""Examples in the docstrings of all public functions, classes and methods."""

from __future__ import annotations

import doctest
import inspect
import shutil
from collections.abc import Iterator
from pathlib import Path

import matplotlib as mpl
import pytest
from typer.testing import CliRunner

import wearsim
from wearsim.cli.app import app

OPTIONS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
WEAR = {"distribution": "lognormal", "median": "1.1e-11 1/Pa", "factor": 1.5}
FRICTION = {"distribution": "uniform", "low": 0.08, "high": 0.12}


def _documented() -> Iterator[tuple[str, object]]:
    """Yield the public functions, classes and their own and inherited methods by name."""
    yield "wearsim", wearsim
    for name in sorted(set(dir(wearsim)) - {"__version__"}):
        item = getattr(wearsim, name)
        yield name, item
        if inspect.isclass(item) and item.__module__.startswith("wearsim"):
            for method, member in inspect.getmembers(item, callable):
                module = getattr(member, "__module__", "")
                if not method.startswith("_") and module.startswith("wearsim"):
                    yield member.__qualname__, member


DOCUMENTED = dict(_documented())


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the files that the examples use."""
    folder = tmp_path_factory.mktemp("files")
    done = CliRunner().invoke(app, ["new", "scenario", str(folder / "rig.toml")])
    assert done.exit_code == 0, done.output
    random = wearsim.load_scenario(folder / "rig.toml", {"friction.coefficient": FRICTION})
    wearsim.ensemble(random, 16, folder / "rig-ensemble.h5", scheduler="serial")
    scattered = random.changed({"wear.cylinder.k_over_h": WEAR, "limit.depth": "50 um"})
    wearsim.life(scattered, 16, folder / "rig-life.h5", target=675_000, scheduler="serial")
    return folder


@pytest.mark.parametrize("name", DOCUMENTED)
def test_examples_run_as_printed(
    name: str, files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(files, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    text = inspect.getdoc(DOCUMENTED[name]) or ""
    example = doctest.DocTestParser().get_doctest(text, {"wearsim": wearsim}, name, None, 0)
    assert example.examples, f"{name} has no example"
    output: list[str] = []
    with mpl.rc_context():
        result = doctest.DocTestRunner(optionflags=OPTIONS).run(example, out=output.append)
    assert result.failed == 0, "".join(output)
