"""Share of the mutants of `wearsim` that the quick tests notice.

``python -m tests.mutation.campaign --sample 300 --seed 1 -o out/mutants.json`` changes one
operator, constant, result or statement of a function at a time, and runs the tests that call the
function until one fails. Mutants that change no result are listed with the reason in
`tests/mutation/equivalent.toml`, and left out. All mutants are tried without `--sample`.

mutmut leaves functions with a decorator alone, which here are all kernels, and other tools start a
process for each mutant, which takes seconds to import the libraries. Here the tests are collected
once; each test is run once to find its duration and the functions that it calls, and for each
mutant a forked process replaces the code of the function. Kernels, in `wearsim/mechanics`, are
interpreted (NUMBA_DISABLE_JIT), for other modules they are compiled. Tests up to `LIMIT`, with
`CASES` cases of a parametrized one, are tried first; a mutant that passes them is tried with the
other cases and with tests up to `LONGEST`. Longer tests, and those beyond `MOST`, are left out, so
that the share is a lower bound.
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
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from fnmatch import fnmatchcase
from functools import _lru_cache_wrapper, cached_property, partial
from importlib import import_module
from itertools import accumulate
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
    "compiled": [
        "tests/evolution",
        "tests/uq",
        "tests/models/test_distributions.py",
        "tests/scenario/test_mixtures.py",
    ],
}
# processor time of a test with its fixtures, first and for the mutants that pass [s]
LIMIT, LONGEST = 1.2, 10.0
CASES = 4  # of a parametrized test that are tried first, from its first to its last one
MOST = 6.0, 30.0  # processor time of the tests of a mutant in both stages, the quickest first [s]
OFTEN = 5.0  # ratio of the time limit of a test on a mutant to its duration
LOADING = 3.0  # processor time for kernels that a test loads in addition [s]
EQUIVALENT = Path(__file__).with_name("equivalent.toml")
CACHES: list[Callable[[], None]] = []  # emptied before each test
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
    known: dict[str, dict[str, Any]] = field(default_factory=dict)
    stamp: dict[str, int] = field(default_factory=dict)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Find the functions that each test calls, then test every mutant."""
        modules = {path.relative_to(ROOT).as_posix() for part in PARTS for path in modules_of(part)}
        interpreted = "NUMBA_DISABLE_JIT" in os.environ
        modules = {name for name in modules if name.startswith(KERNELS) == interpreted}
        modules |= {mutant.module for mutant in self.mutants}
        self.stamp = {name: (ROOT / name).stat().st_mtime_ns for name in sorted(modules)}
        if self.record.exists():
            self.known = json.loads(self.record.read_text())
        for module in self.stamp:
            import_module(module.removesuffix(".py").replace("/", "."))
        functions = live_functions(self.stamp)
        CACHES.extend(caches())
        gc.collect()
        gc.freeze()
        tests = cases_of(session.items)
        some = [item for cases in tests.values() for item in some_of(cases)]
        for item in some:
            self._traced(item)
        if not interpreted:
            load_kernels(item for item in some if self._traced(item)["calls"])
        for mutant in self.mutants:
            outcome = UNTESTED
            for stage in (self._first(mutant, some), self._others(mutant, tests)):
                if outcome != KILLED and stage:
                    killed = self._is_killed(mutant, functions, stage)
                    outcome = KILLED if killed else SURVIVED
            self.outcomes[mutant] = outcome
            if outcome != KILLED:
                self.report(f"{outcome}: {mutant}\n")
        self._save()
        return True

    def _first(self, mutant: Mutant, some: Sequence[pytest.Item]) -> list[pytest.Item]:
        """Return the quickest tests of a mutant."""
        return self._up_to(MOST[0], [item for item in some if self._calls(item, mutant, LIMIT)])

    def _others(self, mutant: Mutant, tests: dict[str, list[pytest.Item]]) -> list[pytest.Item]:
        """Return the other cases of the tests of a mutant, and the tests that take longer."""
        found: list[pytest.Item] = []
        for cases in tests.values():
            some = some_of(cases)
            if any(mutant.module in self._traced(item)["calls"] for item in some):
                found += [
                    item
                    for item in cases
                    if self._calls(item, mutant, LONGEST)
                    and not (item in some and self._calls(item, mutant, LIMIT))
                ]
        return self._up_to(MOST[1], found)

    def _calls(self, item: pytest.Item, mutant: Mutant, limit: float) -> bool:
        """Return whether a test passes within a time [s] and calls the function of a mutant."""
        found = self._traced(item)
        called = mutant.function in found["calls"].get(mutant.module, ())
        return bool(called and found["passed"] and found["seconds"] <= limit)

    def _up_to(self, most: float, items: Iterable[pytest.Item]) -> list[pytest.Item]:
        """Return the quickest tests up to a sum of their durations [s], at least one."""
        ordered = sorted(items, key=lambda item: float(self._traced(item)["seconds"]))
        sums = accumulate(self._traced(item)["seconds"] for item in ordered)
        return ordered[: 1 + sum(total <= most for total in sums)]

    def _traced(self, item: pytest.Item) -> dict[str, Any]:
        """Return the duration [s] of a test, the functions that it calls, and whether it passes.

        They are read from a file where neither the test nor the modules have changed since.
        """
        written, old = item.path.stat().st_mtime_ns, self.known.get(item.nodeid)
        if (
            old is None
            or old["written"] != written
            or any(old["stamp"].get(name) != at for name, at in self.stamp.items())
        ):
            old = {"written": written, "stamp": self.stamp, **traced(item, list(self.stamp))}
            self.known[item.nodeid] = old
            if len(self.known) % 100 == 0:
                self._save()
        return old

    def _save(self) -> None:
        self.record.parent.mkdir(parents=True, exist_ok=True)
        self.record.write_text(json.dumps(self.known))

    def _is_killed(
        self,
        mutant: Mutant,
        functions: dict[tuple[str, str], list[FunctionType]],
        chosen: Sequence[pytest.Item],
    ) -> bool:
        code = mutated_code(ROOT, mutant)
        replaced = functions.get((code.co_filename, code.co_qualname), [])

        def work() -> bool:
            for function in replaced:
                function.__code__ = code
            for item in chosen:
                seconds = self._traced(item)["seconds"]
                signal.setitimer(signal.ITIMER_PROF, LOADING + OFTEN * seconds)
                if fails(item):
                    return True
            return False

        assert replaced, mutant
        return in_child(work, OFTEN) is not False  # an error or the time limit kills it too


