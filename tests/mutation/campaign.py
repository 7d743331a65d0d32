"""Share of the mutants of `wearsim` that the quick tests notice.

``python -m tests.mutation.campaign --sample 300 --seed 1 -o out/mutants.json`` changes one
operator, constant, result or statement of a function at a time, and runs the tests that call the
function until one fails. Mutants that change no result are listed with the reason in
`tests/mutation/equivalent.toml`, and left out. All mutants are tried without `--sample`.

mutmut leaves functions with a decorator alone, which here are all kernels, and other tools start a
process for each mutant, which takes seconds to import the libraries. Here the tests are collected
once; each test is run once to find its duration and the functions that it calls, and for each
mutant a forked process replaces the code of the function. Kernels, in `wearsim/mechanics`, are
interpreted (NUMBA_DISABLE_JIT), for other modules they are compiled. Tests that take longer than
`LIMIT`, and more than `CASES` cases of a parametrized test, are left out, so that the share is a
lower bound.
"""

from __future__ import annotations

import argparse
import gc
import json
import math
import os
import random
import signal
import subprocess
import sys
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from fnmatch import fnmatchcase
from importlib import import_module
from pathlib import Path
from types import CodeType, FrameType, FunctionType
from typing import Any

import pytest

from tests.mutation.operators import Mutant, mutants_of, mutated_code

ROOT = Path(__file__).parents[2]
PARTS = ("wearsim/mechanics", "wearsim/evolution/steppers", "wearsim/uq")
KERNELS = "wearsim/mechanics/"
# tests by kind of mutants: of interpreted kernels, and of other functions
TESTS = {
    "interpreted": ["tests/mechanics"],
    "compiled": ["tests/evolution", "tests/uq", "tests/scenario/test_mixtures.py"],
}
LIMIT = 1.2  # processor time of a test with its fixtures [s]
CASES = 4  # of a parametrized test, from its first to its last one
MOST = 6.0  # processor time of the tests of a mutant, the quickest ones first [s]
OFTEN = 5.0  # ratio of the time limit of a test on a mutant to its duration
LOADING = 3.0  # processor time for kernels that a test loads in addition [s]
EQUIVALENT = Path(__file__).with_name("equivalent.toml")
Calls = dict[str, list[str]]  # names of the functions called, by module
SURVIVED, KILLED, UNTESTED = "survived", "killed", "not called"


@dataclass(eq=False)  # plugins are hashable
class Failures:
    """Plugin of pytest that notes whether a test failed or was skipped."""

    failed: bool = False
    passed: bool = False

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note the outcome of a phase of a test."""
        self.failed = self.failed or report.failed
        self.passed = self.passed or (report.passed and report.when == "call")


@dataclass(eq=False)  # plugins are hashable
class Campaign:
    """Plugin of pytest that tries mutants on the collected tests, instead of running them."""

    mutants: Sequence[Mutant]
    record: Path
    report: Callable[[str], None]
    outcomes: dict[Mutant, str] = field(default_factory=dict)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Find the functions that each test calls, then test every mutant."""
        modules = sorted({mutant.module for mutant in self.mutants})
        for module in modules:
            import_module(module.removesuffix(".py").replace("/", "."))
        functions = live_functions(modules)
        gc.collect()
        gc.freeze()
        called = self._called(session, modules)
        items = {item.nodeid: item for item in session.items}
        if "NUMBA_DISABLE_JIT" not in os.environ:
            load_kernels(items[name] for name in called)
        for mutant in self.mutants:
            chosen = [
                (seconds, items[name])
                for name, (seconds, calls) in called.items()
                if mutant.function in calls.get(mutant.module, ())
            ]
            outcome = UNTESTED
            if chosen:
                killed = self._is_killed(mutant, functions, sorted(chosen, key=lambda one: one[0]))
                outcome = KILLED if killed else SURVIVED
            self.outcomes[mutant] = outcome
            if outcome != KILLED:
                self.report(f"{outcome}: {mutant}\n")
        return True

    def _called(
        self, session: pytest.Session, modules: list[str]
    ) -> dict[str, tuple[float, Calls]]:
        """Return the duration [s] and the functions called of every test that is quick and passes.

        They are read from a file where neither the test nor the modules have changed since.
        """
        known: dict[str, Any] = {}
        if self.record.exists():
            known = json.loads(self.record.read_text())
        stamp = {name: (ROOT / name).stat().st_mtime_ns for name in modules}
        found: dict[str, tuple[float, Calls]] = {}
        for number, item in enumerate(some_cases(session.items)):
            key = item.nodeid
            written = item.path.stat().st_mtime_ns
            old = known.get(key)
            if (
                old is None
                or old["written"] != written
                or any(old["stamp"].get(name) != at for name, at in stamp.items())
            ):
                old = {"written": written, "stamp": stamp, **traced(item, modules)}
                known[key] = old
                if number % 100 == 0:
                    self._save(known)
            if old["passed"] and old["calls"]:
                found[key] = old["seconds"], old["calls"]
        self._save(known)
        return found

    def _save(self, known: dict[str, Any]) -> None:
        self.record.parent.mkdir(parents=True, exist_ok=True)
        self.record.write_text(json.dumps(known))

    def _is_killed(
        self,
        mutant: Mutant,
        functions: dict[tuple[str, str], list[FunctionType]],
        chosen: list[tuple[float, pytest.Item]],
    ) -> bool:
        code = mutated_code(ROOT, mutant)
        replaced = functions.get((code.co_filename, code.co_qualname), [])

        def work() -> bool:
            for function in replaced:
                function.__code__ = code
            total = 0.0
            for seconds, item in chosen:
                signal.setitimer(signal.ITIMER_PROF, LOADING + OFTEN * seconds)
                total += seconds
                if fails(item):
                    return True
                if total > MOST:
                    break
            return False

        assert replaced, mutant
        return in_child(work, OFTEN) is not False  # an error or the time limit kills it too


