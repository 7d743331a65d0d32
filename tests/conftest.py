"""Test modules that import a plugin, which are skipped without it and marked `bench`.

No example of hypothesis fails because of its run time. A kernel is compiled by one of the test
processes only, while the others wait for it.
"""

from __future__ import annotations

import gc
import os
import re
import shutil
import tempfile
import time
from collections.abc import Generator, Hashable, Iterator
from contextlib import contextmanager
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from wearsim.mechanics.numerics.jit import Kernel
from wearsim.operating_system import lock_file

settings.register_profile("wearsim", settings(), deadline=None)
settings.load_profile("wearsim")

STARTED = time.monotonic()
MEMORY, LEAST_FREE = "/dev/shm", 4 << 30  # a file system in memory; tests need a tenth [bytes]
LONG = {"test_site.py", "test_installs.py", "test_numba_cache.py", "test_run_kills.py"}
#: tests.benchmarks imports wearsim_bench
PLUGINS = r"wearsim_(?:bench|chevalier2005|explore|halfspace|optimise|validation)"
NAMES = rf"{PLUGINS}|tests\.benchmarks import"
IMPORT = re.compile(rf"^\s*(?:from|import)\s+({NAMES})", re.M)


@cache
def plugins_of(path: Path) -> set[str]:
    """Return the plugins that a test module imports."""
    if path.suffix != ".py" or not path.name.startswith("test_"):
        return set()
    found = set(IMPORT.findall(path.read_text(encoding="utf-8")))
    return {"wearsim_bench" if name.startswith("tests") else name for name in found}


def pytest_ignore_collect(collection_path: Path) -> bool | None:
    missing = [name for name in plugins_of(collection_path) if find_spec(name) is None]
    return True if missing else None


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("--begin-within") < float("inf"):  # those that take minutes would end late
        items.sort(key=lambda item: item.path.name not in LONG)
    for item in items:
        if plugins_of(item.path):
            item.add_marker(pytest.mark.bench)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--begin-within",
        type=float,
        metavar="SECONDS",
        default=float("inf"),
        help="skip tests that have not begun after this time",
    )


def pytest_runtest_setup(item: pytest.Item) -> None:
    longest: float = item.config.getoption("--begin-within")
    if time.monotonic() - STARTED > longest:
        pytest.skip(f"not begun within {longest:.0f} s")


@pytest.hookimpl(tryfirst=True)
def pytest_configure(config: pytest.Config) -> None:
    """Keep the files of the quick tests in memory where there is enough: they are flushed often.

    The slow tests install whole environments.
    """
    if hasattr(config, "workerinput"):  # one of several processes, whose folder is given
        return
    usable = os.access(MEMORY, os.W_OK) and shutil.disk_usage(MEMORY).free > LEAST_FREE
    if config.option.basetemp is None and usable and "not slow" in config.option.markexpr:
        config.option.basetemp = tempfile.mkdtemp(prefix="wearsim-tests-", dir=MEMORY)
        config.add_cleanup(partial(shutil.rmtree, config.option.basetemp, ignore_errors=True))


def pytest_sessionstart(session: pytest.Session) -> None:
    Kernel.may_be_interpreted = False  # tests are about compiled kernels, also at the first run
    if hasattr(session.config, "workerinput"):  # one of several processes
        folder = session.config.cache.mkdir("kernels")
        Kernel.__call__ = compiled_once(Kernel.__call__, folder)


def compiled_once(call: Any, folder: Path) -> Any:
    """Return `call` of kernels, by which one process compiles a kernel and the next ones read it.

    A kernel is compiled separately for arguments that are None, which may be those of type Any.
    """
    called: set[Hashable] = set()

    def call_or_wait(kernel: Kernel, *arguments: Any) -> Any:
        if kernel in called:
            return call(kernel, *arguments)
        form = kernel, *[argument is None for argument in arguments]
        if form in called:
            return call(kernel, *arguments)
        with locked(folder / kernel.__name__):
            result = call(kernel, *arguments)
        called.add(form if "Any" in kernel.__annotations__.values() else kernel)
        return result

    return call_or_wait


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Wait until no other process holds the lock of a file, and hold it in the context."""
    with path.open("w") as file:
        while True:
            try:
                lock_file(file.fileno())
            except OSError:
                time.sleep(0.1)
            else:
                break
        yield


@pytest.fixture(scope="session", autouse=True)
def few_repetitions() -> Iterator[None]:
    """Reduce the number of repetitions of two computations that have tests of their own.

    They are the draws that determine the axis of an ensemble, and the simulated sets of tests that
    give the power of an identification; both take longer than the small studies of the tests.
    """
    from wearsim.studies.ensemble import realisation
    from wearsim.studies.identify.planning import plan_tests
    from wearsim.uq.hierarchy.verdict import Power

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(realisation, "AXIS_REALISATIONS", 8)
        for function in (Power.__init__, plan_tests):
            patch.setitem(function.__kwdefaults__, "sets", 200)
        yield


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Leave the objects of the collection of tests, which remain, out of all garbage collections.

    A garbage collection would go through a million of them, and so would one at this place. Later
    ones are fewer than by default, as most objects of a test are released without them.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(20_000, 20, 20)
        gc.enable()