def fails(item: pytest.Item) -> bool:
    """Run a test, with its fixtures; return whether it fails."""
    for clear in CACHES:  # results of functions as they were before a change
        clear()
    noted = Failures()
    item.config.pluginmanager.register(noted)
    try:
        item.ihook.pytest_runtest_protocol(item=item, nextitem=None)
    finally:
        item.config.pluginmanager.unregister(noted)
    return noted.failed or not noted.passed


def caches() -> Iterator[Callable[[], None]]:
    """Yield functions that empty the caches of functions and objects of this repository."""
    for item in gc.get_objects():
        if isinstance(item, _lru_cache_wrapper):
            code = getattr(item.__wrapped__, "__code__", None)
            if code is not None and code.co_filename.startswith(str(ROOT)):
                yield item.cache_clear
        elif str(type(item).__module__).startswith("wearsim.") and hasattr(item, "__dict__"):
            kinds = type(item).__mro__
            names = {
                key
                for kind in kinds
                for key, value in vars(kind).items()
                if isinstance(value, cached_property)
            }
            if names:
                yield partial(forget, item, names)


def forget(item: object, names: Iterable[str]) -> None:
    """Remove cached properties of an object."""
    for name in names:
        vars(item).pop(name, None)


def load_kernels(items: Iterable[pytest.Item]) -> None:
    """Run one test of each file of whole tests, so that forked processes have compiled kernels."""
    files = {item.path: item for item in items if "evolution" in item.path.parts}
    for item in files.values():
        fails(item)


def cases_of(items: Iterable[pytest.Item]) -> dict[str, list[pytest.Item]]:
    """Return the cases of each test."""
    tests: dict[str, list[pytest.Item]] = {}
    for item in items:
        tests.setdefault(item.nodeid.partition("[")[0], []).append(item)
    return tests


def some_of(cases: Sequence[pytest.Item]) -> list[pytest.Item]:
    """Return at most `CASES` cases of a test, from its first to its last one."""
    last = len(cases) - 1
    return [cases[place] for place in sorted({round(k * last / (CASES - 1)) for k in range(CASES)})]


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
        return in_child(work, LONGEST) or {"passed": False, "seconds": math.inf, "calls": {}}
    found = work()  # in this process, which then holds the compiled kernels
    return work() if LIMIT < found["seconds"] <= 2.0 * LONGEST else found


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
    gc.unfreeze()  # objects of the collection of tests would not be listed
    for item in gc.get_objects():
        if isinstance(item, FunctionType) and item.__code__.co_filename in paths:
            code: CodeType = item.__code__
            found.setdefault((code.co_filename, code.co_qualname), []).append(item)
    return found


def equivalent() -> list[dict[str, Any]]:
    """Return the mutants, or the functions, in which a change has no effect on results."""
    listed: list[dict[str, Any]] = tomllib.loads(EQUIVALENT.read_text(encoding="utf-8"))["mutant"]
    return listed


def is_listed(mutant: Mutant, listed: Iterable[dict[str, Any]]) -> bool:
    """Return whether a mutant is one of those listed."""
    return any(
        fnmatchcase(mutant.module, one["module"])
        and fnmatchcase(mutant.function, one["function"])
        and one.get("line", mutant.line) == mutant.line
        and mutant.change in one.get("changes", [mutant.change])
        for one in listed
    )


def all_mutants(parts: Iterable[str]) -> list[Mutant]:
    """Return the mutants of all modules of packages, or of modules, except the equivalent ones."""
    found, left_out = [], equivalent()
    for part in parts:
        for path in modules_of(part):
            found += [one for one in mutants_of(ROOT, path) if not is_listed(one, left_out)]
    return found


def modules_of(part: str) -> list[Path]:
    """Return the files of a package, or of a module."""
    return [ROOT / part] if part.endswith(".py") else sorted((ROOT / part).rglob("*.py"))


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