def fails(item: pytest.Item) -> bool:
    """Run a test, with its fixtures; return whether it fails."""
    noted = Failures()
    item.config.pluginmanager.register(noted)
    try:
        item.ihook.pytest_runtest_protocol(item=item, nextitem=None)
    finally:
        item.config.pluginmanager.unregister(noted)
    return noted.failed or not noted.passed


def load_kernels(items: Iterable[pytest.Item]) -> None:
    """Run one test of each file of whole tests, so that forked processes have compiled kernels."""
    files = {item.path: item for item in items if "evolution" in item.path.parts}
    for item in files.values():
        fails(item)


def some_cases(items: Iterable[pytest.Item]) -> list[pytest.Item]:
    """Return tests, with at most `CASES` cases of each parametrized one."""
    functions: dict[str, list[pytest.Item]] = {}
    for item in items:
        functions.setdefault(item.nodeid.partition("[")[0], []).append(item)
    return [
        cases[place]
        for cases in functions.values()
        for place in sorted({round(k * (len(cases) - 1) / (CASES - 1)) for k in range(CASES)})
    ]


def traced(item: pytest.Item, modules: list[str]) -> dict[str, Any]:
    """Return the duration of a test [s], the functions that it calls, and whether it passes."""
    paths = {str(ROOT / name): name for name in modules}
    calls: dict[str, set[str]] = {}

    def enter(frame: FrameType, _: str, __: object) -> None:
        name = paths.get(frame.f_code.co_filename)
        if name is not None:
            function = frame.f_code.co_qualname.partition(".<locals>")[0]
            calls.setdefault(name, set()).add(function)

    def work() -> dict[str, Any]:
        sys.settrace(enter)
        begin = time.process_time()
        passed = not fails(item)
        sys.settrace(None)
        called = {name: sorted(some) for name, some in calls.items()}
        return {"passed": passed, "seconds": time.process_time() - begin, "calls": called}

    if "NUMBA_DISABLE_JIT" in os.environ:
        return in_child(work, LIMIT) or {"passed": False, "seconds": math.inf, "calls": {}}
    found = work()  # in this process, which then holds the compiled kernels
    found = work() if found["seconds"] > LIMIT else found
    return found | {"passed": found["passed"] and found["seconds"] <= LIMIT}


def in_child(work: Callable[[], Any], limit: float) -> Any:
    """Return the result of a function in a forked process; None after an error or a time [s]."""
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        os.close(reading)
        signal.signal(signal.SIGPROF, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_PROF, limit)
        quiet = os.open(os.devnull, os.O_WRONLY)
        for stream in (1, 2):
            os.dup2(quiet, stream)
        with suppress(BaseException), os.fdopen(writing, "w") as file:
            file.write(json.dumps(work()))
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as file:
        text = file.read()
    os.waitpid(child, 0)
    return json.loads(text) if text else None


def live_functions(modules: Iterable[str]) -> dict[tuple[str, str], list[FunctionType]]:
    """Return the functions of modules by file and qualified name."""
    paths = {str(ROOT / name) for name in modules}
    found: dict[tuple[str, str], list[FunctionType]] = {}
    for item in gc.get_objects():
        if isinstance(item, FunctionType) and item.__code__.co_filename in paths:
            code: CodeType = item.__code__
            found.setdefault((code.co_filename, code.co_qualname), []).append(item)
    return found


def equivalent() -> list[dict[str, str]]:
    """Return the mutants, or the functions, in which a change has no effect on results."""
    listed: list[dict[str, str]] = tomllib.loads(EQUIVALENT.read_text(encoding="utf-8"))["mutant"]
    return listed


def is_listed(mutant: Mutant, listed: Iterable[dict[str, str]]) -> bool:
    """Return whether a mutant is one of those listed."""
    return any(
        fnmatchcase(mutant.module, one["module"])
        and fnmatchcase(mutant.function, one["function"])
        and all(
            one.get(name, value) == value
            for name, value in (
                ("line", mutant.line),
                ("before", mutant.before),
                ("after", mutant.after),
            )
        )
        for one in listed
    )


