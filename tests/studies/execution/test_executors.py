"""Executors: every batch is run once, also if workers are killed."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from batch_works import (
    Deadly,
    Exiting,
    Held,
    KilledAsItSends,
    KilledAsItWrites,
    Raising,
    Squares,
    Unreadable,
    UnsendableError,
    surroundings,
)

from tests.interruptible import interruptible
from wearsim.errors import Mistake, ScenarioError, WorkerError
from wearsim.operating_system import processors
from wearsim.studies.execution.factory import executor
from wearsim.studies.execution.processes import AHEAD, named

HERE = Path(__file__).parents[1]
EXECUTORS = [("serial", None), ("threads", 2), ("threads", 1), ("processes", 2), ("processes", 1)]
TWOS = ["threads", "processes"]


def batches_of(size: int, count: int) -> Iterator[list[int]]:
    numbers = iter(range(count))
    return iter(lambda: list(itertools.islice(numbers, size)), [])


def squares(found: Iterator[tuple[list[int], list[tuple[int, int]]]]) -> dict[int, int]:
    rows = [pair for numbers, results in found for pair in zip(numbers, results, strict=True)]
    numbers = [number for number, _ in rows]
    assert len(set(numbers)) == len(numbers)  # each exactly once
    return {number: square for number, (square, _) in rows}


@pytest.mark.parametrize(("scheduler", "workers"), [*EXECUTORS, ("processes", 3)])
def test_results_do_not_depend_on_the_executor(scheduler: str, workers: int | None) -> None:
    with executor(scheduler, workers) as pool:
        for size in (1, 7, 100):
            found = squares(pool.results(Squares(), batches_of(size, 60)))
            assert found == {number: number * number for number in range(60)}, size


def test_executor_can_be_used_repeatedly() -> None:
    with executor("processes", 2) as pool:
        assert squares(pool.results(Squares(), iter([]))) == {}
        for count in (3, 8):
            assert len(squares(pool.results(Squares(), batches_of(1, count)))) == count


@pytest.mark.parametrize("scheduler", TWOS)
def test_batches_are_returned_as_they_finish(scheduler: str, tmp_path: Path) -> None:
    order = []
    with executor(scheduler, 2) as pool:
        for numbers, _ in pool.results(Held(tmp_path), batches_of(1, 6)):
            order += numbers
            if len(order) == 4:  # one batch may be queued behind the delayed one
                (tmp_path / "go").touch()
    assert order.index(0) >= 4
    assert sorted(order) == list(range(6))


@pytest.mark.parametrize(("scheduler", "workers"), EXECUTORS)
def test_number_of_batches_in_progress_is_limited(scheduler: str, workers: int | None) -> None:
    taken = itertools.count()
    with executor(scheduler, workers) as pool:
        found = pool.results(Squares(), ([next(taken)] for _ in itertools.count()))
        for received in range(1, 40):
            next(found)
            out = int(repr(taken)[6:-1]) - received
            assert out <= AHEAD * pool.workers
        found.close()


def test_workers_are_processes_with_one_thread_each() -> None:
    before = dict(os.environ)
    with executor("processes", 2) as pool:
        assert pool.describe == "2 processes"
        found = list(pool.results(Squares(0.05), batches_of(1, 8)))
        pids = {pid for _, results in found for _, pid in results}
        assert len(pids) == 2
        assert os.getpid() not in pids
        for _, results in pool.results(surroundings, batches_of(1, 4)):
            assert results == [("1", True)]
    assert dict(os.environ) == before
    with executor("processes", 1) as pool:  # a single worker needs no separate process
        ((_, results),) = pool.results(Squares(), iter([[3]]))
    assert results == [(9, os.getpid())]


def test_no_more_processes_than_realisations_are_started() -> None:
    with executor("processes", 4, realisations=2) as pool:
        assert (pool.workers, pool.describe) == (2, "2 processes")
        found = list(pool.results(Squares(0.1), batches_of(1, 4)))
    assert len({pid for _, results in found for _, pid in results}) == 2


def test_default_is_one_worker_per_available_processor() -> None:
    with executor("threads") as pool:
        assert pool.workers == processors()
    if hasattr(os, "sched_setaffinity"):
        ours = os.sched_getaffinity(0)
        try:
            os.sched_setaffinity(0, {min(ours)})
            assert processors() == 1
        finally:
            os.sched_setaffinity(0, ours)


@pytest.mark.parametrize("size", [1, 4])
def test_batches_of_a_killed_process_are_repeated(tmp_path: Path, size: int) -> None:
    messages: list[str] = []
    with executor("processes", 2, on_notice=messages.append) as pool:
        found = list(pool.results(Deadly(tmp_path, at=9, times=2), batches_of(size, 24)))
    numbers = [number for batch, _ in found for number in batch]
    assert sorted(numbers) == list(range(24))
    assert all(results == [n * n for n in batch] for batch, results in found)
    assert len(list(tmp_path.glob("killed *"))) == 2
    assert all(len(file.read_text()) == 1 for file in tmp_path.glob("done *"))  # none was run twice
    name = "realisation 9" if size == 1 else "realisations 8 to 11"
    cause = "was killed by SIGKILL (out of memory?)"
    assert messages == [f"a worker process {cause}; {name} will be done again"] * 2


@pytest.mark.parametrize("way", [KilledAsItSends, KilledAsItWrites])
def test_batch_of_process_killed_while_sending_is_repeated(
    tmp_path: Path, way: type[KilledAsItSends | KilledAsItWrites]
) -> None:
    with executor("processes", 2) as pool:
        work = way(tmp_path, 1_000_000)
        found = {numbers[0]: rows for numbers, rows in pool.results(work, batches_of(1, 6))}
    assert (tmp_path / "killed").exists()
    assert sorted(found) == list(range(6))
    assert all(results == [bytes(1_000_000)] for results in found.values())


def test_batch_that_kills_every_process_raises(tmp_path: Path) -> None:
    work = Deadly(tmp_path, at=5, times=10)
    with executor("processes", 2) as pool, pytest.raises(WorkerError) as caught:
        list(pool.results(work, batches_of(2, 200)))
    assert str(caught.value).startswith("3 worker processes died of realisations 4 to 5, the last")
    assert caught.value.realisations == (4, 5)
    assert caught.value.exit_code == 1
    assert len(list(tmp_path.glob("killed *"))) == 3
    assert list(tmp_path.glob("done *"))  # the other process continued


def test_process_killed_between_batches_is_replaced() -> None:
    messages: list[str] = []
    with executor("processes", 2, on_notice=messages.append) as pool:
        ((_, ((_, pid),)),) = pool.results(Squares(), iter([[1]]))
        os.kill(pid, signal.SIGKILL)
        while alive(pid):
            time.sleep(0.01)
        found = squares(pool.results(Squares(0.5), batches_of(1, 4)))
    assert found == {number: number * number for number in range(4)}
    assert len(messages) == 1
    assert "was killed by SIGKILL (out of memory?); realisation " in messages[0]


def test_exit_of_the_work_fails_its_batch_only() -> None:
    with executor("processes", 2) as pool:
        with pytest.raises(WorkerError, match=r"realisations 2 to 3 called sys.exit\('finished'\)"):
            list(pool.results(Exiting(), batches_of(2, 8)))
        assert list(pool.results(Exiting(), iter([[2]]))) == [([2], [4])]


def test_unwritable_temporary_folder_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with executor("processes", 2) as pool:
        found = pool.results(Squares(0.1), batches_of(1, 100))
        next(found)
        (folder,) = tmp_path.iterdir()
        folder.rename(tmp_path / "moved")
        with pytest.raises(WorkerError, match=r"batches cannot be exchanged through .*wearsim-"):
            list(found)


@pytest.mark.parametrize(("scheduler", "workers"), EXECUTORS)
def test_error_of_the_work_is_raised_unchanged(scheduler: str, workers: int | None) -> None:
    mistakes = [Mistake("load", "normal_force", "must be above zero")]
    work = Raising(ScenarioError, "rig.toml", mistakes)
    with executor(scheduler, workers) as pool, pytest.raises(ScenarioError) as caught:
        list(pool.results(work, batches_of(1, 10)))
    assert caught.value.file == "rig.toml"
    assert caught.value.mistakes == mistakes


def test_error_that_cannot_be_pickled_is_reported() -> None:
    with executor("processes", 2) as pool:
        work = Raising(UnsendableError, "this", "that")
        with pytest.raises(WorkerError, match="UnsendableError: this and that"):
            list(pool.results(work, batches_of(1, 10)))
        with pytest.raises(LookupError, match="cannot be read here"):
            list(pool.results(Unreadable(), batches_of(1, 10)))


@pytest.mark.parametrize("scheduler", TWOS)
def test_closed_study_does_not_wait_for_its_batches(scheduler: str, tmp_path: Path) -> None:
    with executor(scheduler, 2) as pool:
        found = pool.results(Held(tmp_path), batches_of(1, 100))
        next(found)
        found.close()
    assert not (tmp_path / "done").exists()
    (tmp_path / "go").touch()  # ends a thread that is still waiting


def alive(pid: int) -> bool:
    """Return whether a process is running and not a zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks into /proc")
@pytest.mark.parametrize(
    ("scheduler", "number"),
    [
        ("processes", signal.SIGINT),
        ("processes", signal.SIGKILL),
        pytest.param("dask", signal.SIGINT, marks=pytest.mark.slow),
    ],
)
def test_workers_end_with_the_study(tmp_path: Path, scheduler: str, number: signal.Signals) -> None:
    with subprocess.Popen(
        interruptible(HERE / "executor_run.py", scheduler),
        cwd=HERE.parents[1],
        env=os.environ | {"TMPDIR": str(tmp_path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as running:
        pids = {int(running.stdout.readline()) for _ in range(8)}
        assert len(pids) == 2
        assert all(map(alive, pids))
        if number == signal.SIGINT:  # a terminal sends it to the whole process group
            os.killpg(running.pid, number)
        else:
            running.send_signal(number)
        output = running.communicate()[1]
    assert running.returncode == -number
    assert output.count("KeyboardInterrupt") == (number == signal.SIGINT), output
    for _ in range(6000):  # a time limit of two minutes
        if not any(map(alive, pids)):
            break
        time.sleep(0.02)
    assert not any(map(alive, pids))
    assert list(tmp_path.iterdir()) == []


UNGUARDED = (
    "from wearsim.studies.execution.factory import executor\n"
    "def negatives(numbers):\n"
    "    return [-number for number in numbers]\n"
    "\n"
    "with executor({!r}, 2) as pool:\n"
    "    print(sorted(pool.results(negatives, iter([[1], [2]]))))\n"
    "\n"
)
INTERACTIVE = """
import code, sys
console = code.InteractiveConsole()
for line in sys.stdin.read().splitlines():
    console.push(line)
"""


def run_unguarded(folder: Path, scheduler: str, way: str) -> subprocess.CompletedProcess[str]:
    """Run a script without the `__main__` guard; check that it leaves no file behind."""
    text, work, temporary = UNGUARDED.format(scheduler), folder / "work", folder / "temporary"
    work.mkdir()
    temporary.mkdir()
    script = folder / "script.py"
    script.write_text(text)
    arguments = {
        "file": [script],
        "-c": ["-c", text],
        "stdin": ["-"],
        "console": ["-c", INTERACTIVE],
    }
    done = subprocess.run(
        [sys.executable, *arguments[way]],
        input=text,
        cwd=work,
        env=os.environ | {"PYTHONPATH": str(HERE.parents[1]), "TMPDIR": str(temporary)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert [*work.iterdir(), *temporary.iterdir()] == []
    return done


@pytest.mark.parametrize("way", ["file", "-c", "stdin", "console"])
def test_unguarded_script_runs_in_processes(tmp_path: Path, way: str) -> None:
    done = run_unguarded(tmp_path, "processes", way)
    assert done.stderr == ""
    assert done.stdout == "[([1], [-1]), ([2], [-2])]\n"


@pytest.mark.slow
@pytest.mark.parametrize("way", ["file", "-c", "stdin", "console"])
def test_unguarded_script_with_dask_runs_or_is_reported(tmp_path: Path, way: str) -> None:
    done = run_unguarded(tmp_path, "dask", way)
    if way in {"-c", "console"}:
        assert done.stdout == "[([1], [-1]), ([2], [-2])]\n", done.stderr
        return
    assert done.returncode == 1
    assert (
        'a script must run its study under `if __name__ == "__main__":`'
        in (done.stderr.splitlines()[-1])
    )
    if way == "file":  # the workers, which import the script, print nothing
        assert done.stderr.count("Traceback") == 1


def test_death_of_a_process_names_its_batch_only(tmp_path: Path) -> None:
    messages: list[str] = []
    with executor("processes", 3, on_notice=messages.append) as pool:
        work = Deadly(tmp_path, at=4, times=1)
        found = dict(pool.results(work, iter([(number,) for number in range(12)])))
    assert found == {(number,): [number * number] for number in range(12)}
    assert len(messages) == 1
    assert "realisation 4 will be done again" in messages[0]
    assert all(file.read_text() == "." for file in tmp_path.glob("done *"))
    assert len(list(tmp_path.glob("done *"))) == 12


def test_import_of_the_ensemble_api_does_not_import_loky() -> None:
    code = "import sys, wearsim.studies.ensemble.api as _; print({'loky'} & {*sys.modules})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"


@pytest.mark.parametrize(
    ("scheduler", "workers", "message"),
    [
        ("proceses", None, "there is no scheduler 'proceses', expected processes, threads, serial"),
        ("udp://host:1", None, "address of a Dask scheduler such as tcp://host:8786"),
        ("tcp://host", None, "there is no scheduler 'tcp://host', expected processes"),
        ("threads", 0, "workers must be 1 or more, got 0"),
        ("serial", 3, "one worker where the scheduler is 'serial', got 3"),
        ("tcp://host:1", 3, "the workers of tcp://host:1 are all used; leave out the number 3"),
    ],
)
def test_invalid_scheduler_raises_value_error(
    scheduler: str, workers: int | None, message: str
) -> None:
    with pytest.raises(ValueError, match=message), executor(scheduler, workers):
        pass


def test_realisations_are_described_briefly() -> None:
    assert named([4]) == "realisation 4"
    assert named(range(4, 8)) == "realisations 4 to 7"
    assert named([8, 4, 6]) == "3 realisations from 4 to 8"


def test_fractional_number_of_workers_raises_type_error() -> None:
    with (
        pytest.raises(TypeError, match=r"a whole number such as 4, got 2\.5"),
        executor("threads", 2.5),
    ):
        pass