def all_mutants(parts: Iterable[str]) -> list[Mutant]:
    """Return the mutants of all modules of packages, or of modules, except the equivalent ones."""
    found, left_out = [], equivalent()
    for part in parts:
        paths = [ROOT / part] if part.endswith(".py") else sorted((ROOT / part).rglob("*.py"))
        for path in paths:
            found += [one for one in mutants_of(ROOT, path) if not is_listed(one, left_out)]
    return found


def try_mutants(
    mutants: Sequence[Mutant], tests: Sequence[str], record: Path, report: Callable[[str], None]
) -> dict[Mutant, str]:
    """Try mutants with the quick tests of some files and folders; return the outcome of each.

    Durations and calls of the tests are read from a file, `record`, and written to it.
    """
    plugin = Campaign(mutants, record, report)
    options = ["-o", "addopts=", "--benchmark-disable", "-p", "no:cacheprovider"]
    options += ["-p", "no:terminal", "-m", "not slow and not coverage"]
    status = pytest.main([*options, *tests], [plugin])
    assert len(plugin.outcomes) == len(mutants), f"pytest ended with {status}"
    return plugin.outcomes


def rates(outcomes: dict[Mutant, str]) -> str:
    """Return a table of the outcomes by module, as Markdown."""
    head = "| module | mutants | killed | survived | not called |\n|---|---|---|---|---|\n"
    modules = sorted({mutant.module for mutant in outcomes})
    counted = {
        name: Counter(how for mutant, how in outcomes.items() if mutant.module == name)
        for name in modules
    }
    counted["all"] = Counter(outcomes.values())
    lines = []
    for name, count in counted.items():
        total = count.total()
        cells = name.removeprefix("wearsim/"), total, f"{100.0 * count[KILLED] / total:.0f} %"
        lines.append(f"| {' | '.join(map(str, cells))} | {count[SURVIVED]} | {count[UNTESTED]} |\n")
    return head + "".join(lines)


def write_line(text: str) -> None:
    """Print at once."""
    sys.stdout.write(text)
    sys.stdout.flush()


def both_kinds(arguments: Sequence[str], folder: Path) -> list[dict[str, Any]]:
    """Try the mutants of kernels and the others in two processes; return mutants and outcomes."""
    processes = []
    for kind in TESTS:
        command = [sys.executable, "-m", "tests.mutation.campaign", *arguments, "--only", kind]
        processes.append(subprocess.Popen(command, cwd=ROOT))
    if sum(process.wait() for process in processes):
        raise SystemExit(1)
    return [row for kind in TESTS for row in json.loads((folder / f"{kind}.json").read_text())]


def main() -> None:
    """Try mutants, print those that survive and the rates, and write them to a file."""
    parser = argparse.ArgumentParser(prog="tests.mutation.campaign", description=__doc__)
    parser.add_argument("parts", nargs="*", default=PARTS, help="packages and modules to change")
    parser.add_argument("--tests", nargs="*", help="files and folders of tests")
    parser.add_argument("--sample", type=int, help="number of mutants, drawn at random")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", choices=TESTS, help="mutants of kernels, or the others")
    parser.add_argument("--folder", type=Path, default=ROOT / "out" / "mutants", help="of records")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE.json")
    given = parser.parse_args()
    folder: Path = given.folder
    folder.mkdir(parents=True, exist_ok=True)
    mutants = all_mutants(given.parts)
    found = len(mutants)
    if given.sample:
        mutants = random.Random(given.seed).sample(mutants, min(given.sample, found))
        mutants.sort(key=lambda mutant: (mutant.module, mutant.number))
    if given.only:
        interpreted = given.only == "interpreted"
        if interpreted:  # numba, which the tests import, reads it
            os.environ["NUMBA_DISABLE_JIT"] = "1"
        mutants = [one for one in mutants if one.module.startswith(KERNELS) == interpreted]
        record, outcomes = folder / f"calls-{given.only}.json", {}
        if mutants:
            outcomes = try_mutants(mutants, given.tests or TESTS[given.only], record, write_line)
        rows = [{**asdict(mutant), "outcome": how} for mutant, how in outcomes.items()]
        (folder / f"{given.only}.json").write_text(json.dumps(rows, indent=1))
        return
    rows = both_kinds(sys.argv[1:], folder)
    outcomes = {}
    for row in rows:
        how, row["lines"] = row.pop("outcome"), tuple(row["lines"])
        outcomes[Mutant(**row)] = how
    table = rates(outcomes)
    of_all = f"{len(mutants)} of {found} mutants, drawn with seed {given.seed}"
    write_line(f"\n{table}\n{of_all}\n")
    if given.output:
        from tests.benchmarks.table import save_tables

        note = f"{of_all}; those that change no result are left out."
        save_tables(given.output, "make mutants", {"mutants": f"{table}\n{note}\n"})


if __name__ == "__main__":
    main()
